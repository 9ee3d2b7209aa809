"""Gaussians become a PLY file of the standard layout, which every 3DGS viewer and trainer reads."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array
from brushgs.io.files import replacing
from brushgs.io.scenes.ply_header import BRUSH, MIP, STROKES
from brushgs.io.scenes.view_comments import comment_lines
from brushgs.scene import FirstView, Gaussians

# exp(-104) is 0 in float32 and 1 / (1 + exp(-+104)) is 1 or 0: finite values in place of infinite logs.
_INFINITE_LOG = 104.0
_LARGEST_LOG = 88.722  # just below the log of the largest float32, so that exp of it is finite
_BLOCK_ROWS = 1 << 14


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
) -> None:
    """Write Gaussians as binary little-endian float32, log-scales and opacity logits.

    The values read back within float32 rounding of the logs. No infinity is written: a scale of 0 and
    opacities of 0 and 1 become finite logs that read back as exactly 0 and 1. That Gaussians are antialiased
    is a comment, in the words of Brush. Where strokes have brushes, these are a column `brush` of bytes, the
    last one.

    Args:
        gaussians: N >= 1 Gaussians.
        path: the name of the file; appears when it is complete.
        is_strokes: whether a comment states that they are strokes: painting keeps all of them by default.
        scene: name of the scene that they were made of, for a comment.
        first_view: of that scene, for comments.
        brushes: names of the brushes that strokes have rows of, for comments; omitted where they have none.

    Raises:
        ValueError: if there are no Gaussians, a value is too large for float32, a row lies beyond the brushes
            that are named, or their names are too long.
        SceneError: if the file cannot be written.
    """
    if not len(gaussians):
        raise ValueError(
            "save: gaussians must have at least one row, got 0; an empty scene cannot be read back"
        )
    for name in ("means", "quats", "scales", "sh"):
        if np.abs(getattr(gaussians, name)).max() > np.finfo(np.float32).max:
            raise ValueError(f"save: {name} must fit float32, got larger values; shrink the scene first")
    names = _names(gaussians.sh.shape[1])
    lines = "".join(f"property float {name}\n" for name in names)
    lines += f"property uchar {BRUSH}\n" if gaussians.brushes is not None else ""
    has_brushes = gaussians.brushes is not None
    if gaussians.brushes is not None and brushes and (row := int(gaussians.brushes.max())) >= len(brushes):
        raise ValueError(
            f"save: brushes must be rows of the {len(brushes)} that are named, got {row}; choose them anew"
        )
    stated = [STROKES] * is_strokes + [MIP] * gaussians.antialiased
    comments = [
        *(f"comment {text}" for text in stated),
        *comment_lines(scene, first_view, brushes if has_brushes else ()),
    ]
    comment = "".join(f"{line}\n" for line in comments)
    begin = f"ply\nformat binary_little_endian 1.0\n{comment}element vertex {len(gaussians)}\n"
    header = f"{begin}{lines}end_header\n"
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(header.encode("ascii"))
        for start in range(0, len(gaussians), _BLOCK_ROWS):
            file.write(_encode(gaussians.take(slice(start, start + _BLOCK_ROWS)), len(names)))


def _names(num_terms: int) -> tuple[str, ...]:
    """Properties in their standard order."""
    rest = (f"f_rest_{index}" for index in range(3 * (num_terms - 1)))
    head = ("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2")
    tail = ("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")
    return (*head, *rest, *tail)


def _encode(gaussians: Gaussians, width: int) -> bytes:
    """Rows of the file."""
    num_rows, num_rest = len(gaussians), 3 * (gaussians.sh.shape[1] - 1)
    rows = np.zeros((num_rows, width), dtype="<f4")  # normals stay 0: Gaussians have none
    rows[:, 0:3] = gaussians.means
    rows[:, 6:9] = gaussians.sh[:, 0]
    rows[:, 9 : 9 + num_rest] = gaussians.sh[:, 1:].transpose(0, 2, 1).reshape(num_rows, num_rest)
    rows[:, -8] = _logit(gaussians.opacities)
    rows[:, -7:-4] = _log(gaussians.scales)
    rows[:, -4:] = _representable(gaussians.quats)
    if gaussians.brushes is None:
        return rows.tobytes()
    return np.hstack([rows.view(np.uint8), gaussians.brushes[:, None]]).tobytes()


def _log(values: Array) -> NDArray[np.float64]:
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(values, dtype=np.float64), -_INFINITE_LOG, _LARGEST_LOG))


def _logit(values: Array) -> NDArray[np.float64]:
    wide = values.astype(np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(wide) - np.log1p(-wide), -_INFINITE_LOG, _INFINITE_LOG))


def _representable(quats: Array) -> Array:
    """Quaternions scaled to what float32 can hold; their length has no meaning."""
    return quats if quats.dtype == np.float32 else quats / np.abs(quats).max(axis=1, keepdims=True)
