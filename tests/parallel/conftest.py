"""Fixtures of both pools: pictures, and a path on which other processes find what paints them."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import brushgs as bg
from tests.parallel import work
from tests.scenes import still_life_of

ROOT = Path(__file__).resolve().parents[2]
NUM_FRAMES = 12


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    """Other processes import `tests.parallel.work` from this path."""
    monkeypatch.syspath_prepend(ROOT)


@pytest.fixture(scope="session")
def painter():
    return work.Painter(bg.cluster(still_life_of(3000), 400), bg.StrokeTexture.open("flat"))


@pytest.fixture(scope="session")
def frames(painter):
    """What every pool must paint, bit for bit."""
    return [painter(index) for index in range(NUM_FRAMES)]


def run_script(path, code, **options):
    """Start a script of Python that finds this package."""
    path.write_text(textwrap.dedent(code))
    pipes = dict.fromkeys(("stdout", "stderr"), subprocess.PIPE)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen([sys.executable, path], env=environment, text=True, **pipes, **options)
