"""Read the .4dgs format with the package `fourdgs`: Gaussians that appear, move linearly and fade.

The duration comes from the file. The format has two models of time. The model of births is a formula, and is
read; objects that move rigidly on tracks are moved by the package at each moment. The model of keyframes with
differences is refused by name. Source: https://4dgs.dev/docs/spec, sections 3 and 6.
"""

import struct
import zlib
from dataclasses import replace
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import cut_off, damaged, open_plain
from brushgs.formats.moving.formula import RawRows, clip_of, open_nothing
from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.formats.scenes.rows import SceneFile
from brushgs.values.arrays import F32
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

# Exceptions of the package on damaged files, beside its own.
_DAMAGED = (ValueError, LookupError, TypeError, ArithmeticError, EOFError, struct.error, zlib.error)


def open_moving(path: Path) -> MovingScene:
    """Read a .4dgs file.

    Raises SceneError if the package is missing, the file is damaged or has another model of time, or no row
    can be drawn.
    """
    scene = _read(path)
    duration, cutoff = float(scene.duration_sec), float(scene.header.cutoff)
    if not (isfinite(duration) and duration >= 0):
        raise SceneError(path, f"its duration must be 0 or more seconds, got {duration:g}; export it again")
    stored = scene.gaussians
    num_rows = stored.count
    if num_rows == 0:
        raise SceneError(path, "holds no Gaussians; export it again")
    sh = _harmonics(stored)
    columns = Columns.empty(num_rows, 1 + sh.shape[1])
    columns.means[:] = stored.positions
    columns.quats[:] = stored.rotations[:, [3, 0, 1, 2]]
    columns.scales[:] = stored.scales
    columns.opacities[:] = stored.colors[:, 3]
    columns.sh[:, 0], columns.sh[:, 1:] = stored.colors[:, :3], sh
    columns.standardize(Encoding(scales="linear", colors="rgb"))
    motion = stored.motions.astype(np.float32)[:, None]
    raw = RawRows(
        columns,
        {"mu_t": stored.mu_t} | {f"motion_{axis}": motion[:, 0, axis] for axis in range(3)},
        stored.mu_t,
        sqrt(2) * stored.sigma_t.astype(np.float64),  # its bell is exp(-(d / sigma)^2 / 2)
        "sigma_t",
        motion,
        scales=stored.scales.astype(np.float32),
        is_logit=False,
        windows=np.stack([stored.win_lo, stored.win_hi], axis=1).astype(np.float64),
    )
    file = SceneFile(path, "4dgs", num_rows, columns.sh.shape[1], open_nothing)
    clock = 0.0, duration
    moving = clip_of(file, raw, duration=duration, clock=clock, is_open=True, cutoff=cutoff, is_timed=True)
    return _on_tracks(path, scene, moving)


def _read(path: Path) -> Any:
    """Read a file with the package; returns its `Scene`."""
    try:
        import fourdgs
    except ImportError:
        cure = "install it with pip install 'brushgs[4dgs]'"
        raise SceneError(path, f"is a .4dgs scene, which the package fourdgs reads; {cure}") from None
    with open_plain(path, "scene file") as file:
        content = file.read()
    try:
        return fourdgs.read(content, recover_truncated=False)
    except fourdgs.TruncatedFile as error:
        raise cut_off(path, str(error)) from None
    except (fourdgs.UnsupportedCodec, fourdgs.UnsupportedVersion) as error:
        cure = "name the scene files of its moments that it was made of"
        raise SceneError(path, f"is a .4dgs scene that is not read ({error}); {cure}") from None
    except (fourdgs.FourdgsError, *_DAMAGED) as error:
        raise damaged(path, str(error)) from None


def _harmonics(stored: Any) -> F32:
    """[N, k - 1, 3] coefficients above degree 0; the file stores bytes, all of red first."""
    if stored.sh is None:
        return np.zeros((stored.count, 0, 3), np.float32)
    from fourdgs.quantization import sh_coefficient

    coefficients = sh_coefficient(stored.sh).reshape(stored.count, 3, -1)
    return np.asarray(coefficients.transpose(0, 2, 1), np.float32)


def _on_tracks(path: Path, scene: Any, moving: MovingScene) -> MovingScene:
    """The clip with the motion of the object tracks of the file, if it has any.

    Raises SceneError if rows were dropped, as object ids would no longer match.
    """
    objects, ids = scene.objects, scene.gaussians.object_id
    if ids is None or not objects.tracks:
        return moving
    assert moving.notes is not None
    if moving.notes.rows_dropped:
        raise SceneError(path, "has rows that cannot be drawn among things on tracks; export it again")

    def sample(time: float) -> Gaussians:
        moment = moving.sample(time)
        means, quats = objects.apply(
            centers=moment.means.astype(np.float64),
            orientations=moment.quats[:, [1, 2, 3, 0]].astype(np.float64),
            object_ids=ids,
            t=time,
        )
        quats = quats[:, [3, 0, 1, 2]]
        return replace(moment, means=means.astype(np.float32), quats=quats.astype(np.float32))

    assert moving.resting is not None
    tracked = np.isin(ids, [track.object_id for track in objects.tracks])
    return replace(moving, sample=sample, resting=moving.resting & ~tracked)
