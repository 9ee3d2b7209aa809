"""Paint on a frame, adopt it, and find it again in other paintings of the scene."""

import contextlib
import zipfile
from pathlib import Path

import numpy as np
import pytest

from brushgs.cli import main
from brushgs.errors import SceneError
from brushgs.formats.marks import read_marks
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.pictures.layers_read import read_layer
from brushgs.outlets.adopt import paint_over
from brushgs.values.frame import Frame
from tests.kit.commands import refused, save_opaque
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of

RED = np.float32([0.9, 0.05, 0.05])


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A scene, its frame, a bar painted on it, and the marks of that."""
    place = tmp_path_factory.mktemp("adopt")
    save_upright(still_life_of(3000), place / "scene.ply")
    alpha = np.zeros((120, 160), np.float32)
    alpha[40:80, 60:100] = 1
    with contextlib.chdir(place):
        render("--strokes", "300", "-o", "frame.png", "--sidecar")
        write_frame(Frame(alpha[..., None] * RED, alpha), "layer.png")
        adopt("layer.png", "-o", "scene.marks")
    return place


@pytest.fixture(autouse=True)
def current(place, monkeypatch):
    monkeypatch.chdir(place)


def render(*words):
    assert main(["render", "scene.ply", "--size", "160x120", "--quiet", *words]) == 0


def adopt(layer, *words):
    assert main(["adopt", layer, "--on", "frame.png", "scene.ply", "--quiet", *words]) == 0


def red(path) -> np.ndarray:
    """Pixels that are covered by half and more: the scene differs from the paint by 0.6 and more."""
    return np.abs(read_image(path)[..., :3] - RED).max(axis=2) < 0.3


@for_each("look", ["oil", "ink", "watercolour"])
def test_marks_stay_as_painted_in_other_looks_and_counts(look):
    render("--strokes", "150", "--look", look, "--marks", "scene.marks", "-o", f"{look}.png")
    wanted, found = read_image("layer.png")[..., 3] > 0.5, red(f"{look}.png")
    assert (found & wanted).sum() >= 0.95 * (found | wanted).sum()


def test_what_is_not_painted_over_stays_as_it_was():
    render("--strokes", "300", "--marks", "scene.marks", "-o", "with.png")
    away = np.abs(read_image("with.png") - read_image("frame.png")).max(axis=2)
    away[38:82, 58:102] = 0
    assert away.max() == 0


def test_a_frame_painted_over_gives_the_same_marks():
    frame = read_image("frame.png")[..., :3].copy()
    frame[40:80, 60:100] = RED
    save_opaque("over.png", frame)
    adopt("over.png", "-o", "over.marks")
    first, second = (read_marks(name).marks for name in ("scene.marks", "over.marks"))
    np.testing.assert_allclose(first.means, second.means, atol=0.05)


def test_films_show_marks():
    path = ("--orbit", "24", "--sway", "10", "-o", "film_%02d.png")
    render("--strokes", "150", "--see", "off", "--marks", "scene.marks", *path)
    areas = [red(path).sum() for path in sorted(Path().glob("film_*.png"))]
    assert len(areas) == 24
    assert min(areas) >= 0.7 * max(areas)
    assert np.abs(np.diff(areas)).max() <= 0.12 * max(areas)  # none appears or leaves at once


def test_pages_and_models_hold_strokes_for_marks():
    for name in ("page.html", "model.glb"):
        words = ["export", "scene.ply", "--strokes", "60", "--see", "off", "--quiet", "-o"]
        assert main([*words, f"plain_{name}"]) == 0
        assert main([*words, name, "--marks", "scene.marks"]) == 0
        assert Path(name).stat().st_size > Path(f"plain_{name}").stat().st_size


def test_erased_surfaces_stay_unpainted_whatever_the_count():
    write_frame(Frame(np.zeros((120, 160, 3), np.float32), np.zeros((120, 160), np.float32)), "no.png")
    adopt("no.png", "--erase", "layer.png", "-o", "erased.marks")
    for count in ("150", "400"):
        ends = ("--strokes", count, "--backdrop", "off")
        render(*ends, "-o", "whole.png")
        render(*ends, "--marks", "erased.marks", "-o", "less.png")
        whole, less = (read_image(name)[..., :3] for name in ("whole.png", "less.png"))
        away = np.abs(whole - less).mean(axis=2)
        assert away[50:70, 70:90].mean() > 3 * away[:, 130:].mean()


def test_layers_of_an_openraster_file_paint_and_erase():
    stack = """<image w="160" h="120"><stack>
        <layer name="Erase" src="data/e.png" x="10" y="20" opacity="1"/>
        <layer name="other" src="data/e.png"/>
        <layer name="marks" src="data/m.png" x="0" y="0" opacity="0.5"/>
    </stack></image>"""
    small = np.ones((20, 30), np.float32)
    write_frame(Frame(small[..., None] * RED, small), "small.png")
    with zipfile.ZipFile("layer.ora", "w") as archive:
        archive.writestr("mimetype", "image/openraster")
        archive.writestr("stack.xml", stack)
        archive.write("layer.png", "data/m.png")
        archive.write("small.png", "data/e.png")
    paint, erased = (read_layer("layer.ora", name) for name in ("marks", "erase"))
    np.testing.assert_allclose(paint[..., 3], 0.5 * read_image("layer.png")[..., 3], atol=1e-6)
    assert (np.argwhere(erased[..., 3] > 0).min(axis=0) == (20, 10)).all()
    assert erased[..., 3].sum() == small.size
    assert read_layer("layer.ora", "none") is None
    adopt("layer.ora", "-o", "ora.marks")
    found = read_marks("ora.marks")
    assert len(found.marks) > 0
    assert len(found.erased) > 0
    Path("bad.ora").write_bytes(Path("layer.ora").read_bytes()[:300])
    with pytest.raises(SceneError, match="damaged zip archive"):
        read_layer("bad.ora", "marks")


@for_each(
    ("words", "sentence"),
    [
        (("frame.png",), "has no transparency"),
        (("tall.png", "--on", "frame.png"), "has 120x160 pixels"),
        (("empty.png", "--on", "frame.png"), "holds no paint"),
        (("lost.png",), "states no camera"),
    ],
)
def test_pictures_that_cannot_be_adopted_are_refused(words, sentence, capsys):
    for file, shape in (("tall.png", (160, 120)), ("empty.png", (120, 160)), ("lost.png", (120, 160))):
        alpha = np.zeros(shape, np.float32)
        alpha[:9, :9] = file != "empty.png"
        write_frame(Frame(alpha[..., None] * RED, alpha), file)
    assert sentence in refused(capsys, "adopt", *words, "scene.ply", "-o", "bad.marks", "--quiet")
    assert not Path("bad.marks").exists()


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
