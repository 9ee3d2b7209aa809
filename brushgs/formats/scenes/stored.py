"""The notes of a file of strokes: its scene, its first view, its brushes.

Formats with room for notes hold them as one JSON object: PLY in comments, SOG and glTF in their JSON, SPZ in
an extension. Numbers are exact: they have as many digits as needed, and points are base64 of little-endian
float64.
"""

import json
import warnings
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from brushgs.errors import SceneWarning
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.schema import fault
from brushgs.values.arrays import F64, U8
from brushgs.values.camera import Camera, FirstView, Photograph
from brushgs.values.gaussians import Gaussians

# Characters of JSON: 4,096 points take 131,072 (outlines have at most 512), an order takes 174,764.
MAX_TEXT = 1 << 19
_MOST_ORDERED = 1 << 16  # most rows with a recorded order: row numbers have 16 bits
_MAX_POINTS = 4000
_MAX_NAME = 200
_MOST_BRUSHES = 256  # the number of a brush is a byte
_MOST_ROWS = 1 << 40  # rows of a brush: more than any file holds
_MAX_BRUSH_TEXT = 1 << 16  # characters of JSON of the names of all brushes

_Three = tuple[float, float, float]
_Turn = Annotated[float, Meta(ge=-1e6, le=1e6)]
_Share = Annotated[float, Meta(ge=0, le=1)]
_Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


class _Photograph(Struct):
    """The photograph from which the scene was predicted: fields of `Photograph` and its `Camera`."""

    viewmat: bytes
    K: bytes
    width: Annotated[int, Meta(ge=1, le=1 << 20)]
    height: Annotated[int, Meta(ge=1, le=1 << 20)]
    pivot: _Three
    cone: Annotated[float, Meta(ge=0, le=pi)]


class _View(Struct, kw_only=True):
    """The first view, with the fields of `FirstView`; arrays of points are base64."""

    up: _Three
    azimuth: _Turn
    elevation: Annotated[float, Meta(ge=-0.5 * pi, le=0.5 * pi)]
    front: _Turn | None = None
    has_surroundings: bool | None = None
    is_front_sure: bool | None = None
    probability: _Share | None = None
    ups: Annotated[tuple[tuple[_Axis, _Share], ...], Meta(max_length=6)] | None = None
    eye: _Three | None = None
    whole: bytes | None = None
    points: bytes
    photograph: _Photograph | None = None


class _Content(Struct):
    """The JSON object of a `Stored`."""

    scene: Annotated[str, Meta(max_length=_MAX_NAME)] | None = None
    first_view: _View | None = None
    brushes: Annotated[tuple[Annotated[str, Meta(min_length=1)], ...], Meta(max_length=_MOST_BRUSHES)] = ()
    brush_counts: (
        Annotated[tuple[Annotated[int, Meta(ge=0, le=_MOST_ROWS)], ...], Meta(max_length=_MOST_BRUSHES)]
        | None
    ) = None
    strokes: bool = False
    antialiased: bool = False
    order: bytes | None = None


class Stored(NamedTuple):
    """The notes of a file."""

    scene: str | None = None  # name of the scene
    first_view: FirstView | None = None  # first view of the scene
    brushes: tuple[str, ...] = ()  # names or paths, by the number of a brush
    # Number of rows of each brush, in formats without a column of brushes, whose rows are sorted by brush.
    # None if strokes have no brushes, or the format has a column.
    counts: tuple[int, ...] | None = None
    is_strokes: bool = False  # whether the rows are strokes
    antialiased: bool = False  # whether they were trained with the opacity compensation of Mip-Splatting
    # [N] original row number of each stroke, in a format that sorts rows: broken color depends on the number
    # of a stroke. None if the order is unchanged, or there are more than 65,536 rows.
    order: NDArray[np.int64] | None = None

    def sorted_by(self, rows: Gaussians, order: NDArray[np.int64] | None) -> "Stored":
        """The notes for a format without a column of brushes, with `counts` and `order` set.

        `rows` are sorted by brush; `order` [N] is the original number of each row, None if unchanged.
        """
        counts = None if rows.brushes is None else tuple(np.bincount(rows.brushes).tolist())
        kept = order if self.is_strokes and len(rows) <= _MOST_ORDERED else None
        return self._replace(counts=counts, order=kept)

    def rows_of_brushes(self, num_rows: int) -> U8 | None:
        """[num_rows] brush of each row, from `counts`; None if there are none, or their sum is wrong."""
        if self.counts is None or sum(self.counts) != num_rows:
            return None
        return np.repeat(np.arange(len(self.counts), dtype=np.uint8), self.counts)

    def in_order(self, columns: Columns) -> Columns:
        """Columns in their original row order, as copies; the same columns if no valid order is recorded."""
        order = self.order
        if order is None or not np.array_equal(np.sort(order), np.arange(len(columns.means))):
            return columns
        return columns.take(np.argsort(order))


NOTHING = Stored()  # no notes


def content_of(stored: Stored) -> dict[str, Any]:
    """The JSON object of `stored`; empty if there are no notes.

    A first view with too many points is omitted. Raises ValueError if the names of the brushes are too long.
    """
    flags = {"strokes": stored.is_strokes, "antialiased": stored.antialiased}
    content: dict[str, Any] = {name: True for name, is_so in flags.items() if is_so}
    if stored.scene:
        content["scene"] = "".join(c if c.isprintable() else "?" for c in stored.scene[:_MAX_NAME])
    first_view = stored.first_view
    if first_view is not None and len(first_view.points) <= _MAX_POINTS:
        content["first_view"] = {
            name: _written(value)
            for name in _View.__struct_fields__
            if (value := getattr(first_view, name)) is not None
        }
    if stored.brushes:
        content["brushes"] = stored.brushes
        if (length := len(json.dumps(content["brushes"]))) > _MAX_BRUSH_TEXT:
            rule = f"names of brushes must take at most {_MAX_BRUSH_TEXT:,} characters, got {length:,}"
            raise ValueError(f"save: {rule}; use fewer or shorter ones")
    if stored.order is not None:
        content["order"] = stored.order.astype("<u2").tobytes()
    if stored.counts is not None:
        content["brush_counts"] = stored.counts
    built: dict[str, Any] = msgspec.to_builtins(content)  # bytes become base64
    return built


def text_of(content: dict[str, Any]) -> str:
    """A JSON object as ASCII text without blanks; "" for an empty one."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False) if content else ""


def parse_text(text: str) -> Stored:
    """Parse the text of a JSON object. Raises ValueError if it is damaged."""
    if not text:
        return Stored()
    try:
        content = msgspec.json.decode(text[: MAX_TEXT + 1])
    except (msgspec.DecodeError, RecursionError):
        raise ValueError("it is no JSON") from None
    return parse_content(content)


def parse_content(content: object) -> Stored:
    """Parse a JSON object. Raises ValueError if it is damaged."""
    try:
        return _stored(msgspec.convert(content, _Content))
    except msgspec.ValidationError as error:
        raise ValueError(fault(error, content, _Content)) from None
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _stored(content: _Content) -> Stored:
    if content.scene is not None and not content.scene.isprintable():
        raise ValueError("the name of a scene must be printable")
    order = content.order
    if order is not None and (len(order) % 2 or len(order) > 2 * _MOST_ORDERED):
        raise ValueError(f"an order must be at most {_MOST_ORDERED} numbers of 2 bytes, got {len(order)}")
    return Stored(
        scene=content.scene,
        first_view=None if content.first_view is None else _first_view(content.first_view),
        brushes=content.brushes,
        counts=content.brush_counts,
        is_strokes=content.strokes,
        antialiased=content.antialiased,
        order=None if order is None else np.frombuffer(order, "<u2").astype(np.int64),
    )


def read_stored(path: Path, read: Callable[[], Stored]) -> Stored:
    """The notes of a file; `read` calls `parse_content` or `parse_text`.

    If they are damaged, a SceneWarning says so and the notes are empty.
    """
    try:
        return read()
    except ValueError as error:
        notes = "the notes on its strokes (view, brushes, order)"
        message = f"{path}: {notes} cannot be read ({error}); it is read as any scene"
        warnings.warn(SceneWarning(message), stacklevel=3)
        return Stored()


def _written(value: Any) -> Any:
    """A field of a first view as JSON."""
    if isinstance(value, Photograph):
        camera, own = value.camera, {"pivot": value.pivot, "cone": value.cone}
        of_camera = {name: getattr(camera, name) for name in ("viewmat", "K", "width", "height")}
        return {name: _written(one) for name, one in (of_camera | own).items()}
    if isinstance(value, np.ndarray) and value.ndim == 2:
        return np.ascontiguousarray(value, "<f8").tobytes()
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _first_view(view: _View) -> FirstView:
    found = {name: value for name, value in msgspec.structs.asdict(view).items() if value is not None}
    found |= {name: _finite(np.array(found[name])) for name in ("up", "eye") if name in found}
    found |= {name: _points(found[name]) for name in ("whole", "points") if name in found}
    if abs(float(np.linalg.norm(found["up"])) - 1) > 1e-9:
        raise ValueError("up must be a unit vector")
    if view.photograph is not None:
        found["photograph"] = _photograph(view.photograph)
    whole = found.get("whole")
    if whole is not None and (whole.shape != (2, 3) or (whole[0] > whole[1]).any()):
        raise ValueError("whole must be a low and a high corner")
    return FirstView(**found)


def _photograph(photograph: _Photograph) -> Photograph:
    own = photograph
    if (len(own.viewmat), len(own.K)) != (128, 72):
        raise ValueError(f"a camera must be 16 and 9 numbers, got {len(own.viewmat)} and {len(own.K)} bytes")
    viewmat, K = (_finite(np.frombuffer(data, "<f8").astype(np.float64)) for data in (own.viewmat, own.K))
    camera = Camera(viewmat.reshape(4, 4), K.reshape(3, 3), own.width, own.height)
    return Photograph(camera, _finite(np.array(own.pivot)), own.cone)


def _points(data: bytes) -> F64:
    if not data or len(data) % 24 or len(data) > 24 * _MAX_POINTS:
        raise ValueError(f"points must be 1 to {_MAX_POINTS} rows of 24 bytes, got {len(data)} bytes")
    return _finite(np.frombuffer(data, "<f8").reshape(-1, 3).astype(np.float64))


def _finite(values: F64) -> F64:
    if not (np.abs(values) <= np.finfo(np.float32).max).all():  # same limit as the means of a scene
        raise ValueError("coordinates must be finite and fit float32")
    return values
