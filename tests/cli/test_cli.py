import json
import os
import re
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.brushes.builtin import stroke_notes
from brushgs.brushes.texture import builtin_names
from brushgs.formats.pictures.images import read_image
from brushgs.options.choices import LOOKS
from brushgs.outlets.stroke_chart import CELL, COLUMNS, PAPER
from brushgs.still_life.moving import still_life_moving
from brushgs.values.colors import rgb_of
from brushgs.values.sh import base_colors
from tests.kit.commands import names, refused, run, save_opaque, stages_of
from tests.kit.for_each import for_each
from tests.kit.programs import ran, start
from tests.scenes import still_life_of


@pytest.fixture(autouse=True)
def current(folder):
    """The current folder is empty."""


# Strokes that do not look at the scene: a tenth of the time of the default look.
SMALL = ["--look", "plain", "--see", "off", "--stroke", "ellipse", "--strokes", "100", "--size", "64x48"]


def test_render_prints_the_path_of_its_picture_and_a_table_of_what_it_did(scene, capsys):
    words = "render", scene, *SMALL, "--where", "box:-1000,-1000,-1000,1000,1000,1000"
    code, out, err = run(capsys, *words)
    assert (code, out) == (0, "pears-ellipse.png\n")
    assert read_image("pears-ellipse.png").shape == (48, 64, 3)
    note, *rest = err.splitlines()
    assert note.startswith("brushgs: note: --where box:-1000,-1000,-1000,1000,1000,1000 changes nothing")
    lines = [re.split("  +", line, maxsplit=1) for line in rest]
    rows = ["scene", "first view", "view", "strokes", "brush", "file", "skipped", "total"]
    assert [word for word, _ in lines] == rows
    told = dict(lines)
    assert "limiting to a part: all of the scene lies in it" in told["skipped"]
    assert "pruning" not in told["skipped"]
    code, out, err = run(capsys, *words, "--json", "-o", "x.tif")
    value = json.loads(out)
    assert (code, err, value["output"], value["stages"][-1]["name"]) == (0, "", "x.tif", "write")
    flags = next(one["counts"]["flags"] for one in value["stages"] if one["name"] == "camera")
    assert flags in told["view"]
    assert run(capsys, *words, "--quiet") == (0, "", "")
    err = " ".join(run(capsys, *words, "--verbose")[2].split())
    for word in ("stage what it did seconds", "skipped", "load", "prune", "cluster", "from the file"):
        assert word in err
    assert names() == ["pears-ellipse.png", "x.tif"]


@for_each(
    ("words", "sentence"),
    [
        (["--size", "12"], r"--size must be WIDTHxHEIGHT in pixels such as 1280x720, got '12'"),
        (["--size", "30000x30000"], r"most 268 million pixels, got 30000x30000; the .* is 16384x16384"),
        (["--stroke", "missing.png"], r"missing\.png: there is no such picture; check the path\n"),
        (["--stroke", "./flat.png"], r"/?flat\.png: there is no such file; for the built-in .* write flat\n"),
        (["--strokes", "many"], r"--strokes must be a count .* got 'many'"),
        (["--keep", "30"], r"keep must be above 0 and at most 1, got 30; for 30 % write 0.3 or 30%"),
        (["--view", "3"], r"--view needs --camera-file"),
        (["--path", "c.json", "--roll", "5"], r"--roll cannot be combined with --path, which places"),
        (["--from", "top", "--elevation", "5"], r"--elevation cannot be combined with --from top"),
        (["--look-at", "head"], r"--look-at must be subject, scene, part or three numbers such as 0,1.5,-2"),
        (["--distance", "2"], r"distance is that to a point: give the point too, look-at X,Y,Z"),
        (["--pan", "1"], r"--pan must be 2 numbers separated by commas, got '1'"),
        (["--camera-file", "none.json"], r"none\.json: "),
        (["--up", "sideways"], r"up must be one of .* or three numbers .* got 'sideways'"),
        (["--background", "redish"], r"background must be white, black, .* got 'redish'"),
        (["--stroke", "swirll"], r"swirll: neither a file nor a built-in stroke, .*did you mean 'swirl'\?"),
        (["-o", "a.bmp"], r"output must end in .png, .jpg, .jpeg, .tif, .*, .avif, .svg, .ora, .psd, got"),
        (["-o", "a.jpg", "--background", "transparent"], r"must not be transparent in a\.jpg, .* a\.png"),
        (["--no-such-flag"], r"unrecognized arguments: --no-such-flag"),
        (["--fps", "5"], r"--fps needs --orbit, --path or --grow"),
        (["--lock", "track"], r"--lock track needs --orbit or --path; strokes are tracked only along a path"),
        (["--first", "0.3", "--grow", "2"], r"--first cannot be combined with --orbit, --path or --grow"),
        (["-o", "a.mp4"], r"a\.mp4 is a video and needs a camera path; add --orbit or --path"),
        (["-o", "f/%05d.png"], r"%05d\.png numbers frames and needs a camera path; add --orbit or --path"),
        (["--orbit", "2"], r"--orbit must be a whole number of 3 or more, got '2'"),
        (["--orbit", "9", "--path", "a.json"], r"a camera path must be either an orbit or .*, got both"),
        (["--orbit", "9", "--frames", "5"], r"frames cannot be combined with orbit"),
        (["--orbit", "9", "--camera-file", "c.json"], r"--camera-file cannot be combined with --orbit"),
        (["--orbit", "9", "--jobs", "2", "--scheduler", "tcp://h:1"], "jobs cannot be combined with sched"),
        (["--orbit", "9", "--resume"], r"a video cannot be resumed \(--resume\), got 'pears-ellipse.mp4'"),
        (["--orbit", "9", "--size", "16386x9"], r"in \.mp4 with H\.264 must be at most 16384 pixels wide"),
        (["--orbit", "9", "--background", "transparent"], r"not be transparent in .*\.mp4, whose format"),
        (["--orbit", "9", "-o", "a.png"], r"a path has many frames, but 'a\.png' is one picture"),
        (["--palette-strength", "1"], "--palette-strength needs --palette"),
        (["--palette", "none.jpg"], r"none\.jpg: there is no such picture"),
        (["--where", "sphere:900,0,0,1"], r"none of .*sphere:900,0,0,1"),
        (["--where-soft", "0.1"], "--where-soft needs --where"),
        (["--where", "mask:m"], "where has mask:m, which needs --camera-file"),
        (["--style", "a:0.7,b:0.4"], "--style must have shares that add up to at most 1, got 1.1"),
        (["--direction", "style"], "direction style needs --style"),
        (["--continue"], "--continue needs --marks, the paint that is continued"),
        (["--hold", "2"], r"--hold needs --orbit, --path or --grow; a single picture does not use it"),
        (["--layers", "normal", "-o", "a.png"], r"layers must be written to .exr, got a.png; write a.exr"),
        (["--orbit", "3", "--layers", "uv", "-o", "a.mp4"], r"layers must be written to .exr, got a.mp4"),
        (["--stroke", "flat,,dab"], r"flat,,dab: a name is missing between two commas"),
        (["--stroke", "flat,gaussian"], r"'gaussian' is computed and not drawn, so it must be the only"),
        (["--explain", "-o", "a.png"], r"--explain draws .svg or .dot, got a.png; omit -o to print it"),
        (["--fps", "8", "--grow", "0"], r"grow must be above 0 seconds, got 0"),
    ],
)
def test_a_bad_flag_gets_one_sentence(scene, capsys, words, sentence):
    err = refused(capsys, "render", scene, "--stroke", "ellipse", *words)
    assert re.search(sentence, err), err
    assert names() == []


@for_each("command", ["render", "render --explain", "prune", "cluster", "info"])
@for_each(
    ("name", "content"),
    [("missing.ply", None), ("bad.ply", b""), ("bad.ply", b"ply\nformat ascii 1.0\nend_header\n")],
)
def test_a_bad_scene_gets_one_sentence(capsys, command, name, content):
    if content is not None:
        Path(name).write_bytes(content)
    before = names()
    assert refused(capsys, *command.split(), name).startswith(f"brushgs: {name}: ")
    assert names() == before


@for_each(
    "words",
    [
        ["prune", "tiles", "-o", "tiles/b.ply"],
        ["cluster", "tiles", "-o", "tiles/b.ply"],
        ["doctor", "tiles", "--fix", "tiles/b.ply"],
        ["views", "mine/00001.png", "-o", "mine/00001.png"],
        ["looks", "own.toml", "--scene", "tiles", "-o", "mine/00001.png"],
        ["render", "tiles", "--stroke", "mine", "-o", "mine/00001.png"],
        ["render", "tiles", "--stroke", "mine/00000.png,mine/00001.png", "-o", "mine/00001.png"],
        ["render", "tiles", "--focus", "mine/00001.png", "-o", "mine/00001.png"],
        ["render", "tiles", "--background", "mine/00001.png", "-o", "link.png"],
        ["render", "tiles", "--stroke", "mine/00001.png", "--orbit", "3", "-o", "mine/"],
        ["render", "tiles", "--background", "a.gif", "--orbit", "3", "-o", "a.gif"],
        ["style", "learn", "a.style", "-o", "./a.style"],
    ],
)
def test_no_input_is_overwritten(scene, capsys, words):
    for name in ("tiles", "mine"):
        Path(name).mkdir(exist_ok=True)
    for name in ("a", "b"):
        Path(f"tiles/{name}.ply").write_bytes(scene.read_bytes())
    for name in ("mine/00000.png", "mine/00001.png"):
        save_opaque(name, np.full((4, 4, 3), 0.5))
    for name in ("a.style", "a.gif"):
        Path(name).write_bytes(Path("mine/00000.png").read_bytes())
    Path("link.png").unlink(missing_ok=True)
    Path("link.png").symlink_to("mine/00001.png")
    Path("own.toml").write_text('[brushes]\nother = ["mine/00001.png"]\n')
    before = {path: path.read_bytes() for path in Path().rglob("*.*") if path.is_file()}
    assert re.search(r"is (the|an) input", refused(capsys, *words))
    assert {path: path.read_bytes() for path in Path().rglob("*.*") if path.is_file()} == before


@for_each(
    ("error", "code", "sentence"),
    [
        (KeyError("means"), 1, "brushgs: internal error, KeyError"),
        (MemoryError("Unable to allocate 12 GiB"), 2, "brushgs: out of memory (Unable to allocate 12 GiB)"),
        (KeyboardInterrupt(), 130, "brushgs: stopped\n"),
        (bg.SceneError("a.ply", "is gone"), 2, "brushgs: a.ply: is gone\n"),
        (OSError(28, "No space left on device", "a.png"), 2, "brushgs: a.png: No space left on device\n"),
    ],
)
def test_what_goes_wrong_has_a_code_and_a_sentence(scene, capsys, monkeypatch, error, code, sentence):
    def fail(*_, **__):
        raise error

    monkeypatch.setattr("brushgs.pipeline.still.paint_file", fail)
    found, out, err = run(capsys, "render", scene, *SMALL)
    assert (found, out, err.count("\n")) == (code, "", 1)
    assert err.startswith(sentence)
    if code != 130:
        with pytest.raises(type(error)):
            cli.main(["render", str(scene), "--debug"])


def test_a_scene_that_is_usable_with_a_loss_is_painted_with_a_note(scene, capsys):
    data = bytearray(scene.read_bytes())
    start = data.index(b"end_header\n") + len(b"end_header\n")
    data[start : start + 4] = b"\x00\x00\xc0\x7f"  # x of the first row becomes NaN
    Path("hurt.ply").write_bytes(data)
    code, out, err = run(capsys, "render", "hurt.ply", *SMALL)
    assert (code, out) == (0, "hurt-ellipse.png\n")
    assert re.search(r"^brushgs: note: hurt\.ply: .*1 of", err, re.MULTILINE), err
    _, out, err = run(capsys, "render", "hurt.ply", *SMALL, "--json")
    value = json.loads(out)
    assert (err, len(value["notes"])) == ("", 1)
    (load,) = [stage for stage in value["stages"] if stage["name"] == "load"]
    assert load["counts"]["rows_dropped"] == 1
    assert "1 rows dropped" in load["did"]
    assert re.search(r"^note +hurt\.ply", run(capsys, "info", "hurt.ply")[1], re.MULTILINE)


def test_the_palette_pass_stands_alone(scene, capsys):
    save_opaque("blue.png", np.full((4, 4, 3), blue := np.array((0.1, 0.2, 0.8))))
    words = ["--palette", "blue.png", "--palette-strength", "0.5", "--palette-space", "srgb"]
    code, out, err = run(capsys, "recolor", scene, *words)
    assert (code, out) == (0, "pears-recolored.ply\n")
    assert re.search(r"recolor +[0-9,]+ Gaussians, 50% of the way in srgb", err)
    before, after = (base_colors(bg.load(name).sh) for name in (scene, "pears-recolored.ply"))
    np.testing.assert_allclose(after, 0.5 * (before + blue), atol=0.01)


@for_each(("flag", "output"), [("--camera-file", "a.png"), ("--path", "f/")])
def test_a_camera_file_does_not_choose_a_picture_that_fills_the_memory(scene, capsys, flag, output):
    views = [
        {"id": i, "img_name": str(i), "width": 16000, "height": 16000, "position": [0, 0, -9 - i]}
        | {"rotation": np.eye(3).tolist(), "fx": 9e3, "fy": 9e3}
        for i in range(2)
    ]
    Path("cameras.json").write_text(json.dumps(views))
    words = [scene, *SMALL[:6], "--strokes", "20", flag, "cameras.json", "-o", output]
    assert "cameras.json: has cameras of 16000x16000 pixels" in refused(capsys, "render", *words)
    assert run(capsys, "render", *words, "--size", "32x32")[0] == 0


def test_strokes_from_a_file_are_all_painted_unless_a_share_is_asked_for(scene, capsys):
    assert run(capsys, "cluster", scene, "--strokes", "40", "-o", "few.ply")[0] == 0
    words = ["render", "few.ply", "--look", "plain", "--stroke", "flat", "--size", "64x48"]
    whole = stages_of(capsys, *words)
    assert whole["load"]["counts"]["is_strokes"]
    count = whole["load"]["counts"]["gaussians"]
    assert whole["prune"]["counts"]["after"] == count
    half = stages_of(capsys, *words, "--keep", "0.5")
    assert half["prune"]["counts"]["after"] == round(0.5 * count)
    assert run(capsys, "prune", "few.ply", "--keep", "0.9", "-o", "fewer.ply")[0] == 0
    fewer = stages_of(capsys, "render", "fewer.ply", *words[2:])
    assert fewer["load"]["counts"]["is_strokes"], "a pass over strokes leaves strokes"


def test_views_writes_a_sheet_and_lists_its_cells(scene, capsys):
    code, out, err = run(capsys, "views", scene, "--size", "24x18")
    assert (code, out) == (0, "pears-views.png\n")
    assert "24 pictures in 3 rows" in err
    _, out, _ = run(capsys, "views", scene, "--size", "24x18", "--up", "+z", "-o", "sheet.png", "--json")
    cells = json.loads(out)["cells"]
    assert [(cell["row"], cell["column"]) for cell in cells] == [(r, c) for r in range(3) for c in range(8)]
    flags = cells[1]["flags"]
    assert re.fullmatch(r"--up \+z --azimuth -?[0-9.]+ --elevation 15", flags)
    words = ["render", scene, "--stroke", "gaussian", "--size", "24x18", "-o", "a.png"]
    assert stages_of(capsys, *words, *flags.split())["camera"]["counts"]["flags"] == flags


@for_each("words", [["-o", "a/b.png"], ["--orbit", "3", "-o", "a/frames/"]])
def test_render_writes_the_sheet_beside_the_picture(scene, capsys, words):
    Path("a").mkdir(exist_ok=True)
    found = stages_of(capsys, "render", scene, *words, "--stroke", "gaussian", "--size", "24x18", "--views")
    assert "views" in found
    Path("a/pears-views.png").unlink()


@for_each(
    ("words", "same"), [([], ["--help"]), (["help"], ["--help"]), (["help", "render"], ["render", "--help"])]
)
def test_help_is_given_without_dashes_too(words, same, capsys):
    texts = []
    for asked in (words, same):
        with pytest.raises(SystemExit, match=r"^0$"):
            cli.main(asked)
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert texts[0].startswith("usage: brushgs")


def test_strokes_and_looks_list_the_names_and_what_each_is_good_for(capsys):
    of_looks = [bg.Look.open(name) for name in LOOKS]
    for command, listed, ends in (
        ("strokes", builtin_names(), [f"  {note.what}: {note.good_for}" for note in stroke_notes()]),
        ("looks", list(LOOKS), [f": {look.good_for}" for look in of_looks]),
    ):
        code, out, err = run(capsys, command)
        assert (code, err) == (0, "")
        assert [line.split()[0] for line in out.splitlines()] == listed
        for line, end in zip(out.splitlines(), ends, strict=True):
            assert line.endswith(end)
            assert len(line) < 110
    assert json.loads(run(capsys, "strokes", "--json")[1]) == builtin_names()
    assert [look["name"] for look in json.loads(run(capsys, "looks", "--json")[1])] == list(LOOKS)


def test_strokes_draws_a_chart(capsys):
    assert run(capsys, "strokes", "--sheet") == (0, "strokes.png\n", "")
    assert run(capsys, "strokes", "--sheet", "a.jpg") == (0, "a.jpg\n", "")
    assert names() == ["a.jpg", "strokes.png"]
    sheet = read_image("strokes.png")
    assert np.abs(sheet - read_image("a.jpg")).mean() < 2 / 255
    width, height = CELL
    for number in range(len(builtin_names())):
        x, y = number % COLUMNS * width, number // COLUMNS * height
        cell = sheet[y : y + height, x : x + width]
        paint = np.abs(cell - rgb_of(PAPER)).max(axis=2) > 0.1
        assert 0.03 < paint[:190].mean() < 0.6  # the mark, of which a line is the thinnest,
        assert paint[190:].any()  # and its name
        assert not paint[:, [*range(4), *range(-4, 0)]].any()
    assert "output must end in .png" in refused(capsys, "strokes", "--sheet", "a.txt")


@for_each("name", LOOKS)
def test_a_look_that_is_printed_to_a_file_is_the_same_look(name, capsys):
    code, out, err = run(capsys, "looks", name)
    assert (code, err) == (0, "")
    Path("mine.toml").write_text(out)
    look, mine = bg.Look.open(name), bg.Look.open("mine.toml")
    assert (mine.config, mine.title, look.name) == (look.config, look.title, name)
    assert look.good_for
    assert run(capsys, "looks", "mine.toml") == (0, out, "")


@for_each(
    ("words", "sentence"),
    [
        (["oyl"], "oyl: neither a file nor a look, which are oil,"),
        (["oil", "ink"], "looks prints one look at a time, got 2; add -o to paint them all"),
        (["oil", "--size", "64x48"], "--size needs -o, the sheet to paint"),
        (["oil", "--time", "50%"], "--time needs --scene"),
        (["-o", "a.txt"], "output must end in .png"),
        (["--scene", "none.ply"], "none.ply: "),
    ],
)
def test_looks_refuses_what_it_cannot_print_or_paint(words, sentence, capsys):
    assert sentence in refused(capsys, "looks", *words)
    assert names() == []


def test_looks_paints_a_sheet_of_a_scene(scene, capsys):
    words = "looks", "plain", "--size", "32x24", "--scene", scene
    code, out, err = run(capsys, *words)
    assert (code, out) == (0, "pears-looks.png\n")
    assert "Plain strokes" in err
    assert json.loads(run(capsys, *words, "-o", "a.jpg", "--json")[1])["output"] == "a.jpg"


def test_the_demo_writes_a_scene_and_its_picture(monkeypatch, capsys):
    monkeypatch.setattr("brushgs.outlets.demo.still_life", lambda *_, **__: still_life_of(1000))
    code, out, err = run(capsys, "demo", "--stroke", "gaussian", "--size", "64x48", "-o", "deep/folder")
    assert (code, out) == (0, "deep/folder/still_life-gaussian.png\n")
    assert "a still life of" in err
    assert read_image(out.strip()).std() > 0.1
    assert bg.load("deep/folder/still_life.ply").sh_degree == 3
    Path("file").touch()
    sentence = "is a file, not a folder; choose another name"
    assert sentence in refused(capsys, "demo", "-o", "file/folder")


def test_the_moving_demo_builds_a_clip_and_paints_it(monkeypatch, capsys):
    monkeypatch.setattr("brushgs.outlets.demo.SECONDS", 4 / 24)
    made = still_life_moving(1000, seconds=4 / 24)
    monkeypatch.setattr("brushgs.outlets.demo.still_life_moving", lambda *_, **__: made)
    words = "--look", "plain", "--stroke", "flat", "--strokes", "100", "--size", "64x48"
    code, out, err = run(capsys, "demo", "--moving", *words)
    assert (code, out) == (0, "brushgs-demo/still_life_moving-flat.mp4\n")
    assert "4 moments" in err
    clip = Path("brushgs-demo/still_life_moving")
    assert names(clip) == [f"moment_{k:05d}.ply" for k in range(4)]
    moving = bg.load_moving(clip)
    assert (moving.has_rows, len(moving.times), moving.duration) == (True, 4, 4 / 24)


# Where the size of files is limited, byte code would be cut off too, and fail where it is imported next.
LIMITED = {"PYTHONDONTWRITEBYTECODE": "1"}


def limited(size):
    """What has no file of a new process be longer."""

    def limit():
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


PICTURES, FILMS = ["png", "tif", "exr", "jpg", "webp", "avif"], ["mp4", "webm", "gif"]
PAGES, FILES = ["html", "glb"], ["ply", "sog", "spz", "usda", "usdz"]
ON_FULL_DISC = [*PICTURES, *FILMS, *PAGES, *FILES]
# One process for all formats, which share strokes and the start that takes time: each in a folder of its own.
FULL_DISC = """
import contextlib, io, json, os, sys
from brushgs import cli
from brushgs.pipeline.runner import Memory, holding

found, memory = {}, Memory()
for suffix, words in json.loads(sys.argv[1]).items():
    os.mkdir(suffix)
    os.chdir(suffix)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), holding(memory):
        code = cli.main(words)
    found[suffix] = code, out.getvalue(), err.getvalue(), os.listdir()
    os.chdir("..")
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def on_full_disc(scene, tmp_path_factory):
    """By suffix: exit code, stdout, stderr, and what is left where no file may be longer than 500 bytes."""
    commands = {}
    for suffix in ON_FULL_DISC:
        is_page, is_scene = suffix in PAGES, suffix in FILES
        words = ["export" if is_page else "prune" if is_scene else "render", str(scene)]
        words += [] if is_scene else SMALL
        words += ["--orbit", "3"] if suffix in FILMS else []
        commands[suffix] = [*words, "-o", f"a.{suffix}"]
    options = {"cwd": tmp_path_factory.mktemp("full"), "env": LIMITED, "preexec_fn": limited(500)}
    code, out, err = ran("-c", FULL_DISC, json.dumps(commands), **options)
    assert code == 0, err
    return json.loads(out)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no file size limit")
@for_each("suffix", ON_FULL_DISC)
def test_a_full_disc_gets_a_sentence_and_leaves_nothing(on_full_disc, suffix):
    code, out, err, left = on_full_disc[suffix]
    assert (code, out) == (2, "")
    is_scratch = suffix in ("html", "glb", "sog") and "temporary" in err  # pictures go there before
    of_scratch = "/.*: has no room for temporary files; .* TMPDIR .*"
    sentence = of_scratch if is_scratch else rf"a.{suffix}: cannot be written.*; check the .*disk"
    assert re.fullmatch(rf"brushgs: {sentence}\n", err), err
    assert left == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no file size limit")
def test_a_disc_that_fills_while_frames_are_painted_leaves_those_that_are_whole(scene, tmp_path):
    words = "render", scene, *SMALL, "--size", "320x240", "--orbit", "3", "-o", "f/"
    options = {"env": LIMITED, "preexec_fn": limited(2000)}  # the manifest fits, no frame does
    code, out, err = ran("-m", "brushgs", *words, cwd=tmp_path, **options)
    assert (code, out) == (2, "")
    assert re.fullmatch(r"brushgs: /.*: has no room for temporary files; .* TMPDIR .*\n", err), err
    assert names(tmp_path / "f") == [".%05d.png.json"]


def shown_on_a_terminal(words, cwd):
    """Exit code of a command, and what a terminal of 120 columns shows of it."""
    import pty

    ours, theirs = pty.openpty()
    environment = {"TERM": "xterm", "COLUMNS": "120"}
    with start("-m", "brushgs", *words, cwd=cwd, env=environment, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        while chunk := _read(ours):
            shown += chunk
    os.close(ours)
    return process.returncode, shown.decode()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminal")
def test_a_terminal_sees_a_bar_for_each_stage_and_a_pipe_does_not(scene, tmp_path):
    words = ["render", scene, *SMALL]
    _, _, piped = ran("-m", "brushgs", *words, cwd=tmp_path)
    assert ran("-m", "brushgs", "--version") == (0, f"brushgs {bg.__version__}\n", "")
    assert "\x1b" not in piped
    assert len(piped.splitlines()) <= 8
    assert "total" in piped
    code, shown = shown_on_a_terminal(words, tmp_path)
    assert code == 0
    bars, table = shown.split("scene  ")
    assert "\u2501" in bars  # the line that a bar is drawn with
    assert "rasterise" in bars
    assert "total" in table


def _read(terminal):
    """What a terminal shows next; nothing once its other end is closed."""
    try:
        return os.read(terminal, 65536)
    except OSError:
        return b""
