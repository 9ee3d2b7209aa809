"""What is asked of an output file, compared with what its format offers: one sentence refuses the rest."""

from dataclasses import dataclass
from fractions import Fraction
from importlib.util import find_spec
from math import isclose
from pathlib import Path

from brushgs.formats.format import Format, VideoCodec
from brushgs.formats.registry import VIDEO_FORMATS, VIDEO_SUFFIXES, by_suffix, find_written
from brushgs.formats.table import VIDEO_CODECS
from brushgs.options.table import listed

INSTALL_PYAV = "pip install 'brushgs[video]'"


def frame_rate(fps: float) -> Fraction:
    """Frames a second as a fraction: 23.976, 29.97 and their like mean 24000/1001, 30000/1001.

    Args:
        fps: > 0. Those of television are within 0.0015 of their fractions.
    """
    if fps != round(fps) and isclose(fps, round(fps * 1.001) / 1.001, abs_tol=0.0015):
        return Fraction(round(fps * 1.001) * 1000, 1001)
    return Fraction(fps).limit_denominator(1001)


@dataclass(frozen=True)
class Encoding:
    """How the pixels of a file are stored."""

    bits: int  # of each channel
    has_alpha: bool  # whether transparency is stored


def check_encoder(path: str | Path, row: Format) -> None:
    """Refuse a video or an AVIF picture without the package that encodes it, before any work.

    Raises ValueError if it is not installed.
    """
    if row.package and find_spec(row.package) is None:
        is_film = row.kind == "video"
        instead = "numbered frames, such as %04d.png" if is_film else "a .png"
        what = "films" if is_film else "AVIF pictures"
        raise ValueError(f"{Path(path).name}: {what} need PyAV; {INSTALL_PYAV}, or write {instead}")


def check_bits(path: str | Path, bits: int | None) -> int:
    """The number of bits a channel in a picture file: what is asked for, or the usual one of the format.

    Raises ValueError if the format does not offer so many, or its encoder is not installed.
    """
    picture_format = find_written("picture", path)
    assert picture_format is not None, "the suffix was checked"
    check_encoder(path, picture_format)
    return _bits(path, picture_format, bits)


def choose_encoding(
    path: str | Path, *, codec: str | None = None, bits: int | None = None, transparent: bool = False
) -> Encoding:
    """How a picture or video is to be stored; the suffix decides the format.

    Args:
        path: the file.
        codec: a name in `VIDEO_CODECS`; None for the usual one of the format.
        bits: of each channel; None for the usual number.
        transparent: whether what is painted has no background.

    Raises:
        ValueError: if the format does not offer what is asked for, or its encoder is not installed.
    """
    picture_format = find_written("picture", path)
    check_encoder(path, picture_format or video_format_of(path))
    if picture_format is not None and codec is not None:
        raise ValueError(f"codec must be omitted for {_suffix(path)}, which is no video, got {codec!r}")
    offer = codec_of(path, codec) if picture_format is None else picture_format
    if transparent and not offer.holds_alpha:
        films = [row.suffixes[0] for row in VIDEO_FORMATS if VIDEO_CODECS[row.codecs[0]].holds_alpha]
        suffixes = films if picture_format is None else [".png"]
        others = listed([Path(path).with_suffix(suffix).name for suffix in suffixes])
        fact = f"background must not be transparent in {Path(path).name}, whose format holds no transparency"
        raise ValueError(f"{fact}; choose a colour, or write {others}")
    return Encoding(_bits(path, offer, bits), transparent)


def video_format_of(path: str | Path) -> Format:
    """The format of a video by its suffix. Raises ValueError."""
    video_format = by_suffix(VIDEO_FORMATS, path)
    if video_format is None:
        raise ValueError(f"path of a video must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    return video_format


def codec_of(path: str | Path, codec: str | None = None) -> VideoCodec:
    """The codec of a video: the one asked for, or the usual one of the suffix. Raises ValueError."""
    offered = video_format_of(path).codecs
    if codec is not None and codec not in offered:
        rule = "be omitted for" if offered == ("gif",) else f"be {listed(offered)} for"
        others = [row.suffixes[0] for row in VIDEO_FORMATS if codec in row.codecs]
        cure = f"; {listed(others)} takes that" if others else ""
        raise ValueError(f"codec must {rule} {_suffix(path)}, got {codec!r}{cure}")
    return VIDEO_CODECS[codec or offered[0]]


def _bits(path: str | Path, offer: Format | VideoCodec, bits: int | None) -> int:
    if bits is not None and bits not in offer.bits:
        known = listed([str(number) for number in sorted(offer.bits)])
        name = "" if isinstance(offer, Format) else f" with {offer.name}"
        raise ValueError(f"bits must be {known} for {_suffix(path)}{name}, got {bits}")
    return bits or offer.bits[0]


def _suffix(path: str | Path) -> str:
    return Path(path).suffix.lower()
