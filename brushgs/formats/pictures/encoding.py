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
    """How the pixels of a file are stored.

    Attributes:
        bits: of each channel.
        has_alpha: whether transparency is stored.
    """

    bits: int
    has_alpha: bool


def check_encoder(path: str | Path, row: Format) -> None:
    """Refuse a video or an AVIF picture without the package that encodes it, before any work.

    Raises:
        ValueError: if it is not installed.
    """
    if not row.package or find_spec(row.package) is not None:
        return
    what, instead = (
        ("films", "numbered frames, such as %04d.png") if row.kind == "video" else ("AVIF pictures", "a .png")
    )
    raise ValueError(f"{Path(path).name}: {what} need PyAV; {INSTALL_PYAV}, or write {instead}")


def check_bits(path: str | Path, bits: int | None) -> int:
    """The number of bits a channel in a picture file: what is asked for, or the usual one of the format.

    Raises:
        ValueError: if the format does not offer so many, or its encoder is not installed.
    """
    picture_format = find_written("picture", path)
    assert picture_format is not None, "the suffix was checked"
    check_encoder(path, picture_format)
    return _bits(path, picture_format, bits)


def choose_encoding(
    path: str | Path, *, codec: str | None = None, bits: int | None = None, transparent: bool = False
) -> Encoding:
    """How a picture or video is to be stored.

    Args:
        path: the suffix decides the format.
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
        raise ValueError(
            f"background must not be transparent in {Path(path).name}, whose format holds no transparency; "
            f"choose a colour, or write {listed(_with_alpha(Path(path), is_video=picture_format is None))}"
        )
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
        raise ValueError(f"codec must {rule} {_suffix(path)}, got {codec!r}{_elsewhere(codec)}")
    return VIDEO_CODECS[codec or offered[0]]


def _elsewhere(codec: str) -> str:
    """Which suffixes take a codec, as a cure."""
    suffixes = [row.suffixes[0] for row in VIDEO_FORMATS if codec in row.codecs]
    return f"; {listed(suffixes)} takes that" if suffixes else ""


def _bits(path: str | Path, offer: Format | VideoCodec, bits: int | None) -> int:
    if bits is not None and bits not in offer.bits:
        known = listed([str(number) for number in sorted(offer.bits)])
        name = "" if isinstance(offer, Format) else f" with {offer.name}"
        raise ValueError(f"bits must be {known} for {_suffix(path)}{name}, got {bits}")
    return bits or offer.bits[0]


def _with_alpha(path: Path, *, is_video: bool) -> list[str]:
    """Names of files of the same kind that hold transparency."""
    if not is_video:
        return [path.with_suffix(".png").name]
    return [
        path.with_suffix(row.suffixes[0]).name
        for row in VIDEO_FORMATS
        if VIDEO_CODECS[row.codecs[0]].holds_alpha
    ]


def _suffix(path: str | Path) -> str:
    return Path(path).suffix.lower()
