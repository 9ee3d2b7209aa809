"""Where the tests find real scenes; they are no part of the repository, so each test may be skipped."""

from pathlib import Path

import pytest

import brushgs as bg

SCENES_FOLDER = Path(__file__).resolve().parents[2] / "shared" / "scenes"


def real_scene(name: str) -> Path:
    """The path of a real scene, or a skip that says which one is missing."""
    path = SCENES_FOLDER / name
    if not path.exists():
        pytest.skip(f"real scene {name} is not here: {path}")
    return path


def save_upright(gaussians: bg.Gaussians, path: str | Path) -> None:
    """Write a scene whose header says that up is -y, so that nothing about it is estimated or in doubt."""
    bg.save(gaussians, path)
    content = Path(path).read_bytes()
    Path(path).write_bytes(content.replace(b"element vertex", b"comment up axis: -y\nelement vertex", 1))
