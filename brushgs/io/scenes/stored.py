"""What a file of strokes records beside its columns: its scene, its first view, its brushes.

All formats with a place for notes hold them as one JSON object: PLY in comments, SOG and glTF in their JSON,
SPZ in an extension. Numbers survive to the last bit: they have as many digits as are needed, and points are
base64 of little-endian float64.
"""

import base64
import binascii
import json
import warnings
from collections.abc import Callable, Sequence
from dataclasses import fields
from math import isfinite, pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneWarning
from brushgs.io.scenes.columns import Columns
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

# Characters of JSON: 4,096 points take 131,072, and outlines have at most 512; an order takes 174,764.
MAX_TEXT = 1 << 19
_MOST_ORDERED = 1 << 16  # rows whose order is recorded: numbers of 16 bits
_MAX_POINTS = 4000
_MAX_NAME = 200
_AXES = {sign + axis for sign in "+-" for axis in "xyz"}
_MOST_BRUSHES = 256  # a row of them is a byte
_MOST_ROWS = 1 << 40  # of a brush: more than any file holds
_MAX_BRUSH_TEXT = 1 << 16  # characters of JSON: names of all brushes


class Stored(NamedTuple):
    """What a file records.

    Attributes:
        scene: the name of the scene.
        first_view: how that is seen.
        brushes: names or paths of the brushes, by row.
        counts: how many rows have each brush, in formats without a column for it: the rows are in the order
            of their brushes. None where strokes have no brushes, or a column.
        is_strokes: whether the rows are strokes.
        antialiased: whether the rows were trained with the opacity compensation of Mip-Splatting.
        order: [N] of strokes in a format that sorts rows, the place that each row had: colours are broken by
            the number of a stroke. None where they lie in order, or are more than 65,536.
    """

    scene: str | None = None
    first_view: FirstView | None = None
    brushes: tuple[str, ...] = ()
    counts: tuple[int, ...] | None = None
    is_strokes: bool = False
    antialiased: bool = False
    order: NDArray[np.int64] | None = None

    def sorted_by(self, rows: Gaussians, order: NDArray[np.int64] | None) -> "Stored":
        """The same for a format without a column of brushes, whose rows are in the order of their brushes.

        Args:
            rows: as the file has them.
            order: [N] which row of those given each is; None if they lie in order.
        """
        counts = None if rows.brushes is None else tuple(np.bincount(rows.brushes).tolist())
        kept = order if self.is_strokes and len(rows) <= _MOST_ORDERED else None
        return self._replace(counts=counts, order=kept)

    def rows_of_brushes(self, num_rows: int) -> NDArray[np.uint8] | None:
        """[num_rows] the brush of each row, from `counts`; None if there are none, or they do not add up."""
        if self.counts is None or sum(self.counts) != num_rows:
            return None
        return np.repeat(np.arange(len(self.counts), dtype=np.uint8), self.counts)

    def in_order(self, columns: Columns) -> Columns:
        """Columns in the order that their rows had before a format sorted them; copies."""
        order = self.order
        if order is None or not np.array_equal(np.sort(order), np.arange(len(columns.means))):
            return columns
        restored = Columns.empty(len(order), columns.sh.shape[1])
        restored.brushes = None if columns.brushes is None else np.empty_like(columns.brushes)
        for field in fields(Columns):
            column = getattr(columns, field.name)
            if column is not None:
                getattr(restored, field.name)[order] = column
        return restored


NOTHING = Stored()  # known of a scene


def content_of(stored: Stored) -> dict[str, Any]:
    """The JSON object that holds what is stored; empty where there is nothing to say.

    A first view of too many points is omitted.

    Raises:
        ValueError: if the names of the brushes are too long.
    """
    content: dict[str, Any] = {}
    if stored.is_strokes:
        content["strokes"] = True
    if stored.antialiased:
        content["antialiased"] = True
    if stored.scene:
        content["scene"] = "".join(c if c.isprintable() else "?" for c in stored.scene[:_MAX_NAME])
    first_view = stored.first_view
    if first_view is not None and len(first_view.points) <= _MAX_POINTS:
        content["first_view"] = {
            name: write(value)
            for name, (write, _) in _CODECS.items()
            if (value := getattr(first_view, name)) is not None
        }
    if stored.brushes:
        content["brushes"] = list(stored.brushes)
        if (length := len(json.dumps(content["brushes"]))) > _MAX_BRUSH_TEXT:
            raise ValueError(
                f"save: names of brushes must take at most {_MAX_BRUSH_TEXT:,} characters, got {length:,}; "
                "use fewer or shorter ones"
            )
    if stored.order is not None:
        content["order"] = base64.b64encode(stored.order.astype("<u2").tobytes()).decode("ascii")
    if stored.counts is not None:
        content["brush_counts"] = list(stored.counts)
    return content


def text_of(content: dict[str, Any]) -> str:
    """A JSON object as ASCII text without blanks."""
    return json.dumps(content, separators=(",", ":"), allow_nan=False)


def parse_text(text: str) -> Stored:
    """What the text of a JSON object records.

    Raises:
        ValueError: if it is damaged.
    """
    if not text:
        return Stored()
    try:
        content = json.loads(text[: MAX_TEXT + 1])
    except RecursionError as error:
        raise ValueError(f"damaged: {error}") from None
    return parse_content(content)


def parse_content(content: object) -> Stored:
    """What a JSON object records.

    Raises:
        ValueError: if it is damaged.
    """
    if not isinstance(content, dict):
        raise ValueError("no object")
    try:
        order = content.get("order")
        scene, view, counts = (content.get(name) for name in ("scene", "first_view", "brush_counts"))
        read = None
        if view is not None:
            read = {name: read(view[name]) for name, (_, read) in _CODECS.items() if name in view}
        return Stored(
            scene=None if scene is None else _name(scene),
            first_view=None if read is None else FirstView(**read),
            brushes=_brushes(content.get("brushes", [])),
            counts=None if counts is None else _counts(counts),
            is_strokes=_read_flag(content.get("strokes", False)),
            antialiased=_read_flag(content.get("antialiased", False)),
            order=None if order is None else _read_order(order),
        )
    except (TypeError, KeyError, AttributeError, RecursionError, OverflowError) as error:
        raise ValueError(f"damaged: {error}") from None


def read_stored(path: Path, read: Callable[[], Stored]) -> Stored:
    """What a file records; where that is damaged a SceneWarning says so, and it is as if there were nothing.

    Args:
        path: the file, for the message.
        read: `parse_content` or `parse_text` of what the file holds.
    """
    try:
        return read()
    except ValueError as error:
        message = f"{path}: the view in its header cannot be read ({error}); the strokes are framed anew"
        warnings.warn(SceneWarning(message), stacklevel=3)
        return Stored()


def _write_points(points: NDArray[np.float64]) -> str:
    return base64.b64encode(np.ascontiguousarray(points, "<f8").tobytes()).decode("ascii")


def _read_points(value: Any) -> NDArray[np.float64]:
    try:
        data = base64.b64decode(value, validate=True)
    except binascii.Error as error:
        raise ValueError(str(error)) from None
    if not data or len(data) % 24 or len(data) > 24 * _MAX_POINTS:
        raise ValueError(f"points must be 1 to {_MAX_POINTS} rows of 24 bytes, got {len(data)} bytes")
    points = np.frombuffer(data, "<f8").reshape(-1, 3).astype(np.float64)
    return _finite(points)


def _read_order(value: Any) -> NDArray[np.int64]:
    try:
        data = base64.b64decode(value, validate=True)
    except binascii.Error as error:
        raise ValueError(str(error)) from None
    if len(data) % 2 or len(data) > 2 * _MOST_ORDERED:
        raise ValueError(
            f"an order must be at most {_MOST_ORDERED} numbers of 2 bytes, got {len(data)} bytes"
        )
    return np.frombuffer(data, "<u2").astype(np.int64)


def _read_bounds(value: Any) -> NDArray[np.float64]:
    bounds = _read_points(value)
    if bounds.shape != (2, 3) or (bounds[0] > bounds[1]).any():
        raise ValueError("whole must be a low and a high corner")
    return bounds


def _read_vector(value: Any) -> NDArray[np.float64]:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("a vector must have three numbers")
    return _finite(np.array([_read_number(number) for number in value]))


def _read_up(value: Any) -> NDArray[np.float64]:
    up = _read_vector(value)
    if abs(float(np.linalg.norm(up)) - 1) > 1e-9:
        raise ValueError("up must be a unit vector")
    return up


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    if not (np.abs(values) <= np.finfo(np.float32).max).all():  # as the means of a scene
        raise ValueError("coordinates must be finite and fit float32")
    return values


def _read_number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
        raise ValueError("a number must be finite")
    return float(value)


def _between(low: float, high: float) -> Callable[[Any], float]:
    def read(value: Any) -> float:
        number = _read_number(value)
        if not low <= number <= high:
            raise ValueError(f"a number must lie in {low:g} to {high:g}")
        return number

    return read


def _read_flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError("a flag must be true or false")
    return value


def _read_ups(value: Any) -> tuple[tuple[str, float], ...]:
    if not isinstance(value, list) or len(value) > len(_AXES):
        raise ValueError("ups must be a list of at most six axes")
    pairs = [(name, _between(0, 1)(share)) for name, share in value]
    if any(name not in _AXES for name, _ in pairs):
        raise ValueError("ups must name axes")
    return tuple(pairs)


def _name(value: Any) -> str:
    if not isinstance(value, str) or len(value) > _MAX_NAME or not value.isprintable():
        raise ValueError("the name of a scene must be a short text")
    return value


def _brushes(value: Any) -> tuple[str, ...]:
    if not isinstance(value, list) or len(value) > _MOST_BRUSHES:
        raise ValueError(f"brushes must be a list of at most {_MOST_BRUSHES} names")
    if not all(isinstance(name, str) and name for name in value):
        raise ValueError("brushes must be names")
    return tuple(value)


def _counts(value: Any) -> tuple[int, ...]:
    if not isinstance(value, list) or len(value) > _MOST_BRUSHES:
        raise ValueError(f"brush_counts must be a list of at most {_MOST_BRUSHES} numbers")
    counts = [_between(0, _MOST_ROWS)(count) for count in value]
    if any(count != int(count) for count in counts):
        raise ValueError("brush_counts must be whole numbers")
    return tuple(map(int, counts))


def _listed(value: Sequence[Any]) -> list[Any]:
    return [item.tolist() if isinstance(item, np.generic) else item for item in value]


# Field of `FirstView` -> how it is written as JSON and read from it. Fields that are None are not written.
_CODECS: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "up": (_listed, _read_up),
    "azimuth": (float, _between(-1e6, 1e6)),
    "elevation": (float, _between(-0.5 * pi, 0.5 * pi)),
    "front": (float, _between(-1e6, 1e6)),
    "has_surroundings": (bool, _read_flag),
    "is_front_sure": (bool, _read_flag),
    "probability": (float, _between(0, 1)),
    "ups": (_listed, _read_ups),
    "eye": (_listed, _read_vector),
    "whole": (_write_points, _read_bounds),
    "points": (_write_points, _read_points),
}
