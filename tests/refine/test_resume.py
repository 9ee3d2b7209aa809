"""`brushgs refine` that is stopped or killed: what it fitted is not lost, and only its own run resumes it."""

import json
import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from tests.kit import for_each, names, refused, run, save_opaque, save_upright, still_life_of

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs import cli  # noqa: E402
from brushgs.formats.scenes import write  # noqa: E402
from brushgs.refine import fit as fit_module  # noqa: E402
from tests.refine.stops import stopping_after  # noqa: E402

SMALL = ["--strokes", "100", "--steps", "10", "--views", "4", "--size", "64x48", "--stroke", "flat"]
SMALL += ["--up", "-y", "--see", "off"]
CHECKPOINT, OUTPUT = "pears-refined.checkpoint", "pears-refined.ply"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Two scenes, and the refined strokes of the first."""
    folder = tmp_path_factory.mktemp("scene")
    save_upright(still_life_of(1000), folder / "pears.ply")
    save_upright(still_life_of(1000, 1), folder / "apples.ply")
    words = ["refine", str(folder / "pears.ply"), *SMALL, "-o", str(folder / OUTPUT), "--quiet"]
    assert cli.main(words) == 0
    return folder


@pytest.fixture
def scene(made, folder):
    """A scene file; the current folder is empty."""
    return str(made / "pears.ply")


def assert_same_strokes(made):
    rows = [path.read_bytes().split(b"end_header")[1] for path in (Path(OUTPUT), made / OUTPUT)]
    assert rows[0] == rows[1], "the headers name the scenes"


@pytest.fixture(scope="module")
def stop(made, tmp_path_factory):
    """What is said where Ctrl-C stops a run after its sixth step, and the checkpoint that it leaves."""
    folder = tmp_path_factory.mktemp("stopped")
    out, err = StringIO(), StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.chdir(folder)
        with stopping_after(patch, 6):
            code = cli.main(["refine", str(made / "pears.ply"), *SMALL])
    assert (code, out.getvalue()) == (130, "")
    assert [path.name for path in folder.iterdir()] == [CHECKPOINT]
    return err.getvalue(), (folder / CHECKPOINT).read_bytes()


@pytest.fixture
def stopped(scene, stop):
    """The current folder after that stop; what was said."""
    said, checkpoint = stop
    Path(CHECKPOINT).write_bytes(checkpoint)
    return said


def test_ctrl_c_names_the_checkpoint_and_the_run_is_resumed_to_the_same_file(stopped, scene, made, capsys):
    assert stopped == f"brushgs: stopped: --resume continues from step 6: {CHECKPOINT}\n"
    assert names() == [CHECKPOINT]
    code, out, err = run(capsys, "refine", scene, *SMALL, "--resume")
    assert (code, out) == (0, f"{OUTPUT}\n")
    assert "resumed from step 6" in " ".join(err.split())
    assert_same_strokes(made)
    assert names() == [OUTPUT]


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_what_is_fitted_is_kept_until_it_is_written(scene, made, monkeypatch, capsys, error):
    def fail(*_, **__):
        assert CHECKPOINT in names()  # so that it is there whatever ends the process
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(write, "write_scene", fail)
        code, _, err = run(capsys, "refine", scene, *SMALL)
    advice = f"--resume continues from step 10: {CHECKPOINT}\n"
    if error is KeyboardInterrupt:
        assert (code, err) == (130, f"brushgs: stopped: {advice}")
    else:
        assert (code, err) == (2, f"brushgs: note: {advice}brushgs: No space left on device\n")
    assert names() == [CHECKPOINT]
    monkeypatch.setattr(fit_module.Fit, "_step", fail)  # no step is done again
    assert run(capsys, "refine", scene, *SMALL, "--resume", "--quiet") == (0, "", "")
    assert_same_strokes(made)
    assert names() == [OUTPUT]


def test_resume_without_a_checkpoint_says_so_and_starts(scene, made, capsys):
    code, out, err = run(capsys, "refine", scene, *SMALL, "--resume")
    assert (code, out) == (0, f"{OUTPUT}\n")
    note = f"--resume found no checkpoint {CHECKPOINT}; the fit starts at its first step"
    assert err.startswith(f"brushgs: note: {note}\n")  # before anything else: it may take long
    assert err.count("note:") == 1
    assert_same_strokes(made)
    _, out, err = run(capsys, "refine", scene, *SMALL, "--resume", "--json", "-o", OUTPUT)
    assert err == ""
    assert json.loads(out)["notes"] == [note]


@for_each(
    ("words", "differing"),
    [
        (["--stroke", "swirl"], r"stroke flat, now swirl"),
        (["--stroke", "gaussian"], r"stroke flat, now gaussian; .*keep 0\.7, now 1\.0.*; .*"),
        (["--see", "views"], r"see off, now views"),
        (["--steps", "12"], r"steps 10, now 12"),
        (["--seed", "4"], r"seed 0, now 4"),
        (["--params", "color"], r"params all, now color"),
        (["--up", "+z"], r"up -y, now \+z"),
        (["--views", "5", "--keep", "0.5"], r"keep 0\.7, now 0\.5; views 4, now 5"),
        (["--style", "style.png"], r"palette None, now style\.png; style image None, now style\.png; .*"),
    ],
)
def test_a_checkpoint_is_refused_with_other_options(stopped, scene, capsys, words, differing):
    if "--style" in words:
        pytest.importorskip("kornia", reason="needs the extra [refine]")
        save_opaque("style.png", np.full((8, 8, 3), (0.1, 0.2, 0.8)))
    err = refused(capsys, "refine", scene, *SMALL, *words, "--resume")
    pattern = rf"brushgs: {CHECKPOINT}: is the checkpoint of another fit \((.*)\); give the scene and"
    assert re.fullmatch(differing, re.match(pattern, err)[1]), err
    assert CHECKPOINT in names()


def test_a_checkpoint_is_refused_with_another_scene_and_taken_with_the_same_of_another_name(
    stopped, scene, made, capsys
):
    words = [*SMALL, "--resume", "-o", OUTPUT]
    err = refused(capsys, "refine", made / "apples.ply", *words)
    assert f"{CHECKPOINT}: is the checkpoint of another fit (scene pears.ply, now apples.ply); " in err
    Path("pears.ply").write_bytes((made / "apples.ply").read_bytes())  # changed under its name
    assert "(another scene pears.ply); " in refused(capsys, "refine", "pears.ply", *words)
    Path("renamed.ply").write_bytes(Path(scene).read_bytes())
    assert run(capsys, "refine", "renamed.ply", *words, "--quiet") == (0, "", "")
    assert_same_strokes(made)


@for_each("content", [b"", b"nothing of the kind", {"state": {}}, {"fit": {}, "state": {"step": 3}}])
def test_a_file_that_is_no_checkpoint_is_refused(scene, capsys, content):
    if isinstance(content, bytes):
        Path(CHECKPOINT).write_bytes(content)
    else:
        torch.save(content, CHECKPOINT)
    err = refused(capsys, "refine", scene, *SMALL, "--resume")
    assert err.startswith(f"brushgs: {CHECKPOINT}: is ")
    assert err.endswith("omit --resume\n") or "is the checkpoint of another fit" in err
