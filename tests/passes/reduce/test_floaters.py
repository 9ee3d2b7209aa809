"""What hangs in the air is found; what is thin, small or far but real is not."""

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
def test_planted_floaters_are_found_and_nothing_else_is(share, unit, tmp_path):
    """Those that lie inside or close to something cannot be detected; measured here: 0.75 and 0.85 of all."""
    planted = plant.floaters(plant.columns_of(scaled(fruit(), unit), tmp_path), share)
    found = {f.name: f for f in bg.examine(plant.write(planted, tmp_path / "a.ply"))}["floaters"]
    assert found.severity == "odd"
    assert found.rows is not None
    assert found.rows[planted.rows].mean() > 0.7
    assert not found.rows[~planted.rows].any()


def test_a_few_specks_too_small_to_see_are_a_note_and_stay(tmp_path):
    scene = joined(ball(), blobs((0, 2.5, 0), 0.001))
    bg.save(scene, tmp_path / "a.ply")
    examination = examine_file(tmp_path / "a.ply")
    (found,) = (finding for finding in examination.findings if finding.name == "floaters")
    assert (found.severity, found.count) == ("note", 1)
    assert "keeps them" in found.cure
    assert len(cure(examination)) == len(scene)
