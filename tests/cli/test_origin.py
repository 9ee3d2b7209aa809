"""What a command writes where, and what its pictures say of it."""

import json
import shlex
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.cli.origin import command_of
from brushgs.cli.parser import parse
from brushgs.errors import SceneWarning
from brushgs.pipeline.outputs import free_name
from tests.kit.commands import names, refused, run, save_opaque
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at
from tests.scenes import save_upright

FEW = ["--size", "64x48", "--strokes", "30", "--stroke", "flat", "--see", "off", "--threads", "1"]


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Sixty Gaussians in a ball, which are all subject; the current folder is an empty one beside theirs."""
    rng = np.random.default_rng(0)
    means = rng.normal(size=(60, 3))
    means *= rng.random((60, 1)) ** (1 / 3) / np.linalg.norm(means, axis=1, keepdims=True)
    ball = gaussians_at(means, (0.3, 0.15, 0.045), rng.random((60, 3)), dtype=np.float32)
    for name in ("mine", "out"):
        (tmp_path / name).mkdir()
    save_upright(ball, tmp_path / "mine" / "pear.ply")
    monkeypatch.chdir(tmp_path / "out")
    return str(tmp_path / "mine" / "pear.ply")


@for_each(
    ("words", "command"),
    [
        ("render '/home/me/a b.ply'", "render 'a b.ply'"),
        ("render me/x/ --palette ../me/b.jpg", "render x --palette b.jpg"),
        ("render a.ply --where mask:me/a.png -o me/b.png", "render a.ply --where mask:a.png"),
        ("render a.ply --size 8x8 --look=ink --size 9x9", "render a.ply --look ink --size 9x9"),
        ("render a.ply --preset default --threads 2 --json", "render a.ply"),
        ("render a.ply --orbit 9 --jobs 2 --resume", "render a.ply --orbit 9"),
        ("render a.ply --up -y", "render a.ply --up=-y"),
        ("views a.ply b.ply --no-clobber", "views a.ply b.ply"),
    ],
)
def test_a_command_is_recorded_without_folders_and_defaults(words: str, command: str) -> None:
    assert command_of(parse(shlex.split(words))) == f"brushgs {command}"


def test_a_default_name_replaces_the_same_painting_only(scene, capsys):
    render = partial(run, capsys, "render", scene, *FEW)
    assert render()[:2] == (0, "pear-flat.png\n")
    before = Path("pear-flat.png").read_bytes()
    assert render("--quiet")[0] == 0
    assert (names(), Path("pear-flat.png").read_bytes()) == (["pear-flat.png"], before)
    code, out, err = render("--zoom", "1.2")
    assert (code, out) == (0, "pear-flat-2.png\n")
    assert "note: pear-flat.png exists and is kept; this is written to pear-flat-2.png" in err
    assert render("--no-clobber")[1] == "pear-flat-3.png\n"
    assert Path("pear-flat.png").read_bytes() == before
    assert render("--no-metadata", "-o", "pear-flat.png")[0] == 0
    assert b"brushgs render" not in Path("pear-flat.png").read_bytes()
    assert render()[1] == "pear-flat-3.png\n"  # which is this painting
    for command in (["prune", "--keep", "50%"], ["cluster", "--strokes", "20"]):  # they keep no record
        first, second = (Path(run(capsys, command[0], scene, *command[1:])[1].strip()) for _ in range(2))
        assert second.name == f"{first.stem}-2.ply"


@for_each(
    "words",
    [
        ["render", "pear.ply", "-o", "kept.png"],
        ["strokes", "--sheet", "kept.png"],
        ["doctor", "pear.ply", "--fix", "kept.png"],
        ["refine", "pear.ply", "--report", "kept.png"],
        ["demo", "-o", "kept.png"],
    ],
)
def test_no_clobber_is_of_each_command_that_writes(words, scene, capsys):
    Path("kept.png").write_bytes(b"kept")
    err = refused(capsys, *words, "--no-clobber")
    assert Path("kept.png").read_bytes() == b"kept"
    assert err.endswith("kept.png: exists, and --no-clobber replaces no file; choose another name\n")


def test_info_prints_how_a_picture_was_painted(scene, capsys):
    run(capsys, "render", scene, *FEW, "-o", "a.png")
    code, out, _ = run(capsys, "info", "a.png")
    assert code == 0
    assert "painted by       brushgs render pear.ply --stroke flat --strokes 30 --see off --size 64x48" in out
    assert str(Path(scene).parent) not in out
    assert json.loads(run(capsys, "info", "a.png", "--json")[1])["painted"]["camera"]["width"] == 64
    run(capsys, "render", scene, *FEW, "--no-metadata", "-o", "b.png")
    assert "not recorded" in run(capsys, "info", "b.png")[1]
    assert "--words needs a scene, and a.png is a picture" in run(capsys, "info", "a.png", "--words")[2]


@for_each(
    "words",
    [
        ["render", *FEW, "--orbit", "3", "-o", "film/b/c.mp4"],
        ["export", *FEW[:4], "-o", "page/b/c.html"],
        ["prune", "--keep", "50%", "-o", "scene/b/c.ply"],
    ],
)
def test_folders_are_made_but_not_for_what_is_refused(scene, capsys, words):
    folder = Path(words[-1]).parent
    refused(capsys, words[0], "missing.ply", *words[1:])
    assert not folder.parent.exists()
    code, _, err = run(capsys, words[0], scene, *words[1:])
    assert code == 0, err
    assert names(folder)


def test_numbers_go_on_and_folders_count_when_they_hold_something(tmp_path):
    for name in ("a", "a-2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x").touch()
    (tmp_path / "a-3").mkdir()
    with pytest.warns(SceneWarning, match="exists and is kept"):
        assert free_name(tmp_path / "a") == tmp_path / "a-3"


@for_each(
    ("words", "note"),
    [
        (["--focus", "subject"], "--focus subject changes nothing: all of the scene is in it; name a"),
        (["--where", "subject"], "--where subject changes nothing, since all 60 Gaussians lie in it; name a"),
        (["--palette", "p.png"], "--palette gives no colors, since ink is of one, #121217; take"),
        (["--chroma", "2"], "--chroma 2 gives no colors, since ink is of one, #121217; take"),
    ],
)
def test_a_flag_that_changes_nothing_says_what_would(scene, capsys, words, note):
    save_opaque("p.png", np.random.default_rng(0).random((8, 8, 3)))
    look = ["--look", "ink"] if "ink" in note else []
    code, _, err = run(capsys, "render", scene, *FEW, *look, *words)
    assert code == 0, err
    assert err.count(f"brushgs: note: {note}") == 1, err


def test_a_stroke_without_a_margin_is_told(tmp_path):
    ramp = np.linspace(0, 1, 32)[None, :, None].repeat(24, axis=0).repeat(3, axis=2)
    save_opaque(tmp_path / "photo.png", ramp)
    with pytest.warns(SceneWarning, match="no empty margin, so strokes end in straight cuts; leave a margin"):
        StrokeTexture.open(tmp_path / "photo.png")
    dab = np.ones((24, 32, 3))
    dab[6:18, 6:26] = 0
    save_opaque(tmp_path / "dab.png", dab)
    StrokeTexture.open(tmp_path / "dab.png")  # warnings are errors
