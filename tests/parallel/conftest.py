"""Fixtures of both pools: pictures, and a path on which other processes find what paints them."""

import textwrap

import pytest

import brushgs as bg
from tests.kit.programs import ROOT, start
from tests.parallel import work
from tests.scenes import still_life_of

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
    return start(path, **options)
