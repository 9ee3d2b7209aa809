"""Paint on a frame, adopt it, and find it again in other paintings of the scene."""

import zipfile

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.marks import read_marks
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.pictures.layered import read_layer
from brushgs.outlets.adopt import paint_over
from tests.kit.regions import iou
from tests.scenes import save_upright, still_life_of

VIEW = ("--size", "320x240", "--see", "off", "--quiet")
RED = np.float32([0.9, 0.05, 0.05])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scene, its frame, a bar painted on it, and the marks of that."""
    folder = tmp_path_factory.mktemp("adopt")
    save_upright(still_life_of(3000), folder / "scene.ply")
    run(folder, "render", "scene.ply", *VIEW, "--strokes", "300", "-o", "frame.png", "--sidecar")
    alpha = np.zeros((240, 320), np.float32)
    alpha[80:160, 120:200] = 1
    write_frame(bg.Frame(alpha[..., None] * RED, alpha), folder / "layer.png")
    run(folder, "adopt", "layer.png", "--on", "frame.png", "scene.ply", "-o", "scene.marks", "--quiet")
    return folder


def run(folder, *words):
    found = [str(folder / word) if "." in word and not word.startswith("-") else word for word in words]
    assert main(found) == 0


def red(path) -> np.ndarray:
    """Pixels that are covered by half and more: the scene differs from the paint by 0.6 and more."""
    return np.abs(read_image(path)[..., :3] - RED).max(axis=2) < 0.3


@pytest.mark.parametrize("look", ["oil", "ink", "watercolour"])
def test_marks_stay_as_painted_in_other_looks_and_counts(folder, look):
    words = ("--strokes", "150", "--look", look, "--marks", "scene.marks", "-o", f"{look}.png")
    run(folder, "render", "scene.ply", *VIEW, *words)
    wanted = read_image(folder / "layer.png")[..., 3] > 0.5
    assert iou(red(folder / f"{look}.png"), wanted) >= 0.95


def test_what_is_not_painted_over_stays_as_it_was(folder):
    run(folder, "render", "scene.ply", *VIEW, "--strokes", "300", "--marks", "scene.marks", "-o", "with.png")
    away = np.abs(read_image(folder / "with.png") - read_image(folder / "frame.png")).max(axis=2)
    away[76:164, 116:204] = 0
    assert away.max() == 0


def test_a_frame_painted_over_gives_the_same_marks(folder):
    frame = read_image(folder / "frame.png")[..., :3].copy()
    frame[80:160, 120:200] = RED
    write_frame(bg.Frame(frame, np.ones(frame.shape[:2], np.float32)), folder / "over.png")
    run(folder, "adopt", "over.png", "--on", "frame.png", "scene.ply", "-o", "over.marks", "--quiet")
    first, second = (read_marks(folder / name).marks for name in ("scene.marks", "over.marks"))
    np.testing.assert_allclose(first.means, second.means, atol=0.05)


def test_films_show_marks(folder):
    path = ("--orbit", "12", "--sway", "10", "-o", "film_%02d.png")
    run(folder, "render", "scene.ply", *VIEW, "--strokes", "150", "--marks", "scene.marks", *path)
    areas = [red(path).sum() for path in sorted(folder.glob("film_*.png"))]
    assert len(areas) == 12
    assert min(areas) >= 0.7 * max(areas)
    steps = np.abs(np.diff(areas))
    assert steps.max() <= 0.12 * max(areas)  # none appears or leaves at once


@pytest.mark.parametrize("name", ["page.html", "model.glb"])
def test_pages_and_models_hold_strokes_for_marks(folder, name):
    words = ("export", "scene.ply", "--strokes", "150", "--see", "off", "--quiet")
    run(folder, *words, "-o", f"plain_{name}")
    run(folder, *words, "--marks", "scene.marks", "-o", name)
    assert (folder / name).read_bytes() != (folder / f"plain_{name}").read_bytes()


def test_erased_surfaces_stay_unpainted_whatever_the_count(folder):
    write_frame(bg.Frame(np.zeros((240, 320, 3)), np.zeros((240, 320))), folder / "no.png")
    words = ("no.png", "--on", "frame.png", "scene.ply", "--erase", "layer.png", "-o", "erased.marks")
    run(folder, "adopt", *words, "--quiet")
    region = np.s_[100:140, 140:180]
    for count in ("150", "400"):
        ends = ("--strokes", count, "--backdrop", "off")
        run(folder, "render", "scene.ply", *VIEW, *ends, "-o", "whole.png")
        run(folder, "render", "scene.ply", *VIEW, *ends, "--marks", "erased.marks", "-o", "less.png")
        whole, less = (read_image(folder / name)[..., :3] for name in ("whole.png", "less.png"))
        away = np.abs(whole - less).mean(axis=2)
        assert away[region].mean() > 3 * away[:, 260:].mean()


def test_layers_of_an_openraster_file_paint_and_erase(folder):
    stack = """<image w="320" h="240"><stack>
        <layer name="Erase" src="data/e.png" x="10" y="20" opacity="1"/>
        <layer name="other" src="data/e.png"/>
        <layer name="marks" src="data/m.png" x="0" y="0" opacity="0.5"/>
    </stack></image>"""
    small = np.ones((40, 60), np.float32)
    write_frame(bg.Frame(small[..., None] * RED, small), folder / "small.png")
    with zipfile.ZipFile(folder / "layer.ora", "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", stack)
        archive.write(folder / "layer.png", "data/m.png")
        archive.write(folder / "small.png", "data/e.png")
    paint, erased = (read_layer(folder / "layer.ora", name) for name in ("marks", "erase"))
    np.testing.assert_allclose(paint[..., 3], 0.5 * read_image(folder / "layer.png")[..., 3], atol=1e-6)
    assert (np.argwhere(erased[..., 3] > 0).min(axis=0) == (20, 10)).all()
    assert erased[..., 3].sum() == small.size
    assert read_layer(folder / "layer.ora", "none") is None
    run(folder, "adopt", "layer.ora", "--on", "frame.png", "scene.ply", "-o", "ora.marks", "--quiet")
    found = read_marks(folder / "ora.marks")
    assert len(found.marks) > 0
    assert len(found.erased) > 0
    (folder / "bad.ora").write_bytes((folder / "layer.ora").read_bytes()[:300])
    with pytest.raises(bg.SceneError, match="damaged zip archive"):
        read_layer(folder / "bad.ora", "marks")


BAD = {
    "an opaque picture": (("frame.png",), "has no transparency"),
    "another shape": (("tall.png", "--on", "frame.png"), "has 240x320 pixels"),
    "nothing": (("empty.png", "--on", "frame.png"), "holds no paint"),
    "no camera": (("lost.png",), "states no camera"),
}


@pytest.mark.parametrize("name", BAD)
def test_pictures_that_cannot_be_adopted_are_refused(folder, name, capsys):
    for file, shape in (("tall.png", (320, 240)), ("empty.png", (240, 320)), ("lost.png", (240, 320))):
        alpha = np.zeros(shape, np.float32)
        alpha[:9, :9] = file != "empty.png"
        write_frame(bg.Frame(alpha[..., None] * RED, alpha), folder / file)
    words, sentence = BAD[name]
    given = [str(folder / word) if word.endswith(".png") else word for word in words]
    assert main(["adopt", *given, str(folder / "scene.ply"), "-o", str(folder / "bad.marks"), "--quiet"]) == 2
    assert sentence in capsys.readouterr().err
    assert not (folder / "bad.marks").exists()


def test_paint_over_a_frame_has_soft_edges():
    g = np.random.default_rng(0)
    frame = np.ones((60, 80, 4), np.float32)
    frame[..., :3] = g.uniform(0.2, 0.8, (60, 80, 3))
    frame[:, :20] = 0  # transparent
    y, x = np.mgrid[:60, :80]
    alpha = np.clip(13 - np.hypot(x - 25, y - 30), 0, 1)[..., None].astype(np.float32)
    alpha += np.clip(1.4 - np.abs(y - 50), 0, 1)[..., None].astype(np.float32)  # a thin line
    total = alpha + (1 - alpha) * frame[..., 3:]
    over = (alpha * RED + (1 - alpha) * frame[..., 3:] * frame[..., :3]) / np.maximum(total, 1e-6)
    found = paint_over(np.concatenate([over, total], axis=2), frame)
    away = np.abs(found[..., 3:] - alpha)
    assert away[found[..., 3] > 0].max() <= 0.02
    assert away.max() <= 0.07  # so faint paint differs from the frame by no more than rounding
    assert np.abs(found[..., :3] - RED)[found[..., 3] > 0.02].max() <= 0.02
