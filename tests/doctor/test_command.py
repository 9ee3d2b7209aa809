"""`brushgs doctor`: what it prints where, and its exit codes."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.doctor.findings import KINDS
from tests.doctor import plant
from tests.doctor.scenes import ball
from tests.kit.commands import names, run


@pytest.fixture
def ill(tmp_path):
    planted = plant.xyzw(plant.linear_scales(plant.columns_of(ball(), tmp_path)).columns)
    return plant.write(planted, tmp_path / "ill.ply")


def test_fix_exits_0_with_the_path_on_stdout_and_what_is_sound_is_said_to_be(ill, tmp_path, capsys):
    target = tmp_path / "cured.ply"
    assert run(capsys, "doctor", ill, "--quiet") == (3, "", "")
    code, out, err = run(capsys, "doctor", ill, "--fix", target)
    assert (code, out) == (0, f"{target}\n")
    assert "linear-scales" in err
    code, out, err = run(capsys, "doctor", target)
    assert (code, err) == (0, "")
    assert out.startswith(f"{target}: 3,000 Gaussians; sound\n")
    assert names(tmp_path) == ["cured.ply", "ill.ply", "sound.ply"]


def test_json_has_the_findings_for_machines(ill, capsys):
    code, out, err = run(capsys, "doctor", ill, "--json")
    value = json.loads(out)
    assert (code, err) == (3, "")
    assert (value["schema"], value["faults"], value["odd"], value["output"]) == (1, 2, 0, None)
    assert [f["name"] for f in value["findings"]][:2] == ["linear-scales", "xyzw-quaternions"]
    for finding in value["findings"]:
        assert set(finding) == {"name", "severity", "count", "share", "what", "by_default", "cure", "facts"}
        assert finding["name"] in KINDS


def test_what_cannot_be_examined_or_written_exits_2_by_name(ill, tmp_path, capsys):
    columns = plant.columns_of(ball(), tmp_path)
    columns["x"][:] = np.nan
    nothing = plant.write(plant.nothing(columns), tmp_path / "nothing.ply")
    before = ill.read_bytes()
    for words, sentence in (
        ([nothing], "no row of 3000 can be used"),
        ([tmp_path / "none.ply"], "none.ply: there is no such file"),
        ([ill, "--fix", ill], "is the input, which is never overwritten"),
        ([ill, "--fix", tmp_path / "cured.ksplat"], "output must end in .ply"),
    ):
        code, out, err = run(capsys, "doctor", *words)
        assert (code, out) == (2, "")
        assert sentence in err
    assert ill.read_bytes() == before


def test_loading_points_to_the_doctor_where_a_fault_is_certain(tmp_path):
    columns = plant.columns_of(ball(), tmp_path)
    for way, what in ((plant.linear_opacities, "opacities"), (plant.byte_colors, "colors")):
        path = plant.write(way(columns), tmp_path / "a.ply")
        with pytest.warns(bg.SceneWarning, match=f"{what} seem to be .* 'brushgs doctor .*--fix"):
            bg.load(path)
