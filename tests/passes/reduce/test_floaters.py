"""What hangs in the air is found; what is thin, small or far but real is not."""

from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor import cure, examine_file
from brushgs.passes.reduce.clean import find_floaters
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit, scaled
from tests.passes.scenes import gaussians_at


def joined(*scenes: bg.Gaussians) -> bg.Gaussians:
    return bg.Gaussians.joined(scenes)


def blobs(places: object, size: object = 0.05, opacity: float = 0.8) -> bg.Gaussians:
    return gaussians_at(np.atleast_2d(places), size, opacity=opacity, dtype=np.float32)


def is_apart(scene: bg.Gaussians) -> np.ndarray:
    return find_floaters(scene).sure.rows


@pytest.mark.parametrize(("share", "unit"), [(0.01, 1e3), (0.05, 1e-3)])
def test_planted_floaters_are_found_and_nothing_else_is(share: float, unit: float, tmp_path: Path) -> None:
    """Those that lie inside or close to something cannot be detected; measured here: 0.75 and 0.85 of all."""
    planted = plant.floaters(plant.columns_of(scaled(fruit(), unit), tmp_path), share)
    found = {f.name: f for f in bg.examine(plant.write(planted, tmp_path / "a.ply"))}["floaters"]
    assert found.severity == "odd"
    assert found.rows is not None
    assert found.rows[planted.rows].mean() > 0.7
    assert not found.rows[~planted.rows].any()


def test_a_thin_wire_that_stands_on_a_body_is_none() -> None:
    """40 slender Gaussians end to end, one thick, from the ball's pole outwards."""
    heights = 1 + 0.05 * np.arange(40)
    wire = blobs(np.stack([0 * heights, heights, 0 * heights], 1), (0.004, 0.03, 0.004))
    assert not is_apart(joined(ball(), wire)).any()


def test_a_second_body_of_coarse_gaussians_is_none() -> None:
    """Large ones lie far from their neighbors and touch all the same: a wall."""
    x, y = np.meshgrid(np.arange(-8, 8), np.arange(-8, 8))
    wall = blobs(np.stack([x.ravel(), y.ravel(), np.full(256, 9)], 1), (0.6, 0.6, 0.01))
    assert not is_apart(joined(ball(), wall)).any()


def test_a_few_specks_too_small_to_see_are_a_note_and_stay(tmp_path: Path) -> None:
    scene = joined(ball(), blobs((0, 2.5, 0), 0.001))
    bg.save(scene, tmp_path / "a.ply")
    examination = examine_file(tmp_path / "a.ply")
    found = next(finding for finding in examination.findings if finding.name == "floaters")
    assert (found.severity, found.count) == ("note", 1)
    assert "keeps them" in found.cure
    assert len(cure(examination)) == len(scene)
