"""Where the tests find real scenes; they are no part of the repository, so each test may be skipped."""

from pathlib import Path

import pytest

SCENES_FOLDER = Path(__file__).resolve().parents[2] / "shared" / "scenes"


def real_scene(name: str) -> Path:
    """The path of a real scene, or a skip that says which one is missing."""
    path = SCENES_FOLDER / name
    if not path.exists():
        pytest.skip(f"real scene {name} is not here: {path}")
    return path
