"""Benchmarks can be imported, yardsticks paint what the definition paints, and aliasing figures hold."""

import shutil
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.likeness import rmse
from brushgs.rendering import reference
from brushgs.rendering.rasterize import RasterOptions
from brushgs.still_life import still_life_camera
from examples import benchmarks
from examples.benchmarks import numpy_painter, painterly, scanline, workloads
from tests.scenes import still_life_of

WIDTH, HEIGHT = 120, 90
CAMERA = workloads.camera(WIDTH, HEIGHT)
TEXTURE = bg.StrokeTexture.from_coverage(workloads.swirl(64))


@pytest.fixture(scope="module")
def boxes():
    return bg.project(workloads.strokes(250), CAMERA)


@pytest.fixture(scope="module")
def expected(boxes):
    return reference.rasterize(boxes, TEXTURE, RasterOptions(width=WIDTH, height=HEIGHT, filter="bilinear"))


def test_yardsticks_paint_the_definition_and_count_fragments(boxes, expected):
    size = {"width": WIDTH, "height": HEIGHT}
    rgb, transmittance, fragments = numpy_painter.paint(boxes, TEXTURE.coverage, **size, count=True)
    assert np.abs(rgb - expected.rgb).max() < 1e-4
    assert np.abs(1 - transmittance - expected.alpha).max() < 1e-4
    if shutil.which("g++") is not None:
        paint = scanline.load()
        one, three = (paint(boxes, TEXTURE.coverage, WIDTH, HEIGHT, n) for n in (1, 3))
        assert np.abs(one[0] - expected.rgb).max() < 1e-4
        assert np.abs(1 - one[1] - expected.alpha).max() < 1e-4
        assert all(np.array_equal(plane, other) for plane, other in zip(one, three, strict=True))
    # Every pixel of a box counts where nothing is ever finished.
    faint = numpy_painter.paint(boxes, np.ones_like(TEXTURE.coverage), **size, count=True)[2]
    areas = 4 * boxes.half_extents.prod(axis=1)
    assert faint > fragments
    assert faint == pytest.approx(areas.sum(), rel=0.1)  # some boxes reach over the edge of the picture


def test_every_benchmark_can_be_imported():
    """No other test runs them, so a name that moved would not show."""
    pytest.importorskip("torch", reason="needs the extra [refine]")
    (folder,) = map(Path, benchmarks.__path__)
    names = [path.stem for path in folder.glob("[!_]*.py")]
    assert len(names) > 20
    for name in names:
        assert import_module(f"examples.benchmarks.{name}").__doc__


def test_the_painterly_filter_resembles_its_picture_and_does_not_flicker_by_itself():
    """Figures of the sequences that are compared with it mean something only then."""
    camera = still_life_camera(width=96, height=72)
    frame = bg.render(still_life_of(5000), camera, bg.StrokeTexture.open("gaussian"), depth=False)
    plain = np.clip(frame.over((1, 1, 1)), 0, 1)
    texture = bg.StrokeTexture.open("dry_brush")
    one, two = (painterly.paint_image(plain, texture, num_strokes=1000, num_threads=n) for n in (1, 2))
    assert rmse(one.over((1, 1, 1)), plain) < 0.06  # measured: 25.1 dB
    assert one.rgb.tobytes() == two.rgb.tobytes()
    first, second = (
        painterly.image_boxes(picture, texture, num_strokes=300) for picture in (plain, plain[:, ::-1])
    )
    _, i, j = np.intersect1d(first.ids, second.ids, return_indices=True)
    assert 50 < len(i) < 300
    np.testing.assert_array_equal(first.centers[i], second.centers[j])
