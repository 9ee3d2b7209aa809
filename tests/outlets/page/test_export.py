import json
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.cli.commands import export
from brushgs.cli.parser import parse
from brushgs.cli.words import words_of
from brushgs.options.page import HEADSET_FRAGMENTS, PHONE_BYTES, UNDERPAINT_STEP
from brushgs.options.painting import PaintConfig
from brushgs.outlets.page.export import export_file
from brushgs.outlets.page.still import MOST_BYTES, STILL_SIDE
from brushgs.outlets.page.weight import Weight, warnings_of
from brushgs.pipeline import still
from tests.outlets.page.paintings import CAMERA, some_strokes
from tests.outlets.page.read import read_page
from tests.scenes import save_upright, still_life_of

# Without what takes most of the time of a small painting, and is no matter of files.
SMALL = ["--strokes", "150", "--size", "96x64", "--threads", "1", "--see", "off", "--focus", "off"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "pears.ply"
    save_upright(still_life_of(2000), path)
    return path


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """The current folder is empty."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def scene(made):
    return str(made)


def run(capsys, *words):
    """Exit code, stdout and stderr of one command."""
    code = cli.main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def names():
    return sorted(path.name for path in Path().iterdir())


def test_export_names_its_output_and_says_what_it_costs(scene, capsys):
    code, out, err = run(capsys, "export", scene, "--look", "charcoal", *SMALL, "--verbose")
    assert (code, out, names()) == (0, "pears-charcoal.html\n", ["pears-charcoal.html"])
    for word in ("MB", "vertices", "fragments", "painted pixel"):
        assert word in " ".join(err.split())


def test_the_first_view_is_that_of_render_and_its_strokes_too(scene, monkeypatch):
    config = PaintConfig.of({"cluster": {"strokes": 100}, "view": {"size": (96, 64), "azimuth": 0.5}})
    caught = []

    def watched(painting, report, **options):
        caught.append(painting)
        return paint_view(painting, report, **options)

    paint_view = still.paint_view
    monkeypatch.setattr(still, "paint_view", watched)
    still.paint_file(scene, "a.png", config)
    export_file(scene, "a.html", config)
    header, arrays = read_page(Path("a.html"))
    (prepared,) = caught
    camera = prepared.camera
    assert header["camera"] == {
        "viewmat": camera.viewmat.ravel().tolist(),
        "K": camera.K.ravel().tolist(),
        "width": 96,
        "height": 64,
        "near": camera.near,
    }
    strokes, origin = prepared.painting.coats[0].strokes, np.array(header["origin"])
    means = (strokes.means.astype(np.float64) - origin).astype(np.float32)
    found = arrays["coat0.means"]
    assert sorted(map(tuple, found.tolist())) == sorted(map(tuple, means.tolist()))
    assert header["up"] == [0, -1, 0]
    assert header["title"] == "pears"


VIEWS = [["--look-at", "0,0,0", "--roll", "20"], ["--pan", "0.2,0.1", "--from", "top"]]


def test_a_camera_of_a_file_is_the_first_view(scene, capsys):
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    pose[2, 3] = 8.0
    frames = [{"file_path": "a", "transform_matrix": pose.tolist()}]
    Path("cameras.json").write_text(json.dumps({"camera_angle_x": 0.8, "w": 64, "h": 48, "frames": frames}))
    words = ["--look", "plain", "--strokes", "50", "--camera-file", "cameras.json"]
    assert run(capsys, "export", scene, "-o", "a.html", *words)[0] == 0
    header, _ = read_page(Path("a.html"))
    (camera,) = bg.load_cameras("cameras.json")
    assert header["camera"]["viewmat"] == camera.viewmat.ravel().tolist()
    assert (header["camera"]["width"], header["camera"]["height"]) == (64, 48)


def test_the_command_paints_the_same_strokes_without_the_view(scene, capsys):
    words = ["--title", "T", "--look", "charcoal", "--azimuth", "-30", "--palette=-odd.png"]
    words += ["--chroma", "0.5"]
    words = ["export", "a.ply", "b.ply", "-o", "x.html", *words, "--size=64x48", "--quiet", "--threads", "2"]
    args = parse(words)
    parser = export.ArgumentParser()
    export.add_flags(parser)
    kept = words_of(parser, args.words, export._paints)
    assert kept == ["--look", "charcoal", "--palette=-odd.png", "--chroma", "0.5"]
    assert vars(parse(["render", "a.ply", *kept]))["color.chroma"] == 0.5
    run(capsys, "export", scene, "-o", "a.html", "--look", "plain", *SMALL)
    header, _ = read_page(Path("a.html"))
    assert header["command"] == {
        "scene": scene,
        "options": ["--look", "plain", "--strokes", "150", "--see", "off", "--focus", "off"],
    }
    run(capsys, "export", scene, "-o", "b.html", "--look", "plain", *SMALL, "--lock", "anchor")
    anchored, _ = read_page(Path("b.html"))
    assert anchored["command"]["options"][-2:] == ["--lock", "anchor"]
    assert [{coat["lock"] for coat in one["coats"]} for one in (header, anchored)] == [
        {"canonical"},
        {"anchor"},
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.htm"], "output must end in .html"),
        (["-o", "a.html", "--address", "example.org"], "--address must begin with https:// or http://"),
        (["-o", "a.glb", "--caption", "x"], "--caption needs -o FILE.html"),
        (["-o", "a.html", "--look", "nothing"], "nothing"),
        (["-o", "a.html", "--zoom", "0"], "zoom"),
        (["-o", "a.html", "--lock", "track"], "lock"),
    ],
)
def test_bad_input_is_one_sentence_and_no_file(scene, capsys, words, said):
    code, out, err = run(capsys, "export", scene, *words)
    assert (code, out, names()) == (2, "", [])
    assert said in err
    assert err.count("\n") == 1


def test_a_scene_is_not_replaced_and_an_empty_one_refused(scene, capsys):
    bg.save(some_strokes(1), "empty.ply")
    content = Path("empty.ply").read_bytes()
    header, end, _ = content.partition(b"end_header\n")
    Path("empty.ply").write_bytes(header.replace(b"vertex 1", b"vertex 0") + end)
    code, _, err = run(capsys, "export", "empty.ply", "-o", "a.html", "--quiet")
    assert (code, names()) == (2, ["empty.ply"])
    assert err.count("\n") == 1
    Path("scene.ply").write_bytes(content)
    Path("link.html").symlink_to("scene.ply")
    assert "is the input" in run(capsys, "export", "scene.ply", "-o", "link.html", "--quiet")[2]
    assert Path("scene.ply").read_bytes() == content


def test_a_page_that_fails_leaves_the_earlier_one(monkeypatch):
    Path("a.html").write_text("earlier")
    seen = []

    def fails(*args, **options):
        seen.extend(names())
        raise OSError(28, "full")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_text", fails)
        with pytest.raises(bg.SceneError, match="cannot be written"):
            bg.save(some_strokes(5), "a.html", texture="flat", camera=CAMERA)
    assert len(seen) == 2  # a temporary one beside it
    assert names() == ["a.html"]
    assert Path("a.html").read_text() == "earlier"


def test_save_paints_a_page_as_render_paints_a_picture():
    strokes = some_strokes(80)
    options = {"num_sigmas": 1.4, "streaks": 0.05, "underpaint": True, "relief": True, "lock": "off"}
    bg.save(strokes, "a.html", texture="dab", camera=CAMERA, title="<i>", background="#000000", **options)
    header, arrays = read_page(Path("a.html"))
    (coat,) = header["coats"]
    assert (coat["numSigmas"], coat["streaks"], coat["lock"]) == ([1.4], 0.05, "off")
    assert header["lamp"]["strength"] == bg.Lamp().strength
    assert (header["title"], header["background"]) == ("<i>", [0, 0, 0])
    assert len(arrays["coat0.means"]) == 80
    bg.save(strokes, "b.html", texture="dab")
    header, _ = read_page(Path("b.html"))
    assert (header["title"], header["background"], header["lamp"]) == ("b", [1, 1, 1], None)


def test_save_refuses_a_page_without_strokes_or_brush():
    frame = bg.render(some_strokes(5), CAMERA, "flat")
    with pytest.raises(ValueError, match="a page needs Gaussians and a texture, got Frame"):
        bg.save(frame, "a.html", texture="flat")
    with pytest.raises(ValueError, match="texture=None"):
        bg.save(some_strokes(5), "a.html")
    with pytest.raises(ValueError, match=r"only a page \(.html\) or a model \(.glb\) has texture, got"):
        bg.save(frame, "a.png", texture="flat")
    with pytest.raises(ValueError, match="has camera, background, lock, got"):
        bg.save(frame, "a.png", camera=CAMERA, background="black", lock="off")
    assert names() == []


def test_a_device_that_would_suffer_is_named():
    light = Weight(4, 100.0, 100.0, 90, 100)
    assert warnings_of(light, 1_000_000) == []
    bare = 100 * HEADSET_FRAGMENTS
    heavy = Weight(4, bare + 1600.0, bare, 90, 100)
    assert heavy.moving == HEADSET_FRAGMENTS + 16 / UNDERPAINT_STEP**2 + 1
    (told,) = warnings_of(heavy, 1_000_000)
    assert "headset" in told
    assert "phone" not in told
    assert f"--underpaint off leaves {HEADSET_FRAGMENTS}" in told
    (told,) = warnings_of(light, PHONE_BYTES + 1)
    assert "phone" in told


def test_the_still_is_small_and_looks_like_the_painting():
    from brushgs.formats.pictures.images import read_image
    from brushgs.outlets.page.still import still_of

    rng = np.random.default_rng(0)
    noise = rng.uniform(0, 1, (720, 1280, 3)).astype(np.float32)
    content = still_of(bg.Frame(noise, np.ones((720, 1280), np.float32)), None)
    assert len(content) <= MOST_BYTES
    smooth = np.zeros((96, 200, 3), np.float32) + np.linspace(0, 1, 200, dtype=np.float32)[:, None]
    Path("a.jpg").write_bytes(still_of(bg.Frame(smooth, np.ones((96, 200), np.float32)), None))
    picture = read_image("a.jpg")
    assert picture.shape == (96, 200, 3)
    assert np.abs(picture - smooth).max() < 0.03
    Path("b.jpg").write_bytes(content)
    assert max(read_image("b.jpg").shape) == STILL_SIDE
