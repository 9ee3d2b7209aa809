"""Gaussians become a PLY file of the standard layout, which every 3DGS viewer and trainer reads."""

from pathlib import Path

import numpy as np

from brushgs.formats.files import replacing
from brushgs.formats.scenes.finite_logs import logits_of, logs_of
from brushgs.formats.scenes.ply_header import BRUSH, MIP, STROKES
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.formats.scenes.view_comments import comment_lines
from brushgs.values.arrays import Array
from brushgs.values.gaussians import Gaussians

_BLOCK_ROWS = 1 << 14


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> None:
    """Write Gaussians as binary little-endian float32, log-scales and opacity logits.

    The values read back within float32 rounding of the logs. No infinity is written: a scale of 0 and
    opacities of 0 and 1 become finite logs that read back as exactly 0 and 1. That Gaussians are antialiased
    is a comment, in the words of Brush. Where strokes have brushes, these are a column `brush` of bytes, the
    last one.

    Args:
        gaussians: N >= 1 Gaussians.
        path: the name of the file; appears when it is complete.
        known: what comments state.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    names = _names(gaussians.sh.shape[1])
    lines = "".join(f"property float {name}\n" for name in names)
    lines += f"property uchar {BRUSH}\n" if gaussians.brushes is not None else ""
    comment = header_comments(known)
    begin = f"ply\nformat binary_little_endian 1.0\n{comment}element vertex {len(gaussians)}\n"
    header = f"{begin}{lines}end_header\n"
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(header.encode("ascii"))
        for start in range(0, len(gaussians), _BLOCK_ROWS):
            file.write(_encode(gaussians.take(slice(start, start + _BLOCK_ROWS)), len(names)))


def header_comments(known: Stored) -> str:
    """Header lines that record what is known, each with its newline."""
    texts = [STROKES] * known.is_strokes + [MIP] * known.antialiased
    others = comment_lines(known._replace(is_strokes=False, antialiased=False))
    return "".join(f"{line}\n" for line in [*(f"comment {text}" for text in texts), *others])


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
    rows[:, -8] = logits_of(gaussians.opacities)
    rows[:, -7:-4] = logs_of(gaussians.scales)
    rows[:, -4:] = _representable(gaussians.quats)
    if gaussians.brushes is None:
        return rows.tobytes()
    return np.hstack([rows.view(np.uint8), gaussians.brushes[:, None]]).tobytes()


def _representable(quats: Array) -> Array:
    """Quaternions scaled to what float32 can hold; their length has no meaning."""
    return quats if quats.dtype == np.float32 else quats / np.abs(quats).max(axis=1, keepdims=True)
