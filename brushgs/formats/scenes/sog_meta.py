"""The `meta.json` of a SOG scene: what each byte of its pictures stands for, as tables to look it up in.

Version 2 stores scales and colours by codebooks, version 1 (without `version`) between a smallest and a
largest value. The format is defined by the PlayCanvas engine and splat-transform.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, TypeVar

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from brushgs.errors import SceneError
from brushgs.formats.json_file import as_count, shown
from brushgs.formats.pictures.limits import MAX_PIXELS
from brushgs.formats.scenes.stored import Stored, parse_content, read_stored
from brushgs.formats.schema import convert, decode, refused
from brushgs.values.arrays import F32, Array
from brushgs.values.notes import Training

NOTES = "brushgs"  # the key of what `Stored` holds, in files of ours
_CURE = "export it as SOG again"
_LEVELS = np.arange(256) / 255  # what a byte stands for between a smallest and a largest value
PALETTE_ROW = 64  # entries in a row of the picture of centroids
MAX_PALETTE = 1 << 16  # labels have 16 bits

E = TypeVar("E")
_Codebook = Annotated[list[float | None], msgspec.Meta(min_length=1, max_length=256)]
_Pictures = Annotated[list[str], msgspec.Meta(min_length=1)]  # the first counts
_TwoPictures = Annotated[list[str], msgspec.Meta(min_length=2)]


class _Quats(Struct):
    files: _Pictures
    encoding: Any = "quaternion_packed"


class _Ends(Struct, Generic[E]):
    """Smallest and largest values."""

    mins: E
    maxs: E
    files: _Pictures


class _Means(_Ends[tuple[float, float, float]], kw_only=True):
    files: _TwoPictures
    shape: list[Any] | None = None


class _Palette1(_Ends[float | tuple[float]], kw_only=True):
    files: _TwoPictures


class _Coded(Struct):
    codebook: _Codebook
    files: _Pictures


class _Palette2(Struct):
    count: Annotated[int, msgspec.Meta(ge=1, le=MAX_PALETTE)]
    bands: Annotated[int, msgspec.Meta(ge=1, le=3)]
    codebook: _Codebook
    files: _TwoPictures


class _Scene(Struct, kw_only=True):
    """What both versions have."""

    means: _Means
    quats: _Quats
    sh_n: Any = msgspec.field(name="shN", default=None)  # degree 0 may state nothing but "bands"
    model: Any = None
    antialias: Any = None  # of older files
    stored: Any = msgspec.field(name=NOTES, default_factory=dict)


class _Scene1(_Scene, kw_only=True):
    scales: _Ends[tuple[float, float, float]]
    sh0: _Ends[tuple[float, float, float, float]]


class _Scene2(_Scene, kw_only=True):
    count: Annotated[int, msgspec.Meta(ge=1, le=MAX_PIXELS, description=f"1 to {MAX_PIXELS} Gaussians")]
    scales: _Coded
    sh0: _Coded


class _Version(Struct):
    version: Any = 1


@dataclass(frozen=True)
class Palette:
    """Spherical harmonics of degree 1 and more, shared by Gaussians.

    Attributes:
        num_entries: labels are smaller; None if the file does not state it.
        bands: 1 to 3; None if the width of the picture tells it.
        values: [256] coefficient that a byte stands for.
        centroids: picture of the entries, 64 in a row, each (bands + 1)^2 - 1 pixels wide.
        labels: picture of 16-bit numbers, low byte first.
    """

    num_entries: int | None
    bands: int | None
    values: F32
    centroids: str
    labels: str


@dataclass(frozen=True)
class Meta:
    """A `meta.json` of either version.

    Attributes:
        version: 1 or 2.
        num_rows: Gaussians.
        training: how they were trained.
        means: [3, 65536] coordinate that a 16-bit number stands for, by axis.
        log_scales: [3, 256] by axis.
        colors: [3, 256] coefficient of degree 0, by channel.
        opacities: [256] logits in version 1, 0 to 1 in version 2.
        pictures: names of the pictures of the means (low and high bytes), quats, scales, colours.
        palette: None without spherical harmonics above degree 0.
        stored: what a file of ours records.
    """

    version: int
    num_rows: int
    training: Training
    means: F32
    log_scales: F32
    colors: F32
    opacities: F32
    pictures: tuple[str, str, str, str, str]
    palette: Palette | None
    stored: Stored


def parse_meta(path: Path, content: bytes) -> Meta:
    """The meaning of a `meta.json`.

    Args:
        path: the file, or the archive that it is in, for messages.
        content: the JSON text.

    Raises:
        SceneError: if it is no JSON, or a field is missing or unusable; names the field.
    """
    version = decode(path, content, _Version, _CURE, has_names=True).version
    if version not in (1, 2):
        raise SceneError(path, f"must be SOG of version 1 or 2, got version {shown(version)}; {_CURE}")
    scene: _Scene1 | _Scene2
    if version == 2:
        scene = decode(path, content, _Scene2, _CURE, has_names=True)
        num_rows = scene.count
        log_scales = np.tile(_table(path, "scales", scene.scales.codebook), (3, 1))
        colors = np.tile(_table(path, "sh0", scene.sh0.codebook), (3, 1))
        opacities = _LEVELS.astype(np.float32)
    else:
        scene = decode(path, content, _Scene1, _CURE, has_names=True)
        shape = scene.means.shape or [None]
        num_rows = as_count(shape[0], MAX_PIXELS) or 0
        if not num_rows:
            raise refused(path, "means.shape", f"1 to {MAX_PIXELS} Gaussians", scene.means.shape, _CURE)
        if scene.quats.encoding != "quaternion_packed":
            raise SceneError(path, f"quats.encoding {shown(scene.quats.encoding)} is not read; {_CURE}")
        log_scales = _between(scene.scales.mins, scene.scales.maxs)
        *color_rows, opacities = _between(scene.sh0.mins, scene.sh0.maxs)
        colors = np.array(color_rows)
    low, high = scene.means.files[:2]
    return Meta(
        version=int(version),
        num_rows=num_rows,
        training=_training(scene),
        means=_mean_tables(scene.means),
        log_scales=log_scales,
        colors=colors,
        opacities=opacities,
        pictures=(low, high, scene.quats.files[0], scene.scales.files[0], scene.sh0.files[0]),
        palette=_palette(path, scene.sh_n, int(version)),
        stored=read_stored(path, lambda: parse_content(scene.stored)),
    )


def count_palette(width: int, height: int, palette: Palette) -> tuple[int, int] | None:
    """Number of entries and of bands in a picture of centroids; None if its size does not fit the palette."""
    num_rest, is_whole = divmod(width, PALETTE_ROW)
    bands = {3: 1, 8: 2, 15: 3}.get(num_rest)
    num_entries = min(palette.num_entries or PALETTE_ROW * height, PALETTE_ROW * height)
    is_fitting = not is_whole and bands is not None and palette.bands in (None, bands)
    is_fitting = is_fitting and num_entries == (palette.num_entries or num_entries)
    if not is_fitting or bands is None or PALETTE_ROW * height > MAX_PALETTE:
        return None
    return num_entries, bands


def _palette(path: Path, value: Any, version: int) -> Palette | None:
    if value is None or (isinstance(value, dict) and value.get("bands") == 0):
        return None
    if version == 2:
        of_2 = convert(path, value, _Palette2, _CURE, "shN")
        return Palette(of_2.count, of_2.bands, _table(path, "shN", of_2.codebook), *of_2.files[:2])
    of_1 = convert(path, value, _Palette1, _CURE, "shN")
    table = _between(np.ravel(of_1.mins), np.ravel(of_1.maxs))[0]
    return Palette(None, None, table, *of_1.files[:2])


def _training(scene: _Scene) -> Training:
    """How a scene was trained: `model`, or in older files `antialias`."""
    if scene.model == "antialiased" or (scene.model is None and scene.antialias is True):
        return "antialiased"
    return "2dgs" if scene.model == "2dgs" else "default"


def mean_logs(means: Array) -> NDArray[np.float64]:
    """sign(x) log(1 + |x|) of coordinates, which `Meta.means` undoes."""
    wide = means.astype(np.float64)
    return np.asarray(np.sign(wide) * np.log1p(np.abs(wide)))


def _mean_tables(means: _Means) -> F32:
    """Numbers lie evenly between the ends of sign(x) log(1 + |x|)."""
    low, high = np.array(means.mins), np.array(means.maxs)
    logs = low[:, None] + (high - low)[:, None] * (np.arange(65536) / 65535)
    with np.errstate(over="ignore"):  # infinite means are found when rows are checked
        return np.asarray(np.sign(logs) * np.expm1(np.abs(logs)), np.float32)


def _between(lows: ArrayLike, highs: ArrayLike) -> F32:
    """[n, 256] values evenly between n pairs of ends."""
    low, high = np.array(lows), np.array(highs)
    with np.errstate(over="ignore"):
        return np.asarray(low[:, None] + (high - low)[:, None] * _LEVELS, np.float32)


def _table(path: Path, place: str, values: list[float | None]) -> F32:
    """[256] values of a codebook; those past the end of a shorter list are NaN.

    Some versions of splat-transform wrote null for the first one, which the engine then extrapolates.
    """
    known = [value for value in values if value is not None]
    if values[0] is None and len(values) == 256 and len(known) == 255:
        known = [known[0] + (known[0] - known[-1]) / 255, *known]
    if len(known) < len(values):
        raise refused(path, f"{place}.codebook", "a list of numbers", values, _CURE)
    table = np.full(256, np.nan, np.float32)
    with np.errstate(over="ignore"):
        table[: len(known)] = known
    return table
