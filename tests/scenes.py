"""The scenes of the tests. Real ones are no part of the repository, so each test of one may be skipped."""

from functools import cache
from pathlib import Path

import pytest

import brushgs as bg
from brushgs.still_life import NUM_GAUSSIANS, still_life
from examples.benchmarks.scenes import FOLDER as SCENES_FOLDER


def real_scene(name: str) -> Path:
    """The path of a real scene, or a skip that says which one is missing."""
    path = SCENES_FOLDER / name
    if not path.exists():
        pytest.skip(f"real scene {name} is not here: {path}")
    return path


@cache
def still_life_of(num_gaussians: int = NUM_GAUSSIANS, seed: int = 0) -> bg.Gaussians:
    """`still_life`, made once a process: its light takes a quarter of a second, whatever the number.

    Its arrays are read-only, since tests share them.
    """
    scene = still_life(num_gaussians, seed)
    for array in vars(scene).values():
        if hasattr(array, "setflags"):
            array.setflags(write=False)
    return scene


def save_upright(gaussians: bg.Gaussians, path: str | Path) -> None:
    """Write a scene whose header says that up is -y, so that nothing about it is estimated or in doubt."""
    bg.save(gaussians, path)
    content = Path(path).read_bytes()
    Path(path).write_bytes(content.replace(b"element vertex", b"comment up axis: -y\nelement vertex", 1))
