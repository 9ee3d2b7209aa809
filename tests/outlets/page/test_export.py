from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli.commands import export
from brushgs.cli.parser import parse
from brushgs.cli.words import words_of
from brushgs.formats.gltf_file import GlbWriter
from brushgs.formats.pictures.images import read_image
from brushgs.options.page import HEADSET_FRAGMENTS, PHONE_BYTES, UNDERPAINT_STEP
from brushgs.options.painting import PaintConfig
from brushgs.outlets.page.export import export_file
from brushgs.outlets.page.still import MOST_BYTES, STILL_SIDE, still_of
from brushgs.outlets.page.weight import Weight, warnings_of
from brushgs.pipeline import still
from tests.kit.commands import names, refused, run
from tests.kit.for_each import for_each
from tests.outlets.page.paintings import CAMERA, some_strokes
from tests.outlets.page.read import read_page
from tests.outlets.page.studio import camera_facts

# Without what takes most of the time of a small painting, and is no matter of files.
SMALL = ["--strokes", "150", "--size", "96x64", "--threads", "1", "--see", "off", "--focus", "off"]


pytestmark = pytest.mark.usefixtures("folder")


def test_export_names_its_output_and_says_what_it_costs(scene, capsys):
    code, out, err = run(capsys, "export", scene, "--look", "charcoal", *SMALL, "--verbose")
    assert (code, out, names()) == (0, "pears-charcoal.html\n", ["pears-charcoal.html"])
    for word in ("MB", "vertices", "fragments", "painted pixel"):
        assert word in " ".join(err.split())


def test_the_first_view_is_that_of_render_and_its_strokes_too(scene, monkeypatch):
    config = PaintConfig.of({"cluster": {"strokes": 100}, "view": {"size": (96, 64), "azimuth": 0.5}})
    caught, paint_view = [], still.paint_view

    def watched(painting, report, **options):
        caught.append(painting)
        return paint_view(painting, report, **options)

    monkeypatch.setattr(still, "paint_view", watched)
    still.paint_file(scene, "a.png", config)
    export_file(scene, "a.html", config)
    header, arrays = read_page(Path("a.html"))
    (prepared,) = caught
    assert header["camera"] == camera_facts(prepared.camera)
    strokes, origin = prepared.painting.coats[0].strokes, np.array(header["origin"])
    means = (strokes.means.astype(np.float64) - origin).astype(np.float32)
    assert sorted(map(tuple, arrays["coat0.means"].tolist())) == sorted(map(tuple, means.tolist()))
    assert (header["up"], header["title"]) == ([0, -1, 0], "pears")


def test_the_command_paints_the_same_strokes_without_the_view(scene, capsys):
    words = "export a.ply b.ply -o x.html --title T --look charcoal --azimuth -30 --palette=-odd.png"
    args = parse(f"{words} --chroma 0.5 --size=64x48 --quiet --threads 2".split())
    parser = export.ArgumentParser()
    export.add_flags(parser)
    kept = words_of(parser, args.words, export._paints)
    assert kept == ["--look", "charcoal", "--palette=-odd.png", "--chroma", "0.5"]
    assert vars(parse(["render", "a.ply", *kept]))["color.chroma"] == 0.5
    usual = ["--look", "plain", "--strokes", "150", "--see", "off", "--focus", "off"]
    for more, lock in (([], "canonical"), (["--lock", "anchor"], "anchor")):
        run(capsys, "export", scene, "-o", "a.html", "--look", "plain", *SMALL, *more)
        header, _ = read_page(Path("a.html"))
        assert header["command"] == {"scene": str(scene), "options": [*usual, *more]}
        assert {coat["lock"] for coat in header["coats"]} == {lock}


def test_bad_input_is_one_sentence_and_no_scene_is_replaced(scene, capsys):
    for words, said in (
        (["-o", "a.htm"], "output must end in .html"),
        (["-o", "a.html", "--address", "example.org"], "--address must begin with https:// or http://"),
        (["-o", "a.glb", "--caption", "x"], "--caption needs -o FILE.html"),
        (["-o", "a.html", "--for-view"], "--for-view needs -o FILE.glb"),
        (["--for-view"], "--for-view needs -o FILE.glb"),
        (["-o", "a.glb", "--stroke", "no_such"], "no_such"),
        (["-o", "a.html", "--zoom", "0"], "zoom"),
        (["-o", "a.html", "--lock", "track"], "lock"),
    ):
        assert said in refused(capsys, "export", scene, *words)
    assert names() == []
    bg.save(some_strokes(1), "scene.ply")
    content = Path("scene.ply").read_bytes()
    header, end, _ = content.partition(b"end_header\n")
    Path("empty.ply").write_bytes(header.replace(b"vertex 1", b"vertex 0") + end)
    refused(capsys, "export", "empty.ply", "-o", "a.html", "--quiet")
    for link in ("link.html", "link.glb"):
        Path(link).symlink_to("scene.ply")
        assert "is the input" in refused(capsys, "export", "scene.ply", "-o", link, "--quiet")
    assert Path("scene.ply").read_bytes() == content
    assert names() == ["empty.ply", "link.glb", "link.html", "scene.ply"]


@for_each(("name", "writer", "method"), [("a.html", Path, "write_text"), ("a.glb", GlbWriter, "write")])
def test_a_file_that_fails_leaves_the_earlier_one(name, writer, method):
    Path(name).write_text("earlier")

    def fails(*args, **options):
        assert len(names()) == 2  # a temporary one beside it
        raise OSError(28, "full")

    with patch.object(writer, method, fails), pytest.raises(bg.SceneError, match="cannot be written"):
        bg.save(some_strokes(5), name, texture="flat", camera=CAMERA)
    assert (names(), Path(name).read_text()) == ([name], "earlier")
    Path(name).unlink()


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
    noise = np.random.default_rng(0).uniform(0, 1, (720, 1280, 3)).astype(np.float32)
    smooth = np.zeros((96, 200, 3), np.float32) + np.linspace(0, 1, 200, dtype=np.float32)[:, None]
    pictures = []
    for rgb in (noise, smooth):
        Path("a.jpg").write_bytes(still_of(bg.Frame(rgb, np.ones(rgb.shape[:2], np.float32)), None))
        assert Path("a.jpg").stat().st_size <= MOST_BYTES
        pictures.append(read_image("a.jpg"))
    assert max(pictures[0].shape) == STILL_SIDE
    assert np.abs(pictures[1] - smooth).max() < 0.03
