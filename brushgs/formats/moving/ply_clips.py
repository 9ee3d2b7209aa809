"""Read moving scenes from PLY files, with columns for time beside those of a still scene: time is 0 to 1.

SpaceTimeGaussian "lite" has motion of degree 3 and plain colors: f_dc holds display-encoded RGB, not a
coefficient. In the .ftgs.ply files of FreeTimeGS each Gaussian has a time, a duration and a velocity.
Header comments of FreeTimeGsVanilla may give the number of moments (`n_frames`), a minimum duration
(`min_duration`) and whether velocities are used (`use_velocity`). Its minimum opacity, 0.0001, only saves
time, and is not applied.
Sources: Li et al. 2024, Spacetime Gaussian Feature Splatting, layout of the reference implementation; Wang et
al. 2025, FreeTimeGS, equations 1 and 4; version 1 of the layout of FreeTimeGsVanilla.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.moving.formula import NOMINAL_DURATION, NOMINAL_RATE, RawRows, clip_of
from brushgs.formats.scenes import ply
from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.formats.scenes.ply_header import open_header, read_columns
from brushgs.formats.scenes.rows import SceneFile
from brushgs.values.arrays import F32
from brushgs.values.moving import MovingScene


class TimedPly(NamedTuple):
    """All rows of a PLY file, not yet checked."""

    file: SceneFile  # header of the file
    columns: Columns  # of the still layout, as stored
    more: dict[str, F32]  # name -> [N] values of each requested further column
    comments: dict[str, str]  # comments of the header: first word -> remaining words

    def stack(self, *names: str) -> F32:
        """[N, number of names] some of the further columns."""
        return np.stack([self.more[name] for name in names], axis=1)


def read_timed(path: Path, what: str, names: Sequence[str]) -> TimedPly:
    """Read a PLY file with the columns `names` for time, beside those of a still scene.

    `what` is the name of the format. Raises SceneError if the file is damaged or lacks a column.
    """
    file = ply.open_scene(path)
    header, _ = open_header(path)
    vertex = header.find("vertex")
    assert vertex is not None, "open_scene refuses files without"
    for name in names:
        if name not in vertex.names:
            rule = f"no property {name!r} among {len(vertex.names)} read, which a {what} has"
            raise SceneError(path, f"{rule}; export it with all of its columns")
    columns, _ = file.read_columns(is_raw=True)
    more = read_columns(path, header, vertex, names, np.float32)
    unknown = tuple(name for name in file.unknown if name not in names)
    source = replace(file, format=f"{what}, {file.format.removeprefix('PLY, ')}", unknown=unknown)
    comments = dict(line.partition(" ")[::2] for line in header.comments)
    return TimedPly(source, columns, dict(zip(names, more, strict=True)), comments)


_MOTION = tuple(f"motion_{index}" for index in range(9))  # three of d, three of d^2, three of d^3
_SPIN = tuple(f"omega_{index}" for index in range(4))


def open_spacetime(path: Path) -> MovingScene:
    """Read a SpaceTimeGaussian lite PLY.

    Raises SceneError if it is damaged, lacks a column, or no row can be drawn.
    """
    rows = read_timed(path, "SpaceTimeGaussian PLY", ("trbf_center", "trbf_scale", *_MOTION, *_SPIN))
    widths = np.exp(rows.more["trbf_scale"].astype(np.float64))  # infinite: a row that never fades
    rows.columns.standardize(Encoding(colors="rgb"))
    stored = {name: rows.more[name] for name in ("trbf_center", *_MOTION, *_SPIN)}
    motion = rows.stack(*_MOTION).reshape(-1, 3, 3)
    centers, spin = rows.more["trbf_center"], rows.stack(*_SPIN)
    return clip_of(rows.file, RawRows(rows.columns, stored, centers, widths, "trbf_scale", motion, spin))


_VELOCITY = tuple(f"velocity_{index}" for index in range(3))
_MAX_FRAMES = 10_000_000  # 90 hours


def open_freetime(path: Path) -> MovingScene:
    """Read a FreeTimeGS PLY.

    Raises SceneError if it is damaged, lacks a column, has other time units, or no row can be drawn.
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
    widths = sqrt(2) * durations  # its bell is exp(-(d / duration)^2 / 2)
    raw = RawRows(rows.columns, stored, rows.more["time"], widths, "log_duration", motion)
    frames = _number(rows, "n_frames", 0.0)
    if frames > _MAX_FRAMES or frames != int(frames):
        rule = f"n_frames must be a whole number of at most {_MAX_FRAMES}, got {frames:g}"
        raise SceneError(path, f"{rule}; export it again")
    return clip_of(rows.file, raw, duration=(frames - 1) / NOMINAL_RATE if frames >= 1 else NOMINAL_DURATION)


def _number(rows: TimedPly, name: str, otherwise: float) -> float:
    """A number >= 0 from a header comment; `otherwise` if there is none."""
    text = rows.comments.get(name, str(otherwise))
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0 <= number < inf:
        rule = f"its header says '{name} {text[:40]}', which must be a number of 0 or more"
        raise SceneError(rows.file.path, f"{rule}; export it again")
    return number
