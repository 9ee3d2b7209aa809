"""Gaussians become a .splat file: rows of 32 bytes, which early web viewers read.

It has no header, so nothing is recorded beside the rows; and no spherical harmonics above degree 0. Rows keep
their order.
"""

import warnings
from pathlib import Path

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.formats.files import replacing
from brushgs.formats.format import SPLAT_ROW_SIZE
from brushgs.formats.scenes.finite_logs import finite_scales, unit_quats
from brushgs.formats.scenes.rounding import rounded
from brushgs.formats.scenes.splat import QUAT_ZERO
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.options.table import listed
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

_ROW = np.dtype([("means", "<f4", 3), ("scales", "<f4", 3), ("rgba", "u1", 4), ("quats", "u1", 4)])
_BLOCK_ROWS = 1 << 16


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> None:
    """Write rows of 32 bytes; nothing that is `known` of the scene is recorded.

    A SceneWarning names what is lost and matters to a painting. Colours outside 0 to 1 are clipped.

    Raises:
        SceneError: if the file cannot be written.
    """
    assert _ROW.itemsize == SPLAT_ROW_SIZE
    with replacing(path) as temporary, temporary.open("wb") as file:
        for start in range(0, len(gaussians), _BLOCK_ROWS):
            file.write(_encode(gaussians.take(slice(start, start + _BLOCK_ROWS))))
    lost = [
        *(["colours that change with the view"] if gaussians.sh.shape[1] > 1 else []),
        *(["that they are strokes"] if known.is_strokes else []),
        *(["brushes"] if gaussians.brushes is not None else []),
        *(["that they are antialiased"] if gaussians.antialiased else []),
    ]
    if lost:
        message = f"a .splat file does not hold {listed(lost)}, which are lost; .ply, .spz and .sog do"
        warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=3)


def _encode(gaussians: Gaussians) -> bytes:
    """Rows of the file."""
    rows = np.empty(len(gaussians), _ROW)
    rows["means"] = gaussians.means
    rows["scales"] = finite_scales(gaussians.scales)
    rows["rgba"][:, :3] = rounded((gaussians.sh[:, 0] * C0 + 0.5) * 255, 255)
    rows["rgba"][:, 3] = rounded(gaussians.opacities * 255, 255)
    rows["quats"] = rounded(unit_quats(gaussians.quats) * QUAT_ZERO + QUAT_ZERO, 255)
    return rows.tobytes()
