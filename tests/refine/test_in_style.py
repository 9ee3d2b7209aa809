"""`refine --style`: brushes, directions and sizes of a painting, then the steps; and files remember them."""

import shutil

import numpy as np
import pytest

from tests.kit import for_each, save_opaque, still_life_of

pytest.importorskip("torch", reason="needs the extra [refine]")
pytest.importorskip("kornia", reason="needs the extra [refine]")

import brushgs as bg
from brushgs import cli
from brushgs.cameras.framing import frame_scene
from brushgs.formats import read_scene
from brushgs.formats.styles import read_style, write_style
from brushgs.refine.painting_style import SIZE, open_style, painted
from tests.io.styles import example
from tests.kit.mark_paintings import paint

SMALL = ("--size", "64x48", "--views", "2", "--steps", "2", "--up", "-y", "--see", "off", "--quiet")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Folder with scene.ply, painting.png and what one run makes of them: out.ply and out.style."""
    folder = tmp_path_factory.mktemp("in_style")
    bg.save(still_life_of(1000), folder / "scene.ply")
    save_opaque(folder / "painting.png", paint("hatching", size=(240, 180)))
    assert refine(folder, folder / "out.ply") == 0
    return folder


def refine(folder, output, *options, style="painting.png", scene="scene.ply"):
    words = ["refine", folder / scene, "--style", folder / style, "-o", output, *SMALL, *options]
    return cli.main([str(word) for word in words])


def painted_with(path, *options):
    """Names of the brushes that a picture of a file is painted with, and the picture."""
    picture = path.with_suffix(".png")
    cheap = "--no-metadata", "--backdrop", "off", "--focus", "off", "--values", "0"  # what this is not about
    words = ["render", path, "-o", picture, "--size", "80x60", *cheap, *options, "--quiet"]
    assert cli.main([str(word) for word in words]) == 0
    return picture.read_bytes()


def test_strokes_name_brushes_that_were_cut_out_of_the_painting(folder):
    strokes, notes = read_scene(folder / "out.ply")
    style = read_style(folder / "out.style")
    assert notes.brushes == tuple(f"out.style:{row + 1}" for row in range(len(style.marks.brushes)))
    assert set(strokes.brushes) <= set(range(len(notes.brushes)))
    assert len(set(strokes.brushes)) > 1


def test_marks_run_as_in_the_painting_in_the_first_view(folder):
    strokes, notes = read_scene(folder / "out.ply")
    camera = frame_scene(notes.first_view, width=240, height=180)
    boxes = bg.project(strokes, camera)
    areas = boxes.half_extents.prod(axis=1) * boxes.opacities
    off = np.abs((boxes.angles + np.pi / 4 + np.pi / 2) % np.pi - np.pi / 2)
    assert np.average(np.degrees(off), weights=areas) < 37  # measured 32, hidden strokes too; by chance 45


def test_a_picture_of_the_file_is_painted_with_its_brushes(folder, tmp_path):
    for name in ("out.ply", "out.style"):
        shutil.copy(folder / name, tmp_path / name)  # from another folder than the current one
    with_own = painted_with(tmp_path / "out.ply")
    assert painted_with(tmp_path / "out.ply") == with_own
    assert painted_with(tmp_path / "out.ply", "--stroke", "dab") != with_own
    assert painted_with(tmp_path / "out.ply", "--look", "oil") != with_own
    names = ",".join(f"{tmp_path}/out.style:{row}" for row in (1, 2))
    assert painted_with(tmp_path / "out.ply", "--stroke", names) != with_own


def test_without_its_style_a_file_is_painted_in_the_look_and_says_so(folder, tmp_path, capsys):
    shutil.copy(folder / "out.ply", tmp_path / "out.ply")
    alone = painted_with(tmp_path / "out.ply")
    words = ["render", str(tmp_path / "out.ply"), "-o", str(tmp_path / "b.png"), "--size", "8x6"]
    assert cli.main(words) == 0
    assert "the brushes of its strokes cannot be opened (out.style" in capsys.readouterr().err
    assert painted_with(tmp_path / "out.ply", "--look", "oil") == alone


@for_each("how", [(), ("--palette", "painting.png")])
def test_outside_a_region_rows_of_a_file_of_strokes_stay_as_they_were(folder, tmp_path, how):
    """Places, rotations and colors bit for bit; sizes and opacities are written as logarithms once more."""
    path, how = tmp_path / "strokes.ply", [str(folder / word) if "." in word else word for word in how]
    assert cli.main(["cluster", str(folder / "scene.ply"), "--strokes", "150", "-o", str(path)]) == 0
    shutil.copy(path, folder / "strokes.ply")
    words = "--where", "half:1,0,0,0", *how
    assert refine(folder, tmp_path / "w.ply", *words, style="out.style", scene="strokes.ply") == 0
    before, after = bg.load(path), bg.load(tmp_path / "w.ply")

    def rows(strokes):
        return [row.tobytes() for row in np.hstack([strokes.means, strokes.quats, strokes.sh[:, 0]])]

    outside = before.means[:, 0] < -0.01
    assert 10 < outside.sum() < 140
    left = {row: number for number, row in enumerate(rows(after))}
    numbers = [left[row] for row in rows(before.take(outside))]
    np.testing.assert_allclose(after.scales[numbers], before.scales[outside], rtol=3e-6)
    np.testing.assert_allclose(after.opacities[numbers], before.opacities[outside], atol=1e-6)
    assert not set(rows(before.take(~outside))) <= set(left)


def test_a_style_file_does_without_its_painting(folder, tmp_path):
    assert refine(folder, tmp_path / "f.ply", style="out.style") == 0
    strokes, notes = read_scene(tmp_path / "f.ply")
    assert notes.brushes[0] == "f.style:1"
    assert (tmp_path / "f.style").read_bytes() == (folder / "out.style").read_bytes()
    assert refine(folder, tmp_path / "g.ply", style="out.style") == 0
    again = bg.load(tmp_path / "g.ply")
    for name in ("means", "quats", "scales", "sh", "brushes"):
        assert np.array_equal(getattr(again, name), getattr(strokes, name))


def test_the_style_of_an_edit_is_refused(folder, capsys):
    write_style(example.edit(), folder / "edit.style")
    assert refine(folder, folder / "e.ply", style="edit.style") == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "edit.style was learned from an edit" in error or "edit.style: was learned from an edit" in error
    assert not (folder / "e.ply").exists()


def test_a_painting_is_learnt_again_from_what_its_style_paints(folder, tmp_path):
    style = read_style(folder / "out.style")  # that of the painting
    learned, picture = style.marks, painted(style)
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    np.testing.assert_array_equal(picture, painted(style))
    mean = style.palette.weights @ np.clip(style.palette.samples, 0, 1)
    assert np.abs(picture.mean(axis=(0, 1)) - mean).max() < 0.08
    save_opaque(tmp_path / "again.png", picture)
    again = open_style(tmp_path / "again.png").style.marks
    assert again.length == pytest.approx(learned.length, rel=0.4)
    assert again.aspect > 0.5 * learned.aspect
