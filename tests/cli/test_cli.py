import json
import os
import re
import signal
import subprocess
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
from brushgs.options.look import Look
from brushgs.outlets.stroke_chart import CELL, COLUMNS, PAPER
from brushgs.still_life.moving import still_life_moving
from brushgs.values.colors import rgb_of
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    save_upright(still_life_of(2000), path)
    return path


@pytest.fixture
def scene(made, tmp_path, monkeypatch):
    """A scene; the current folder is empty."""
    monkeypatch.chdir(tmp_path)
    return str(made)


def names(folder="."):
    """What lies in a folder, hidden files too."""
    return sorted(path.name for path in Path(folder).iterdir())


# Strokes that do not look at the scene: a tenth of the time of the default look.
SMALL = ["--look", "plain", "--see", "off", "--stroke", "ellipse", "--strokes", "100", "--size", "64x48"]


def run(capsys, *words):
    """Exit code, stdout and stderr of one command."""
    code = cli.main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_render_names_its_output_prints_the_path_and_a_table(scene, capsys):
    code, out, err = run(capsys, "render", scene, *SMALL, "--solid", "off", "--verbose")
    assert code == 0
    assert out == "pears-ellipse.png\n"
    assert read_image("pears-ellipse.png").shape == (48, 64, 3)
    for word in (
        "stage",
        "what it did",
        "seconds",
        "skipped",
        "load",
        "prune",
        "cluster",
        "total",
        "kept 1,",
    ):
        assert word in err
    assert "from the file" in " ".join(err.split())
    assert names() == ["pears-ellipse.png"]


def test_the_table_is_short_by_default(scene, capsys):
    words = "render", scene, *SMALL, "--where", "box:-1000,-1000,-1000,1000,1000,1000"
    _, _, err = run(capsys, *words)
    note, *rest = err.splitlines()
    assert note.startswith("brushgs: note: --where box:-1000,-1000,-1000,1000,1000,1000 changes nothing")
    lines = [re.split("  +", line, maxsplit=1) for line in rest]
    assert [word for word, _ in lines] == [
        "scene",
        "first view",
        "view",
        "strokes",
        "brush",
        "file",
        "skipped",
        "total",
    ]
    told = dict(lines)
    assert "limiting to a part: all of the scene lies in it" in told["skipped"]
    assert "pruning" not in told["skipped"]
    _, out, _ = run(capsys, *words, "--json")
    assert json.loads(out)["stages"][-1]["name"] == "write"
    flags = next(one["counts"]["flags"] for one in json.loads(out)["stages"] if one["name"] == "camera")
    assert flags in told["view"]


def test_quiet_says_nothing(scene, capsys):
    assert run(capsys, "render", scene, *SMALL, "--quiet") == (0, "", "")
    assert Path("pears-ellipse.png").is_file()


def test_json_goes_to_stdout_alone(scene, capsys):
    code, out, err = run(capsys, "render", scene, *SMALL, "--json", "-o", "x.tif")
    value = json.loads(out)
    assert (code, err, value["output"]) == (0, "", "x.tif")
    assert [stage["name"] for stage in value["stages"]][-1] == "write"


@pytest.mark.parametrize("up", ["-y", "-0.1,-1,0", "-.5 1 0"])
def test_up_may_start_with_a_minus(scene, capsys, up):
    assert run(capsys, "render", scene, *SMALL, "--up", up, "--quiet")[0] == 0


@for_each(
    ("words", "sentence"),
    [
        (["--size", "12"], r"--size must be WIDTHxHEIGHT in pixels such as 1280x720, got '12'"),
        (["--size", "30000x30000"], r"most 268 million pixels, got 30000x30000; the .* is 16384x16384"),
        (["--size", "40000x10"], r"must be 1x1 to 32767x32767 pixels, got 40000x10; the .* is 32767x8"),
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
        (
            ["-o", "a.bmp"],
            r"output must end in .png, .jpg, .jpeg, .tif, .*, .webp, .avif, .svg, .ora, .psd, got",
        ),
        (["-o", "a.jpg", "--background", "transparent"], r"must not be transparent in a\.jpg, .* a\.png"),
        (["--no-such-flag"], r"unrecognized arguments: --no-such-flag"),
        (["--fps", "5"], r"--fps needs --orbit, --path or --grow"),
        (["--scheduler", "tcp://host:1"], r"--scheduler needs --orbit, --path or --grow"),
        (["--lock", "track"], r"--lock track needs --orbit or --path; strokes are tracked only along a path"),
        (["--grow", "1e9"], r"grow times fps must give 2 to 99999 frames"),
        (["--grow", "2", "-o", "a.png"], r"many frames, but 'a\.png' is one picture; write a-%05d\.png"),
        (["--first", "0.3", "--grow", "2"], r"--first cannot be combined with --orbit, --path or --grow"),
        (["-o", "a.mp4"], r"a\.mp4 is a video and needs a camera path; add --orbit or --path"),
        (["-o", "f/%05d.png"], r"%05d\.png numbers frames and needs a camera path; add --orbit or --path"),
        (["--orbit", "2"], r"--orbit must be a whole number of 3 or more, got '2'"),
        (["--orbit", "9", "--path", "a.json"], r"a camera path must be either an orbit or .*, got both"),
        (["--orbit", "9", "--frames", "5"], r"frames cannot be combined with orbit"),
        (["--orbit", "9", "--camera-file", "c.json"], r"--camera-file cannot be combined with --orbit"),
        (["--path", "p", "--camera-file", "c.json"], r"--camera-file cannot be combined with --path"),
        (["--path", "p.json", "--zoom", "2"], r"--zoom cannot be combined with --path, which places"),
        (["--path", "none.json"], r"none\.json: "),
        (
            ["--orbit", "9", "--jobs", "2", "--scheduler", "tcp://h:1"],
            r"jobs cannot be combined with scheduler",
        ),
        (["--orbit", "9", "--resume"], r"a video cannot be resumed \(--resume\), got 'pears-ellipse.mp4'"),
        (
            ["--orbit", "9", "--size", "16386x9"],
            r"pictures in \.mp4 with H\.264 must be at most 16384 pixels wide and high",
        ),
        (
            ["--orbit", "9", "--background", "transparent"],
            r"background must not be transparent in .*\.mp4, whose format holds no transparency",
        ),
        (["--orbit", "9", "-o", "a.png"], r"a path has many frames, but 'a\.png' is one picture"),
    ],
)
def test_a_bad_flag_gets_one_sentence(scene, capsys, words, sentence):
    code, out, err = run(capsys, "render", scene, "--stroke", "ellipse", *words)
    assert (code, out) == (2, "")
    assert re.match(f"brushgs: .*{sentence}", err), err
    assert err.count("\n") == 1
    assert names() == []


@pytest.mark.parametrize("command", ["render", "prune", "cluster", "info"])
@pytest.mark.parametrize(
    ("content", "sentence"),
    [(None, "missing.ply: "), (b"", "bad.ply: "), (b"ply\nformat ascii 1.0\nend_header\n", "bad.ply: ")],
)
def test_a_bad_scene_gets_one_sentence(tmp_path, monkeypatch, capsys, command, content, sentence):
    monkeypatch.chdir(tmp_path)
    name = "missing.ply"
    if content is not None:
        name = "bad.ply"
        Path(name).write_bytes(content)
    before = names()
    code, out, err = run(capsys, command, name)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith(f"brushgs: {sentence}")
    assert names() == before


def test_an_existing_picture_survives_a_run_that_fails(scene, capsys, monkeypatch):
    Path("a.png").write_bytes(b"precious")

    def fail(*_, **__):
        raise OSError(28, "No space left on device", "a.png")

    monkeypatch.setattr("brushgs.formats.pictures.images.write_frame", fail)
    code, out, err = run(capsys, "render", scene, *SMALL, "-o", "a.png")
    assert (code, out, err) == (2, "", "brushgs: a.png: No space left on device\n")
    assert Path("a.png").read_bytes() == b"precious"


def test_the_input_is_never_overwritten(scene, capsys):
    before = Path(scene).read_bytes()
    code, _, err = run(capsys, "prune", scene, "-o", scene)
    assert code == 2
    assert "is the input, which is never overwritten" in err
    assert Path(scene).read_bytes() == before


def test_debug_shows_the_traceback(scene):
    with pytest.raises(bg.SceneError):
        cli.main(["render", "missing.ply", *SMALL, "--debug"])


def test_a_fault_of_our_own_is_called_one(scene, capsys, monkeypatch):
    def fail(*_, **__):
        raise KeyError("means")

    monkeypatch.setattr("brushgs.pipeline.still.paint_file", fail)
    code, _, err = run(capsys, "render", scene, *SMALL)
    assert (code, err.count("\n")) == (1, 1)
    assert "internal error, KeyError" in err
    with pytest.raises(KeyError):
        cli.main(["render", scene, "--debug"])


def test_memory_that_runs_out_is_said(scene, capsys, monkeypatch):
    def fail(*_, **__):
        raise MemoryError("Unable to allocate 12.0 GiB")

    monkeypatch.setattr("brushgs.pipeline.still.paint_file", fail)
    code, _, err = run(capsys, "render", scene, *SMALL)
    assert code == 2
    assert err.startswith("brushgs: out of memory (Unable to allocate 12.0 GiB)")


def test_ctrl_c_exits_with_130(scene, capsys, monkeypatch):
    def stop(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("brushgs.pipeline.still.paint_file", stop)
    assert run(capsys, "render", scene, *SMALL) == (130, "", "brushgs: stopped\n")


def test_a_scene_that_is_usable_with_a_loss_is_painted_with_a_note(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    save_upright(still_life_of(1000), "hurt.ply")
    data = bytearray(Path("hurt.ply").read_bytes())
    start = data.index(b"end_header\n") + len(b"end_header\n")
    data[start : start + 4] = b"\x00\x00\xc0\x7f"  # x of the first row becomes NaN
    Path("hurt.ply").write_bytes(data)
    code, out, err = run(capsys, "render", "hurt.ply", *SMALL)
    assert (code, out) == (0, "hurt-ellipse.png\n")
    assert re.search(r"^brushgs: note: hurt\.ply: .*1 of", err, re.MULTILINE), err
    _, out, err = run(capsys, "render", "hurt.ply", *SMALL, "--json")
    assert err == ""
    value = json.loads(out)
    assert len(value["notes"]) == 1
    (load,) = [stage for stage in value["stages"] if stage["name"] == "load"]
    assert load["counts"]["rows_dropped"] == 1
    assert "1 rows dropped" in load["did"]
    _, out, _ = run(capsys, "info", "hurt.ply")
    assert re.search(r"^note +hurt\.ply", out, re.MULTILINE)


def test_a_folder_takes_numbered_frames_and_resume_goes_on_with_them(scene, capsys):
    assert run(capsys, "render", scene, *SMALL, "--orbit", "4", "-o", "f/")[:2] == (0, "f/%05d.png\n")
    Path("f/00002.png").unlink()
    words = "render", scene, *SMALL, "--orbit", "4", "-o", "f/", "--resume"
    _, out, _ = run(capsys, *words, "--json")
    value = json.loads(out)
    counts = {stage["name"]: stage["counts"] for stage in value["stages"]}
    assert (counts["paint"]["painted"], counts["paint"]["skipped"], value["output"]) == (1, 3, "f/%05d.png")
    assert len(names("f")) == 5
    code, _, err = run(capsys, *words, "--seed", "5")
    assert code == 2
    assert re.match(r"brushgs: f/%05d\.png: .* another painting \(seed 0, now 5\); give the options", err)


def test_passes_stand_alone(scene, capsys):
    assert run(capsys, "prune", scene, "--keep", "0.5")[:2] == (0, "pears-pruned.ply\n")
    assert run(capsys, "cluster", "pears-pruned.ply", "--strokes", "40", "-o", "few.ply")[:2] == (
        0,
        "few.ply\n",
    )
    assert len(bg.load("few.ply")) <= 40


@pytest.fixture
def blue(scene):
    """A blue picture in the current folder."""
    rgb = np.full((4, 4, 3), (0.1, 0.2, 0.8), np.float32)
    bg.save(bg.Frame(rgb, np.ones((4, 4), np.float32), np.zeros((4, 4), np.float32)), "blue.png")
    return "blue.png"


def test_a_palette_gives_its_colours(scene, blue, capsys):
    words = ["--background", "transparent", "--palette", blue, "--broken-color", "0"]
    code, out, _ = run(capsys, "render", scene, *SMALL, *words, "--json")
    assert code == 0
    assert "100% of the way in lab" in out
    picture = read_image("pears-ellipse.png")
    painted = picture[..., 3] > 0.5
    np.testing.assert_allclose(picture[painted, :3], [[0.1, 0.2, 0.8]] * painted.sum(), atol=0.02)


def test_the_palette_pass_stands_alone(scene, blue, capsys):
    words = ["--palette", blue, "--palette-strength", "0.5", "--palette-space", "srgb"]
    code, out, err = run(capsys, "recolor", scene, *words)
    assert (code, out) == (0, "pears-recolored.ply\n")
    assert re.search(r"recolor +[0-9,]+ Gaussians, 50% of the way in srgb", err)
    assert "strokes" not in err
    before, after = (base_colors(bg.load(name).sh) for name in (scene, "pears-recolored.ply"))
    assert np.std(after) < np.std(before)
    assert bg.load("pears-recolored.ply").means.shape == bg.load(scene).means.shape


def test_frames_of_another_palette_are_not_gone_on_with(scene, blue, capsys):
    words = [*SMALL, "--orbit", "3", "-o", "f/", "--palette", blue]
    assert run(capsys, "render", scene, *words)[0] == 0
    code, _, err = run(capsys, "render", scene, *words, "--palette-strength", "0.5", "--resume")
    assert code == 2
    assert "palette strength 1.0, now 0.5" in err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--palette-strength", "1"], "--palette-strength needs --palette"),
        (["--palette", "none.jpg"], r"none\.jpg: there is no such picture"),
        (["--palette", "clear.png"], r"clear\.png: has no colours to take"),
    ],
)
def test_a_bad_palette_gets_one_sentence(scene, blue, capsys, words, sentence):
    nothing = np.zeros((4, 4, 4), np.float32)
    bg.save(bg.Frame(nothing[..., :3], nothing[..., 3], nothing[..., 3]), "clear.png")
    code, out, err = run(capsys, "render", scene, *SMALL, *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert re.search(sentence, err), err


@pytest.mark.parametrize("flag", ["--camera-file", "--path"])
def test_a_camera_file_does_not_choose_a_picture_that_fills_the_memory(scene, capsys, flag):
    turn = np.eye(3).tolist()
    views = [
        {"id": i, "img_name": str(i), "width": 16000, "height": 16000, "position": [0, 0, -9 - i]}
        | {"rotation": turn, "fx": 9e3, "fy": 9e3}
        for i in range(2)
    ]
    Path("cameras.json").write_text(json.dumps(views))
    output = "a.png" if flag == "--camera-file" else "f/"
    words = [
        "--look",
        "plain",
        "--see",
        "off",
        "--stroke",
        "ellipse",
        "--strokes",
        "20",
        flag,
        "cameras.json",
        "-o",
        output,
    ]
    code, _, err = run(capsys, "render", scene, *words)
    assert (code, err.count("\n")) == (2, 1)
    assert "cameras.json: has cameras of 16000x16000 pixels" in err
    assert run(capsys, "render", scene, *words, "--size", "32x32")[0] == 0


def test_strokes_from_a_file_are_all_painted_unless_a_share_is_asked_for(scene, capsys):
    assert run(capsys, "cluster", scene, "--strokes", "40", "-o", "few.ply")[0] == 0
    words = ["few.ply", "--look", "plain", "--stroke", "flat", "--size", "64x48"]
    _, out, _ = run(capsys, "render", *words, "--json")
    counts = {stage["name"]: stage["counts"] for stage in json.loads(out)["stages"]}
    assert counts["load"]["is_strokes"]
    assert counts["prune"]["after"] == counts["load"]["gaussians"]
    _, out, _ = run(capsys, "render", *words, "--keep", "0.5", "--json")
    counts_now = {stage["name"]: stage["counts"] for stage in json.loads(out)["stages"]}
    assert counts_now["prune"]["after"] == round(0.5 * counts["load"]["gaussians"])
    assert run(capsys, "prune", "few.ply", "--keep", "0.9", "-o", "fewer.ply")[0] == 0
    _, out, _ = run(capsys, "render", "fewer.ply", "--look", "plain", "--size", "64x48", "--json")
    assert json.loads(out)["stages"][1]["counts"]["is_strokes"], "a pass over strokes leaves strokes"


def test_views_writes_a_sheet_and_lists_its_cells(scene, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "views", scene, "--size", "48x36")
    assert (code, out) == (0, f"{Path(scene).stem}-views.png\n")
    assert "24 pictures in 3 rows" in err
    _, out, _ = run(capsys, "views", scene, "--size", "48x36", "--up", "+z", "-o", "sheet.png", "--json")
    cells = json.loads(out)["cells"]
    assert [(cell["row"], cell["column"]) for cell in cells] == [(r, c) for r in range(3) for c in range(8)]
    assert re.fullmatch(r"--up \+z --azimuth -?[0-9.]+ --elevation 15", cells[1]["flags"])
    words = ["render", scene, "--stroke", "gaussian", "--size", "48x36", "-o", "a.png", "--json"]
    _, out, _ = run(capsys, *words, *cells[1]["flags"].split())
    counts = {stage["name"]: stage["counts"] for stage in json.loads(out)["stages"]}
    assert counts["camera"]["flags"] == cells[1]["flags"]


@pytest.mark.parametrize("words", [["-o", "a/b.png"], ["--orbit", "3", "-o", "a/frames/"]])
def test_render_writes_the_sheet_beside_the_picture(scene, tmp_path, monkeypatch, capsys, words):
    monkeypatch.chdir(tmp_path)
    Path("a").mkdir()
    options = ["--stroke", "gaussian", "--size", "32x24", "--views", "--json"]
    code, out, _ = run(capsys, "render", scene, *words, *options)
    assert code == 0
    sheet = f"{Path(scene).stem}-views.png"
    assert sheet in names("a")
    assert json.loads(out)["output"] != sheet
    assert "views" in [stage["name"] for stage in json.loads(out)["stages"]]


@pytest.mark.parametrize(
    ("words", "same"), [([], ["--help"]), (["help"], ["--help"]), (["help", "render"], ["render", "--help"])]
)
def test_help_is_given_without_dashes_too(words, same, capsys):
    texts = []
    for asked in (words, same):
        with pytest.raises(SystemExit) as exit:
            cli.main(asked)
        assert exit.value.code == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert texts[0].startswith("usage: brushgs")


def test_strokes_lists_the_names_and_what_each_is_good_for(capsys):
    code, out, err = run(capsys, "strokes")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert [line.split()[0] for line in lines] == builtin_names()
    for line, note in zip(lines, stroke_notes(), strict=True):
        assert line.endswith(f"  {note.what}: {note.good_for}")
        assert len(line) < 110
    assert json.loads(run(capsys, "strokes", "--json")[1]) == builtin_names()


def test_strokes_draws_a_chart(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
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
        assert not paint[:, :4].any()
        assert not paint[:, -4:].any()
    code, _, err = run(capsys, "strokes", "--sheet", "a.txt")
    assert (code, "output must end in .png" in err) == (2, True)


def test_looks_lists_the_names_and_what_each_is_good_for(capsys):
    code, out, err = run(capsys, "looks")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert [line.split()[0] for line in lines] == list(LOOKS)
    for line in lines:
        look = Look.open(line.split()[0])
        assert f"  {look.title}, " in line
        assert line.endswith(f": {look.good_for}")
        assert len(line) < 110
    assert [look["name"] for look in json.loads(run(capsys, "looks", "--json")[1])] == list(LOOKS)


@pytest.mark.parametrize("name", LOOKS)
def test_a_look_that_is_printed_to_a_file_is_the_same_look(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "looks", name)
    assert (code, err) == (0, "")
    Path("mine.toml").write_text(out)
    assert Look.open("mine.toml").config == Look.open(name).config
    assert run(capsys, "looks", "mine.toml") == (0, out, "")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["oyl"], "oyl: neither a file nor a look, which are oil,"),
        (["oil", "ink"], "looks prints one look at a time, got 2; add -o to paint them all"),
        (["oil", "--size", "64x48"], "--size needs -o, the sheet to paint"),
        (["-o", "a.txt"], "output must end in .png"),
        (["--scene", "none.ply"], "none.ply: "),
    ],
)
def test_looks_refuses_what_it_cannot_print_or_paint(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "looks", *words)
    assert (code, out) == (2, "")
    assert err.startswith("brushgs: ")
    assert sentence in err
    assert err.count("\n") == 1
    assert names() == []


def test_looks_paints_a_sheet_of_a_scene(scene, capsys):
    words = "looks", "plain", "--size", "64x48", "--scene", scene
    code, out, err = run(capsys, *words)
    assert (code, out) == (0, "pears-looks.png\n")
    assert "Plain strokes" in err
    assert json.loads(run(capsys, *words, "-o", "a.jpg", "--json")[1])["output"] == "a.jpg"
    assert names() == ["a.jpg", "pears-looks.png"]


def test_a_picture_is_called_after_its_look(scene, capsys):
    words = ["--strokes", "50", "--size", "64x48", "--see", "off", "--ground", "none"]
    assert run(capsys, "render", scene, *words)[:2] == (0, "pears-oil.png\n")
    Path("mine.toml").write_text('base = "ink"\n[light]\nrelief = 0.2\n')
    assert run(capsys, "render", scene, *words, "--look", "mine.toml")[:2] == (0, "pears-mine.png\n")
    Path("mine.toml").write_text("[light]\nreleif = 0.2\n")
    code, out, err = run(capsys, "render", scene, *words, "--look", "mine.toml")
    assert (code, out) == (2, "")
    assert err == "brushgs: mine.toml: [light] has no 'releif'; did you mean 'relief'?\n"


def test_the_demo_says_where_the_picture_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("brushgs.outlets.demo.still_life", lambda *_, **__: still_life_of(1000))
    code, out, err = run(capsys, "demo", "--stroke", "gaussian", "--size", "64x48")
    assert (code, out) == (0, "brushgs-demo/still_life-gaussian.png\n")
    assert "a still life of" in err
    assert names("brushgs-demo") == ["still_life-gaussian.png", "still_life.ply"]


def test_the_moving_demo_builds_a_clip_and_paints_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("brushgs.outlets.demo.SECONDS", 4 / 24)
    monkeypatch.setattr(
        "brushgs.outlets.demo.still_life_moving", lambda *_, **__: still_life_moving(1000, seconds=4 / 24)
    )
    words = "--look", "plain", "--stroke", "flat", "--strokes", "100", "--size", "64x48"
    code, out, err = run(capsys, "demo", "--moving", *words)
    assert (code, out) == (0, "brushgs-demo/still_life_moving-flat.mp4\n")
    assert "4 moments" in err
    assert names("brushgs-demo") == ["still_life_moving", "still_life_moving-flat.mp4"]


def brushgs(*words, cwd, **options):
    command = [sys.executable, "-m", "brushgs", *map(str, words)]
    # Where the size of files is limited, byte code would be cut off too, and fail where it is imported next.
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.Popen(
        command,
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


def test_version_of_the_module_run_as_a_program(tmp_path):
    with brushgs("--version", cwd=tmp_path) as process:
        out, err = process.communicate()
    assert (process.returncode, out, err) == (0, f"brushgs {bg.__version__}\n", "")


PICTURES, FILMS = ["png", "tif", "exr", "jpg", "webp", "avif"], ["mp4", "webm", "gif"]
PAGES, FILES = ["html", "glb"], ["ply", "sog", "spz", "usda", "usdz"]
ON_FULL_DISC = [*PICTURES, *FILMS, *PAGES, *FILES]
# One process for all formats, since it is the start that takes time: each in a folder of its own.
FULL_DISC = """
import contextlib, io, json, os, sys
from brushgs import cli

found = {}
for suffix, words in json.loads(sys.argv[1]).items():
    os.mkdir(suffix)
    os.chdir(suffix)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main(words)
    found[suffix] = code, out.getvalue(), err.getvalue(), os.listdir()
    os.chdir("..")
print(json.dumps(found))
"""


@pytest.fixture(scope="module")
def on_full_disc(made, tmp_path_factory):
    """By suffix: exit code, stdout, stderr, and what is left where no file may be longer than 500 bytes."""

    def limit():
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, 500))

    commands = {}
    for suffix in ON_FULL_DISC:
        is_page, is_scene = suffix in PAGES, suffix in FILES
        words = ["export" if is_page else "prune" if is_scene else "render", str(made)]
        words += [] if is_scene else SMALL
        words += ["--orbit", "3"] if suffix in FILMS else []
        commands[suffix] = [*words, "-o", f"a.{suffix}"]
    ran = subprocess.run(
        [sys.executable, "-c", FULL_DISC, json.dumps(commands)],
        cwd=tmp_path_factory.mktemp("full"),
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
        preexec_fn=limit,
    )
    return json.loads(ran.stdout)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no file size limit")
@pytest.mark.parametrize("suffix", ON_FULL_DISC)
def test_a_full_disc_gets_a_sentence_and_leaves_nothing(on_full_disc, suffix):
    code, out, err, left = on_full_disc[suffix]
    assert (code, out) == (2, "")
    is_scratch = suffix in ("html", "glb", "sog") and "temporary" in err  # pictures go there before
    sentence = (
        "/.*: has no room for temporary files; .* TMPDIR .*"
        if is_scratch
        else (rf"a.{suffix}: cannot be written.*; check the .*disk")
    )
    assert re.fullmatch(rf"brushgs: {sentence}\n", err), err
    assert left == []


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no file size limit")
def test_a_disc_that_fills_while_frames_are_painted_leaves_those_that_are_whole(made, tmp_path):
    def limit():
        import resource

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))  # the manifest fits, no frame does

    words = "render", made, *SMALL, "--size", "320x240", "--orbit", "3", "-o", "f/"
    with brushgs(*words, cwd=tmp_path, preexec_fn=limit) as process:
        out, err = process.communicate()
    assert (process.returncode, out) == (2, "")
    assert re.fullmatch(r"brushgs: /.*: has no room for temporary files; .* TMPDIR .*\n", err), err
    assert names(tmp_path / "f") == [".%05d.png.json"]


def shown_on_a_terminal(words, cwd):
    """Exit code of a command, and what a terminal of 120 columns shows of it."""
    import pty

    ours, theirs = pty.openpty()
    environment = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "120"}
    command = [sys.executable, "-m", "brushgs", *map(str, words)]
    with subprocess.Popen(
        command, cwd=cwd, env=environment, stdout=subprocess.PIPE, stderr=theirs
    ) as process:
        os.close(theirs)
        shown = b""
        while chunk := _read(ours):
            shown += chunk
    os.close(ours)
    return process.returncode, shown.decode()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminal")
def test_a_terminal_sees_a_bar_for_each_stage_and_a_pipe_does_not(made, tmp_path):
    words = ["render", made, *SMALL]
    with brushgs(*words, cwd=tmp_path) as process:
        _, piped = process.communicate()
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
