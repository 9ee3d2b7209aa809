"""Each fault planted is found and named; sound scenes have nothing above a note."""

import numpy as np
import pytest

import brushgs as bg
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit, scaled
from tests.kit.for_each import for_each

MADE = {"fruit": fruit, "ball": ball}


def serious(findings):
    return {finding.name: finding.severity for finding in findings if finding.severity != "note"}


def examine(planted, tmp_path):
    return bg.examine(plant.write(planted, tmp_path / "planted.ply"))


@for_each("made", MADE)
@for_each("unit", [1e-4, 1.0, 1e4])
def test_scales_are_known_for_logarithms_or_not_in_any_unit(made, unit, tmp_path):
    columns = plant.columns_of(scaled(MADE[made](), unit), tmp_path)
    assert serious(examine(plant.nothing(columns), tmp_path)) == {}
    assert set(serious(examine(plant.linear_scales(columns), tmp_path))) == {"linear-scales"}


@pytest.mark.parametrize("made", MADE)
@for_each("name", plant.WHOLE)
def test_a_fault_of_the_whole_file_is_found_and_nothing_else(name, made, tmp_path):
    columns = plant.columns_of(MADE[made](), tmp_path)
    for way in plant.WHOLE[name]:
        findings = examine(way(columns), tmp_path)
        assert name in {finding.name for finding in findings}
        assert set(serious(findings)) <= {name}
        assert (serious(findings).get(name) == "fault") == (name in plant.FAULTS)


@pytest.mark.parametrize("made", MADE)
@for_each("name", [name for name in plant.SOME if name != "floaters"])
def test_rows_at_fault_are_counted(name, made, tmp_path):
    planted = plant.SOME[name](plant.columns_of(MADE[made](), tmp_path), 0.001)
    findings = examine(planted, tmp_path)
    assert serious(findings) == {name: "fault" if name in plant.FAULTS else "odd"}
    found = next(finding for finding in findings if finding.name == name)
    assert found.count == planted.rows.sum()
    assert found.share == pytest.approx(planted.rows.mean())
    if found.rows is not None:  # the very rows: what the cure drops
        np.testing.assert_array_equal(found.rows, planted.rows)


def test_several_faults_at_once_are_all_named(tmp_path):
    columns = plant.columns_of(fruit(), tmp_path)
    whole = ("linear-scales", "linear-opacities", "xyzw-quaternions", "byte-colors")
    for way in (*(plant.WHOLE[name][0] for name in whole), plant.unrotated, plant.broken):
        columns = way(columns).columns
    findings = examine(plant.nothing(columns), tmp_path)
    assert set(serious(findings)) == {*whole, "non-finite-rows", "zero-quaternions"}
    severities = [finding.severity for finding in findings]
    assert severities == sorted(severities, key=["fault", "odd", "note"].index)


def test_sky_far_away_is_no_outlier(tmp_path):
    """A shell of wide Gaussians 200 radii off fills the view from inside: that is what skies are."""
    far = ball(1, 400)
    size = np.full_like(far.scales, 30.0)
    sky = bg.Gaussians(far.means * np.float32(200), far.quats, size, far.opacities, far.sh)
    bg.save(bg.Gaussians.joined([ball(), sky]), tmp_path / "a.ply")
    assert "far-outliers" not in {finding.name for finding in bg.examine(tmp_path / "a.ply")}


def test_the_up_axis_is_stated_by_the_header_or_not_sure(tmp_path):
    def note_of(path):
        return next(f for f in bg.examine(path) if f.name == "up-axis")

    bg.save(ball(), tmp_path / "a.ply")
    note = note_of(tmp_path / "a.ply")
    assert (note.facts["up"], note.facts["confidence"]) == ("-y", "not sure")
    assert note.facts["probability"] == note.facts["ups"]["-y"]
    assert f"-y {note.facts['probability']:.2f}" in note.what
    for up in ("-y", "+z"):
        content = (tmp_path / "a.ply").read_bytes()
        stated = content.replace(b"1.0\n", f"1.0\ncomment Vertical Axis: {up}\n".encode(), 1)
        (tmp_path / "b.ply").write_bytes(stated)
        assert note_of(tmp_path / "b.ply").facts == {"up": up, "confidence": "stated"}


def test_a_scene_at_one_place_is_examined(tmp_path):
    """All positions equal: no radius, no neighbors; a k-d tree of them would take the square of N."""
    ball_ = ball(0, 30_000)
    means = np.ones_like(ball_.means)
    bg.save(bg.Gaussians(means, ball_.quats, ball_.scales, ball_.opacities, ball_.sh), tmp_path / "a.ply")
    assert serious(bg.examine(tmp_path / "a.ply")) == {}
