"""The PLY files of SpaceTimeGaussian "lite": motion of degree 3, and plain colours.

Time runs from 0 to 1. f_dc holds display-encoded RGB, not a coefficient: the lite model has no harmonics.
Source: Li et al. 2024, Spacetime Gaussian Feature Splatting, layout of the reference implementation.
"""

from pathlib import Path

import numpy as np

from brushgs.formats.moving.clip import RawRows, clip_of
from brushgs.formats.moving.ply_columns import read_timed
from brushgs.formats.scenes.encoding import Encoding
from brushgs.values.moving import MovingScene

_MOTION = tuple(f"motion_{index}" for index in range(9))  # three of d, three of d^2, three of d^3
_SPIN = tuple(f"omega_{index}" for index in range(4))


def open_moving(path: Path) -> MovingScene:
    """Read a SpaceTimeGaussian lite PLY.

    Raises:
        SceneError: if it is damaged, lacks a column, or no row of it can be drawn.
    """
    rows = read_timed(path, "SpaceTimeGaussian PLY", ("trbf_center", "trbf_scale", *_MOTION, *_SPIN))
    widths = np.exp(rows.more["trbf_scale"].astype(np.float64))  # infinite: a row that never fades
    rows.columns.standardize(Encoding(colors="rgb"))
    stored = {name: rows.more[name] for name in ("trbf_center", *_MOTION, *_SPIN)}
    motion = rows.stack(*_MOTION).reshape(-1, 3, 3)
    raw = RawRows(
        rows.columns, stored, rows.more["trbf_center"], widths, "trbf_scale", motion, rows.stack(*_SPIN)
    )
    return clip_of(rows.file, raw)
