"""Choose the encoding of an output file, and refuse options that its format does not support."""

from fractions import Fraction
from importlib.util import find_spec
from math import isclose
from pathlib import Path
from typing import NamedTuple

from brushgs.formats.format import Format, VideoCodec
from brushgs.formats.registry import VIDEO_FORMATS, VIDEO_SUFFIXES, by_suffix, find_written
from brushgs.formats.table import VIDEO_CODECS
from brushgs.options.table import listed

INSTALL_PYAV = "pip install 'brushgs[video]'"


def frame_rate(fps: float) -> Fraction:
    """Frames per second as a fraction; 23.976, 29.97 and similar rates become 24000/1001, 30000/1001.

    Args:
        fps: > 0. Within 0.0015 of a television rate it is taken for that rate.
    """
    if fps != round(fps) and isclose(fps, round(fps * 1.001) / 1.001, abs_tol=0.0015):
        return Fraction(round(fps * 1.001) * 1000, 1001)
    return Fraction(fps).limit_denominator(1001)


class Encoding(NamedTuple):
    """How the pixels of a file are stored."""

    bits: int  # per channel
    has_alpha: bool  # whether alpha is stored
    codec: str | None = None  # of a video: a name in `VIDEO_CODECS`; None for the default of the suffix


_NEEDS = {
    "video": f"films need PyAV; {INSTALL_PYAV}, or write numbered frames, such as %04d.png",
    "picture": f"AVIF pictures need PyAV; {INSTALL_PYAV}, or write a .png",
    "layered": "Photoshop files need psd-tools; pip install 'brushgs[psd]', or write .ora",
}


def check_encoder(path: str | Path, row: Format) -> None:
    """Raise ValueError if the package that encodes a file is not installed. Called before any work starts."""
    if row.package and find_spec(row.package) is None:
        raise ValueError(f"{Path(path).name}: {_NEEDS[row.kind]}")


def choose_encoding(
    path: str | Path, *, codec: str | None = None, bits: int | None = None, transparent: bool = False
) -> Encoding:
    """Choose the encoding of a picture or video; the suffix decides the format.

    Args:
        path: the file.
        codec: a name in `VIDEO_CODECS`; None for the default of the format.
        bits: per channel; None for the default.
        transparent: whether the picture has no background.

    Raises:
        ValueError: if the format does not support an option, or its encoder is not installed.
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
        raise ValueError(f"{fact}; choose a color, or write {others}")
    if bits is not None and bits not in offer.bits:
        known = listed([str(number) for number in sorted(offer.bits)])
        name = "" if isinstance(offer, Format) else f" with {offer.name}"
        raise ValueError(f"bits must be {known} for {_suffix(path)}{name}, got {bits}")
    return Encoding(bits or offer.bits[0], transparent, codec)


def video_format_of(path: str | Path) -> Format:
    """The format of a video by its suffix. Raises ValueError for another suffix."""
    video_format = by_suffix(VIDEO_FORMATS, path)
    if video_format is None:
        raise ValueError(f"path of a video must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    return video_format


def codec_of(path: str | Path, codec: str | None = None) -> VideoCodec:
    """The codec of a video: as requested, or the default of the suffix. Raises ValueError if unsupported."""
    offered = video_format_of(path).codecs
    if codec is not None and codec not in offered:
        rule = "be omitted for" if offered == ("gif",) else f"be {listed(offered)} for"
        others = [row.suffixes[0] for row in VIDEO_FORMATS if codec in row.codecs]
        cure = f"; {listed(others)} takes that" if others else ""
        raise ValueError(f"codec must {rule} {_suffix(path)}, got {codec!r}{cure}")
    return VIDEO_CODECS[codec or offered[0]]


def _suffix(path: str | Path) -> str:
    return Path(path).suffix.lower()
