"""Each fault planted is found and named; sound scenes have nothing above a note."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor import examine_file
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit, scaled
from tests.first_view.scenes import about, moved, statue

MADE = {"fruit": fruit, "ball": ball}
UNITS = [1e-4, 1e-2, 1.0, 30.0, 1e4]


def serious(findings: list[bg.Finding]) -> dict[str, str]:
    return {finding.name: finding.severity for finding in findings if finding.severity != "note"}


def examine(planted: plant.Planted, tmp_path: Path) -> list[bg.Finding]:
    return bg.examine(plant.write(planted, tmp_path / "planted.ply"))


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("made", MADE)
def test_a_sound_scene_has_nothing_above_a_note_in_any_unit(made: str, unit: float, tmp_path: Path) -> None:
    columns = plant.columns_of(scaled(MADE[made](), unit), tmp_path)
    assert serious(examine(plant.nothing(columns), tmp_path)) == {}


@pytest.mark.parametrize("seed", range(8))
def test_random_scenes_have_nothing_above_a_note(seed: int, tmp_path: Path) -> None:
    bg.save(ball(seed, 400 * (seed + 1)), tmp_path / "a.ply")
    assert serious(bg.examine(tmp_path / "a.ply")) == {}


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
@pytest.mark.parametrize("share", [0.01, 0.001])
@pytest.mark.parametrize("name", [name for name in plant.SOME if name != "floaters"])
def test_rows_at_fault_are_counted(name: str, share: float, made: str, tmp_path: Path) -> None:
    planted = plant.SOME[name](plant.columns_of(MADE[made](), tmp_path), share)
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


def test_equal_opacities_decide_nothing(tmp_path: Path) -> None:
    columns = plant.columns_of(ball(), tmp_path)
    columns["opacity"][:] = 0.847
    assert serious(examine(plant.nothing(columns), tmp_path)) == {}


def test_a_few_damaged_rows_do_not_hide_another_reading(tmp_path: Path) -> None:
    columns = plant.linear_opacities(plant.columns_of(ball(), tmp_path)).columns
    columns["opacity"][[3, 77]] = 1.5, -0.2
    findings = {finding.name: finding for finding in examine(plant.nothing(columns), tmp_path)}
    assert findings["linear-opacities"].severity == "fault"
    assert findings["non-finite-rows"].count == 2  # no opacity in any reading


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


@pytest.mark.parametrize("turns", [0, 1])
def test_what_stands_upright_tells_which_way_is_up(turns: int, tmp_path: Path) -> None:
    """The estimate is that of the first view. Three quarter turns about x take -y to +z."""
    bg.save(moved(statue(), rotation=about((1, 0, 0), 270 * turns)), tmp_path / "a.ply")
    note = next(f for f in bg.examine(tmp_path / "a.ply") if f.name == "up-axis")
    ups = note.facts.pop("ups")
    probability = note.facts.pop("probability")
    assert note.facts == {"up": ["-y", "+z"][turns], "confidence": "likely"}
    assert probability == max(ups.values())
    assert f"({note.facts['up']} {probability:.2f}, " in note.what


@pytest.mark.parametrize("count", [1, 2, 3, 17, 50])
def test_tiny_scenes_are_examined(count: int, tmp_path: Path) -> None:
    bg.save(ball().take(slice(count)), tmp_path / "a.ply")
    assert serious(bg.examine(tmp_path / "a.ply")) == {}


def test_a_scene_at_one_place_is_examined(tmp_path: Path) -> None:
    """All positions equal: no radius, no neighbours; a k-d tree of them would take the square of N."""
    scene = ball(0, 30_000)
    bg.save(
        bg.Gaussians(np.ones_like(scene.means), scene.quats, scene.scales, scene.opacities, scene.sh),
        tmp_path / "a.ply",
    )
    assert serious(bg.examine(tmp_path / "a.ply")) == {}


def test_what_the_examination_read_is_the_scene(tmp_path: Path) -> None:
    bg.save(fruit(), tmp_path / "a.ply")
    examination, loaded = examine_file(tmp_path / "a.ply"), bg.load(tmp_path / "a.ply")
    assert examination.encoding.is_standard
    for name in ("means", "quats", "scales", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(examination.gaussians, name), getattr(loaded, name))


@pytest.mark.parametrize("unit", UNITS)
def test_the_unit_is_mentioned_only_where_it_is_hardly_the_metre(unit: float, tmp_path: Path) -> None:
    bg.save(scaled(ball(), unit), tmp_path / "a.ply")
    found = {finding.name: finding for finding in bg.examine(tmp_path / "a.ply")}
    size = 3.4 * unit  # the diagonal of a ball's box, some of it trimmed
    assert ("unit" in found) == (not 0.05 <= size <= 200)
    if "unit" in found:
        assert found["unit"].facts["size"] == pytest.approx(size, rel=0.2)
        assert "hardly metres" in found["unit"].what


def test_over_bright_colours_are_counted_with_their_share_of_the_paint(tmp_path: Path) -> None:
    planted = plant.bright(plant.columns_of(fruit(), tmp_path))
    found = next(f for f in examine(planted, tmp_path) if f.name == "over-bright")
    brightest = 4 * (0.5 + 0.28209479 * fruit().sh[:, 0].max(axis=1))
    assert found.count == np.count_nonzero(brightest > 2)
    assert found.facts["brightest"] == pytest.approx(brightest.max(), rel=1e-5)
    assert 0.01 < found.facts["area_share"] < 1


def test_a_few_bright_rows_are_no_finding_and_many_small_ones_a_note(tmp_path: Path) -> None:
    scene = ball()
    for rows, shrink, severity in ((slice(20), 1.0, None), (slice(0, None, 10), 0.1, "note")):
        sh, scales = scene.sh.copy(), scene.scales.copy()
        sh[rows] += np.float32(2 / 0.28209479)
        scales[rows] *= np.float32(shrink)
        bg.save(replace(scene, sh=sh, scales=scales), tmp_path / "a.ply")
        found = {f.name: f.severity for f in bg.examine(tmp_path / "a.ply")}
        assert found.get("over-bright") == severity


@pytest.mark.parametrize(("offset", "severity"), [(1e3, None), (1e5, "odd"), (1e6, "fault"), (1e7, "fault")])
def test_positions_too_far_from_the_origin_for_float32_are_told(
    offset: float, severity: str | None, tmp_path: Path
) -> None:
    """Lengths of 0.01 to 0.1: at 1e5 steps are 0.008, at 1e6 0.06."""
    away = replace(ball(), means=ball().means + np.float32(offset), scales=ball().scales * np.float32(0.5))
    bg.save(away, tmp_path / "away.ply")
    found = {one.name: one for one in bg.examine(tmp_path / "away.ply")}
    assert getattr(found.get("coarse-positions"), "severity", None) == severity
    if severity:
        assert "digits left" in found["coarse-positions"].what
