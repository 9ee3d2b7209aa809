"""The .ftgs.ply files of FreeTimeGS: each Gaussian has a moment, a duration and a velocity.

Time runs from 0 to 1, over `n_frames` moments where a comment counts them. The other columns are those of a
still scene. Source: Wang et al. 2025, FreeTimeGS, equations 1 and 4; version 1 of the layout of
FreeTimeGsVanilla, whose header says more in comments: a floor of durations (`min_duration`), and whether
velocities are used (`use_velocity`). Its floor of opacity, 0.0001, only saves time, and is not applied.
"""

from math import isfinite, sqrt
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.moving.clip import NOMINAL_DURATION, NOMINAL_RATE, RawRows, clip_of
from brushgs.formats.moving.ply_columns import TimedPly, read_timed
from brushgs.values.moving import MovingScene

_VELOCITY = tuple(f"velocity_{index}" for index in range(3))
_MAX_FRAMES = 10_000_000  # 90 hours


def open_moving(path: Path) -> MovingScene:
    """Read a FreeTimeGS PLY.

    Raises:
        SceneError: if it is damaged, lacks a column, counts time in other units, or no row of it can be
            drawn.
    """
    rows = read_timed(path, "FreeTimeGS PLY", ("time", "log_duration", *_VELOCITY))
    units = rows.comments.get("time_units", "normalized")
    if units != "normalized":
        rule = f"its header says 'time_units {units[:40]}', and time from 0 to 1 ('normalized') is read"
        raise SceneError(path, f"{rule}; export it so")
    shortest = _number(rows, "min_duration", 0.0)
    durations = np.maximum(np.exp(rows.more["log_duration"].astype(np.float64)), shortest)
    motion = rows.stack(*_VELOCITY)[:, None]
    if rows.comments.get("use_velocity") == "0":
        motion = np.zeros_like(motion)
    stored = {name: rows.more[name] for name in ("time", *_VELOCITY)}
    # Its bell is exp(-(d / duration)^2 / 2).
    widths = sqrt(2) * durations
    raw = RawRows(rows.columns, stored, rows.more["time"], widths, "log_duration", motion)
    frames = _number(rows, "n_frames", 0.0)
    if frames > _MAX_FRAMES or frames != int(frames):
        rule = f"n_frames must be a whole number of at most {_MAX_FRAMES}, got {frames:g}"
        raise SceneError(path, f"{rule}; export it again")
    return clip_of(rows.file, raw, duration=(frames - 1) / NOMINAL_RATE if frames >= 1 else NOMINAL_DURATION)


def _number(rows: TimedPly, name: str, otherwise: float) -> float:
    """A number >= 0 that a comment states; `otherwise` if none does."""
    text = rows.comments.get(name)
    if text is None:
        return otherwise
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not (isfinite(number) and number >= 0):
        rule = f"its header says '{name} {text[:40]}', which must be a number of 0 or more"
        raise SceneError(rows.file.path, f"{rule}; export it again")
    return number
