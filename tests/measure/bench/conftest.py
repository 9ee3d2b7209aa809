"""Few points and one pass: what the bench does is the same with any number of them."""

import pytest

from brushgs.measure.bench import families, look_families, look_subject, subject, timing

SIZES, STOPS, HELD_OUT = (0.25, 1.0), (0.1, 0.001, 0.0), ((22.5, 17.0), (112.5, 17.0))


@pytest.fixture
def few_points(monkeypatch):
    monkeypatch.setattr(timing, "QUICK_PASSES", 1)
    for module in (families, look_families):
        monkeypatch.setattr(module, "SIZES", SIZES)
    for module in (look_subject, subject):
        monkeypatch.setattr(module, "HELD_OUT", HELD_OUT)
    monkeypatch.setattr(families, "STOPS", STOPS)
