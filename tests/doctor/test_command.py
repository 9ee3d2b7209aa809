"""`brushgs doctor`: what it prints where, and its exit codes."""

import json
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.doctor.findings import KINDS
from tests.doctor import plant
from tests.doctor.scenes import ball


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    bg.save(ball(), tmp_path / "sound.ply")
    return tmp_path / "sound.ply"


@pytest.fixture
def ill(tmp_path: Path) -> Path:
    planted = plant.xyzw(plant.linear_scales(plant.columns_of(ball(), tmp_path)).columns)
    return plant.write(planted, tmp_path / "ill.ply")


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    code = cli.main(["doctor", *map(str, words)])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_sound_scene_exits_0_and_says_so_on_stdout(sound: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, sound)
    assert (code, err) == (0, "")
    assert out.startswith(f"{sound}: 3,000 Gaussians; sound\n")


def test_fix_exits_0_with_the_path_on_stdout_and_the_findings_on_stderr(
    ill: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "cured.ply"
    code, out, err = run(capsys, ill, "--fix", target)
    assert (code, out) == (0, f"{target}\n")
    assert "linear-scales" in err
    assert run(capsys, target)[0] == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["cured.ply", "ill.ply", "sound.ply"]


def test_json_has_the_findings_for_machines(ill: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, ill, "--json")
    value = json.loads(out)
    assert (code, err) == (3, "")
    assert (value["schema"], value["faults"], value["odd"], value["output"]) == (1, 2, 0, None)
    assert [f["name"] for f in value["findings"]][:2] == ["linear-scales", "xyzw-quaternions"]
    for finding in value["findings"]:
        assert set(finding) == {"name", "severity", "count", "share", "what", "by_default", "cure", "facts"}
        assert finding["name"] in KINDS


def test_quiet_says_nothing_and_keeps_the_exit_code(ill: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, ill, "--quiet") == (3, "", "")


@pytest.mark.parametrize(
    ("faces", "sentence"),
    [
        (0, "is a plain point cloud without scales and rotations"),
        (2, "is a mesh (2 faces), not a 3D Gaussian"),
    ],
)
def test_what_is_no_scene_exits_2_by_name(
    faces: int, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = "".join(f"property float {name}\n" for name in "xyz")
    face = f"element face {faces}\nproperty list uchar int vertex_indices\n"
    rows = "0 0 0\n1 0 0\n0 1 0\n" + "3 0 1 2\n" * faces
    text = f"ply\nformat ascii 1.0\nelement vertex 3\n{names}{face}end_header\n{rows}"
    (tmp_path / "a.ply").write_text(text)
    code, out, err = run(capsys, tmp_path / "a.ply")
    assert (code, out) == (2, "")
    assert sentence in err


def test_a_scene_without_a_row_that_can_be_drawn_exits_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns = plant.columns_of(ball(), tmp_path)
    columns["x"][:] = np.nan
    code, _, err = run(capsys, plant.write(plant.nothing(columns), tmp_path / "a.ply"))
    assert code == 2
    assert "no row of 3000 can be used" in err


def test_the_input_is_never_overwritten(ill: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = ill.read_bytes()
    code, _, err = run(capsys, ill, "--fix", ill)
    assert code == 2
    assert "is the input, which is never overwritten" in err
    assert ill.read_bytes() == before


def test_a_cured_scene_is_in_a_format_that_is_written(
    ill: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, _, err = run(capsys, ill, "--fix", tmp_path / "cured.ksplat")
    assert code == 2
    assert "output must end in .ply" in err


def test_loading_points_to_the_doctor_where_a_fault_is_certain(tmp_path: Path) -> None:
    columns = plant.columns_of(ball(), tmp_path)
    for way, what in ((plant.linear_opacities, "opacities"), (plant.byte_colors, "colours")):
        path = plant.write(way(columns), tmp_path / "a.ply")
        with pytest.warns(bg.SceneWarning, match=f"{what} seem to be .* 'brushgs doctor .*--fix"):
            bg.load(path)
