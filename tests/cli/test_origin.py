"""What a command writes where, and what its pictures say of it."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.texture import StrokeTexture
from brushgs.cli import main
from brushgs.cli.origin import command_of
from brushgs.cli.parser import parse
from brushgs.errors import SceneWarning
from brushgs.formats.pictures.images import write_frame
from brushgs.pipeline.outputs import free_name
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.scenes import save_upright

FEW = ["--size", "64x48", "--strokes", "30", "--stroke", "flat", "--see", "off", "--threads", "1"]


def pear(seed: int = 0) -> bg.Gaussians:
    """Sixty Gaussians in a ball, which are all subject."""
    rng = np.random.default_rng(seed)
    means = rng.normal(size=(60, 3))
    means *= rng.random((60, 1)) ** (1 / 3) / np.linalg.norm(means, axis=1, keepdims=True)
    quats = np.tile(np.array([[1.0, 0, 0, 0]], np.float32), (60, 1))
    scales = np.full((60, 3), 0.15, np.float32) * np.array([2, 1, 0.3], np.float32)
    sh = rng.normal(size=(60, 1, 3)).astype(np.float32)
    return bg.Gaussians(means.astype(np.float32), quats, scales, np.full(60, 0.9, np.float32), sh)


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "mine").mkdir()
    save_upright(pear(), tmp_path / "mine" / "pear.ply")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    return str(tmp_path / "mine" / "pear.ply")


def run(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    capsys.readouterr()
    code = main(words)
    out, err = capsys.readouterr()
    return code, out.strip(), err


def names() -> list[str]:
    return sorted(str(path) for path in Path().rglob("*") if path.is_file())


@for_each(
    ("words", "command"),
    [
        (["render", "/home/me/a b.ply"], "brushgs render 'a b.ply'"),
        (["render", "me/x/", "--palette", "../me/b.jpg"], "brushgs render x --palette b.jpg"),
        (
            ["render", "a.ply", "--where", "mask:me/a.png", "-o", "me/b.png"],
            "brushgs render a.ply --where mask:a.png",
        ),
        (
            ["render", "a.ply", "--size", "8x8", "--look=ink", "--size", "9x9"],
            "brushgs render a.ply --look ink --size 9x9",
        ),
        (["render", "a.ply", "--preset", "default", "--threads", "2", "--json"], "brushgs render a.ply"),
        (["render", "a.ply", "--orbit", "9", "--jobs", "2", "--resume"], "brushgs render a.ply --orbit 9"),
        (["render", "a.ply", "--up", "-y"], "brushgs render a.ply --up=-y"),
        (["views", "a.ply", "b.ply", "--no-clobber"], "brushgs views a.ply b.ply"),
    ],
)
def test_a_command_is_recorded_without_folders_and_defaults(words: list[str], command: str) -> None:
    assert command_of(parse(words)) == command


def test_a_default_name_replaces_the_same_painting_only(scene, capsys):
    first = run(capsys, "render", scene, *FEW)
    assert first[:2] == (0, "pear-flat.png")
    before = Path("pear-flat.png").read_bytes()
    assert run(capsys, "render", scene, *FEW, "--quiet")[0] == 0
    assert (names(), Path("pear-flat.png").read_bytes()) == (["pear-flat.png"], before)
    code, out, err = run(capsys, "render", scene, *FEW, "--zoom", "1.2")
    assert (code, out) == (0, "pear-flat-2.png")
    assert "note: pear-flat.png exists and is kept; this is written to pear-flat-2.png" in err
    assert run(capsys, "render", scene, *FEW, "--no-clobber")[1] == "pear-flat-3.png"
    code, _, err = run(capsys, "render", scene, *FEW, "--no-clobber", "-o", "pear-flat.png")
    assert code == 2
    assert err == "brushgs: pear-flat.png: exists, and --no-clobber replaces no file; choose another name\n"
    assert Path("pear-flat.png").read_bytes() == before
    assert run(capsys, "render", scene, *FEW, "--no-metadata", "-o", "pear-flat.png")[0] == 0
    assert b"brushgs render" not in Path("pear-flat.png").read_bytes()
    assert run(capsys, "render", scene, *FEW)[1] == "pear-flat-3.png"  # which is this painting


@pytest.mark.parametrize(
    "words",
    [
        ["strokes", "--sheet", "kept.png"],
        ["doctor", "pear.ply", "--fix", "kept.png"],
        ["refine", "pear.ply", "--report", "kept.png"],
        ["demo", "-o", "kept.png"],
    ],
    ids=lambda words: words[0],
)
def test_no_clobber_is_of_each_command_that_writes(words, scene, capsys):
    Path("kept.png").write_bytes(b"kept")
    code, _, err = run(capsys, *words, "--no-clobber")
    assert (code, Path("kept.png").read_bytes()) == (2, b"kept")
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


@pytest.mark.parametrize("command", [["prune", "--keep", "50%"], ["cluster", "--strokes", "20"]])
def test_a_file_without_a_record_is_never_replaced_by_a_default_name(scene, capsys, command):
    outputs = [run(capsys, command[0], scene, *command[1:])[1] for _ in range(2)]
    first = Path(outputs[0])
    assert outputs == [str(first), f"{first.stem}-2.ply"]


@pytest.mark.parametrize(
    "words",
    [
        ["render", *FEW, "--orbit", "3", "-o", "a/b/c.mp4"],
        ["export", *FEW[:4], "-o", "a/b/c.html"],
        ["prune", "--keep", "50%", "-o", "a/b/c.ply"],
    ],
)
def test_folders_are_made_but_not_for_what_is_refused(scene, capsys, words):
    code, _, err = run(capsys, words[0], "missing.ply", *words[1:])
    assert (code, list(Path().iterdir())) == (2, []), err
    code, _, err = run(capsys, words[0], scene, *words[1:])
    assert code == 0, err
    assert Path("a/b").is_dir()
    assert any(Path("a/b").iterdir())


def test_numbers_go_on_and_folders_count_when_they_hold_something(tmp_path):
    for name in ("a", "a-2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x").touch()
    (tmp_path / "a-3").mkdir()
    with pytest.warns(SceneWarning, match="exists and is kept"):
        assert free_name(tmp_path / "a") == tmp_path / "a-3"


@pytest.mark.parametrize(
    ("words", "note"),
    [
        (
            ["--focus", "subject"],
            "--focus subject changes nothing: all of the scene is in it; name a smaller",
        ),
        (["--where", "subject"], "--where subject changes nothing, since all 60 Gaussians lie in it; name a"),
        (
            ["--look", "ink", "--palette", "p.png"],
            "--palette gives no colours, since ink is of one, #121217; take",
        ),
        (
            ["--look", "ink", "--chroma", "2"],
            "--chroma 2 gives no colours, since ink is of one, #121217; take",
        ),
    ],
)
def test_a_flag_that_changes_nothing_says_what_would(scene, capsys, words, note):
    rgb = np.random.default_rng(0).random((8, 8, 3)).astype(np.float32)
    write_frame(Frame(rgb, np.ones((8, 8), np.float32)), "p.png", (1, 1, 1))
    code, _, err = run(capsys, "render", scene, *FEW, *words)
    assert code == 0, err
    assert err.count(f"brushgs: note: {note}") == 1, err


def test_a_stroke_without_a_margin_is_told(tmp_path):
    ramp = np.repeat(np.linspace(0, 1, 32, dtype=np.float32)[None, :, None], 24, axis=0).repeat(3, axis=2)
    write_frame(Frame(ramp, np.ones((24, 32), np.float32)), tmp_path / "photo.png", (1, 1, 1))
    with pytest.warns(SceneWarning, match="no empty margin, so strokes end in straight cuts; leave a margin"):
        StrokeTexture.open(tmp_path / "photo.png")
    dab = np.ones((24, 32, 3), np.float32)
    dab[6:18, 6:26] = 0
    write_frame(Frame(dab, np.ones((24, 32), np.float32)), tmp_path / "dab.png", (1, 1, 1))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        StrokeTexture.open(tmp_path / "dab.png")
