"""Each fault planted is found and named; sound scenes have nothing above a note."""

from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit, scaled

MADE = {"fruit": fruit, "ball": ball}
UNITS = [1e-4, 1.0, 1e4]


def serious(findings: list[bg.Finding]) -> dict[str, str]:
    return {finding.name: finding.severity for finding in findings if finding.severity != "note"}


def examine(planted: plant.Planted, tmp_path: Path) -> list[bg.Finding]:
    return bg.examine(plant.write(planted, tmp_path / "planted.ply"))


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("made", MADE)
def test_a_sound_scene_has_nothing_above_a_note_in_any_unit(made: str, unit: float, tmp_path: Path) -> None:
    columns = plant.columns_of(scaled(MADE[made](), unit), tmp_path)
    assert serious(examine(plant.nothing(columns), tmp_path)) == {}


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("name", plant.WHOLE)
def test_a_fault_of_the_whole_file_is_found_and_nothing_else(name: str, made: str, tmp_path: Path) -> None:
    columns = plant.columns_of(MADE[made](), tmp_path)
    for way in plant.WHOLE[name]:
        findings = examine(way(columns), tmp_path)
        assert name in {finding.name for finding in findings}
        assert set(serious(findings)) <= {name}
        assert (serious(findings).get(name) == "fault") == (name in plant.FAULTS)


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("name", [name for name in plant.SOME if name != "floaters"])
def test_rows_at_fault_are_counted(name: str, made: str, tmp_path: Path) -> None:
    planted = plant.SOME[name](plant.columns_of(MADE[made](), tmp_path), 0.001)
    findings = examine(planted, tmp_path)
    severity = "fault" if name in plant.FAULTS else "odd"
    assert serious(findings) == {name: severity}
    found = next(finding for finding in findings if finding.name == name)
    assert found.count == planted.rows.sum()
    assert found.share == pytest.approx(planted.rows.mean())
    if found.rows is not None:  # the very rows: what the cure drops
        np.testing.assert_array_equal(found.rows, planted.rows)


@pytest.mark.parametrize("made", MADE)
@pytest.mark.parametrize("unit", UNITS)
def test_linear_scales_are_distinguished_from_logarithms_in_any_unit(
    made: str, unit: float, tmp_path: Path
) -> None:
    columns = plant.columns_of(scaled(MADE[made](), unit), tmp_path)
    assert set(serious(examine(plant.linear_scales(columns), tmp_path))) == {"linear-scales"}


def test_several_faults_at_once_are_all_named(tmp_path: Path) -> None:
    columns = plant.columns_of(fruit(), tmp_path)
    for way in (plant.linear_scales, plant.linear_opacities, plant.xyzw, plant.byte_colors):
        columns = way(columns).columns
    columns = plant.broken(plant.unrotated(columns).columns).columns
    findings = examine(plant.nothing(columns), tmp_path)
    assert set(serious(findings)) == {
        "linear-scales", "linear-opacities", "xyzw-quaternions", "byte-colors",
        "non-finite-rows", "zero-quaternions",
    }  # fmt: skip
    assert [finding.severity for finding in findings] == sorted(
        (finding.severity for finding in findings), key=["fault", "odd", "note"].index
    )


def test_sky_far_away_is_no_outlier(tmp_path: Path) -> None:
    """A shell of wide Gaussians 200 radii off fills the view from inside: that is what skies are."""
    far = ball(1, 400)
    size = np.full_like(far.scales, 30.0)
    sky = bg.Gaussians(far.means * np.float32(200), far.quats, size, far.opacities, far.sh)
    bg.save(bg.Gaussians.joined([ball(), sky]), tmp_path / "a.ply")
    assert "far-outliers" not in {finding.name for finding in bg.examine(tmp_path / "a.ply")}


@pytest.mark.parametrize("up", ["-y", "+z"])
def test_the_up_axis_is_stated_by_the_header_or_not_sure(up: str, tmp_path: Path) -> None:
    bg.save(ball(), tmp_path / "a.ply")
    note = next(f for f in bg.examine(tmp_path / "a.ply") if f.name == "up-axis")
    assert (note.facts["up"], note.facts["confidence"]) == ("-y", "not sure")
    assert note.facts["probability"] == note.facts["ups"]["-y"]
    assert f"-y {note.facts['probability']:.2f}" in note.what
    text = (
        (tmp_path / "a.ply").read_bytes().replace(b"1.0\n", f"1.0\ncomment Vertical Axis: {up}\n".encode(), 1)
    )
    (tmp_path / "b.ply").write_bytes(text)
    note = next(f for f in bg.examine(tmp_path / "b.ply") if f.name == "up-axis")
    assert note.facts == {"up": up, "confidence": "stated"}


def test_a_scene_at_one_place_is_examined(tmp_path: Path) -> None:
    """All positions equal: no radius, no neighbours; a k-d tree of them would take the square of N."""
    scene = ball(0, 30_000)
    bg.save(
        bg.Gaussians(np.ones_like(scene.means), scene.quats, scene.scales, scene.opacities, scene.sh),
        tmp_path / "a.ply",
    )
    assert serious(bg.examine(tmp_path / "a.ply")) == {}
