"""The `meta.json` of a SOG scene: what each byte of its pictures stands for, as tables to look it up in.

Version 2 stores scales and colours by codebooks, version 1 (without `version`) between a smallest and a
largest value. The format is defined by the PlayCanvas engine and splat-transform.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.json_file import as_count, decode_json, shown
from brushgs.io.pictures.limits import MAX_PIXELS
from brushgs.io.scenes.stored import Stored, parse_content, read_stored
from brushgs.values.arrays import F32, Array
from brushgs.values.notes import Training

NOTES = "brushgs"  # the key of what `Stored` holds, in files of ours
_CURE = "export it as SOG again"
_LEVELS = np.arange(256) / 255  # what a byte stands for between a smallest and a largest value
PALETTE_ROW = 64  # entries in a row of the picture of centroids
MAX_PALETTE = 1 << 16  # labels have 16 bits


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
    value = decode_json(path, content, _CURE, has_names=True)
    top = _Fields(path, "", value)
    version = top.values.get("version", 1.0)
    if version not in (1, 2):
        raise SceneError(path, f"must be SOG of version 1 or 2, got version {shown(version)}; {_CURE}")
    means, scales, quats, sh0 = (top.fields(name) for name in ("means", "scales", "quats", "sh0"))
    if version == 2:
        num_rows = as_count(top.values.get("count"), MAX_PIXELS)
        log_scales = np.tile(scales.codebook(), (3, 1))
        colors, opacities = np.tile(sh0.codebook(), (3, 1)), _LEVELS.astype(np.float32)
    else:
        num_rows = means.first_of_shape()
        log_scales = _between(*scales.ends(3))
        *color_rows, opacities = _between(*sh0.ends(4))
        colors = np.array(color_rows)
        if quats.values.get("encoding", "quaternion_packed") != "quaternion_packed":
            fact = f"quats.encoding {shown(quats.values['encoding'])} is not read"
            raise SceneError(path, f"{fact}; {_CURE}")
    if not num_rows:
        field = "count" if version == 2 else "means.shape"
        got = shown(top.values.get("count") if version == 2 else means.values.get("shape"))
        raise SceneError(path, f"{field} must be 1 to {MAX_PIXELS} Gaussians, got {got}; {_CURE}")
    return Meta(
        version=int(version),
        num_rows=num_rows,
        training=_training(top.values),
        means=_mean_tables(*means.ends(3)),
        log_scales=log_scales,
        colors=colors,
        opacities=opacities,
        pictures=(*means.files(2), *quats.files(1), *scales.files(1), *sh0.files(1)),  # type: ignore[arg-type]
        palette=_palette(top.fields("shN"), int(version)) if top.values.get("shN") is not None else None,
        stored=read_stored(path, lambda: parse_content(top.values.get(NOTES, {}))),
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


def _palette(fields: "_Fields", version: int) -> Palette | None:
    values = fields.values
    if values.get("bands") == 0:
        return None
    num_entries = bands = None
    if version == 2:
        num_entries, bands = as_count(values.get("count"), MAX_PALETTE), as_count(values.get("bands"), 3)
        for name, count, most in (("count", num_entries, MAX_PALETTE), ("bands", bands, 3)):
            if not count:
                got = shown(values.get(name))
                raise SceneError(fields.path, f"shN.{name} must be 1 to {most}, got {got}; {_CURE}")
        table = fields.codebook()
    else:
        low, high = fields.ends(1)
        table = _between(low, high)[0]
    centroids, labels = fields.files(2)
    return Palette(num_entries, bands, table, centroids, labels)


def _training(values: dict[str, Any]) -> Training:
    """How a scene was trained: `model`, or in older files `antialias`."""
    model = values.get("model")
    if model == "antialiased" or (model is None and values.get("antialias") is True):
        return "antialiased"
    return "2dgs" if model == "2dgs" else "default"


def mean_logs(means: Array) -> NDArray[np.float64]:
    """sign(x) log(1 + |x|) of coordinates, which `Meta.means` undoes."""
    wide = means.astype(np.float64)
    return np.asarray(np.sign(wide) * np.log1p(np.abs(wide)))


def _mean_tables(low: NDArray[np.float64], high: NDArray[np.float64]) -> F32:
    """Numbers lie evenly between the ends of sign(x) log(1 + |x|)."""
    logs = low[:, None] + (high - low)[:, None] * (np.arange(65536) / 65535)
    with np.errstate(over="ignore"):  # infinite means are found when rows are checked
        return np.asarray(np.sign(logs) * np.expm1(np.abs(logs)), np.float32)


def _between(low: NDArray[np.float64], high: NDArray[np.float64]) -> F32:
    """[n, 256] values evenly between n pairs of ends."""
    with np.errstate(over="ignore"):
        return np.asarray(low[:, None] + (high - low)[:, None] * _LEVELS, np.float32)


class _Fields:
    """One object of a `meta.json`; every method raises SceneError with the name of the field at fault."""

    def __init__(self, path: Path, name: str, value: object) -> None:
        if not isinstance(value, dict):
            what = f"{name} must be an object" if name else "must be a JSON object"
            raise SceneError(path, f"{what}, got {shown(value)}; {_CURE}")
        self.path, self.values = path, value
        self._prefix = f"{name}." if name else ""

    def fields(self, name: str) -> "_Fields":
        """An object inside this one."""
        return _Fields(self.path, self._prefix + name, self.values.get(name))

    def files(self, count: int) -> list[str]:
        """The names of so many pictures."""
        names = self.values.get("files")
        if not isinstance(names, list) or len(names) < count or not all(isinstance(n, str) for n in names):
            self._refuse("files", f"name {count} picture{'s' * (count > 1)}", names)
        return names[:count]  # type: ignore[index,no-any-return]

    def codebook(self) -> F32:
        """[256] values; those past the end of a shorter list are NaN.

        Some versions of splat-transform wrote null for the first one, which the engine then extrapolates.
        """
        values = self.values.get("codebook")
        if isinstance(values, list) and len(values) == 256 and values[0] is None and _are_numbers(values[1:]):
            values = [values[1] + (values[1] - values[255]) / 255, *values[1:]]
        if not isinstance(values, list) or not 1 <= len(values) <= 256 or not _are_numbers(values):
            self._refuse("codebook", "be a list of 1 to 256 numbers", values)
        table = np.full(256, np.nan, np.float32)
        with np.errstate(over="ignore"):
            table[: len(values)] = values  # type: ignore[arg-type]
        return table

    def ends(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Smallest and largest values, [count] each."""
        found = []
        for name in ("mins", "maxs"):
            values = self.values.get(name)
            if count == 1 and isinstance(values, float):
                values = [values]
            if not isinstance(values, list) or len(values) != count or not _are_numbers(values):
                self._refuse(name, f"be {count} number{'s' * (count > 1)}", values)
            found.append(np.array(values))
        return found[0], found[1]

    def first_of_shape(self) -> int | None:
        """The number of rows that `shape` states."""
        shape = self.values.get("shape")
        return as_count(shape[0], MAX_PIXELS) if isinstance(shape, list) and shape else None

    def _refuse(self, name: str, rule: str, value: object) -> None:
        raise SceneError(self.path, f"{self._prefix}{name} must {rule}, got {shown(value)}; {_CURE}")


def _are_numbers(values: list[object]) -> bool:
    """Whether all are finite numbers."""
    return all(isinstance(value, float) and math.isfinite(value) for value in values)
