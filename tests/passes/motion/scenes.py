"""Small scenes that move, with rows that correspond."""

from dataclasses import replace

import numpy as np

from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.quats import quat_products, rotation_matrices
from tests.passes.scenes import random_gaussians


def turn(axis, angle):
    """The quaternion of a turn."""
    axis = np.array(axis, float) / np.linalg.norm(axis)
    return np.concatenate([[np.cos(angle / 2)], np.sin(angle / 2) * axis])


def moved(gaussians, quat, shift, *, size=1.0, around=(0, 0, 0)):
    """Gaussians moved as one rigid body, in the dtype of theirs: an independent definition of a motion."""
    R, before = rotation_matrices(np.array([quat]))[0], gaussians.astype(np.float64)
    means = (before.means - around) @ R.T * size + around + shift
    quats = quat_products(np.tile(quat, (len(before), 1)), before.quats)
    after = replace(before, means=means, quats=quats, scales=before.scales * size)
    return after.astype(gaussians.means.dtype)


def joined(*parts):
    """Several sets of Gaussians as one."""
    return Gaussians.joined(parts)


def clip(sample, duration=1.0, **columns):
    """A scene whose rows correspond."""
    return MovingScene(duration, True, sample, **columns)


def blob(n, seed=0, at=(0, 0, 0), *, dtype=np.float64, spread=1.0, size=0.1):
    """Gaussians of one thing, well visible."""
    found = random_gaussians(n, seed, spread=spread, size=size)
    found = replace(found, means=found.means + at, opacities=0.5 + 0.5 * found.opacities, sh=0.2 * found.sh)
    return found.astype(dtype)
