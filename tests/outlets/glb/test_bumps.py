"""Normal maps of brushes: what they say of heights, and how a program's lamp plays on them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.outlets.glb.write import Bump, write_quads
from brushgs.outlets.page.view import PageView
from brushgs.rendering.canvas import Painting
from brushgs.rendering.relief import Relief
from tests.kit.for_each import for_each
from tests.outlets.glb.glb import Glb
from tests.outlets.glb.rules import check_rules
from tests.outlets.glb.three import lit, page_of
from tests.outlets.page.paintings import some_coat, some_strokes
from tests.passes.scenes import gaussians_at

SIDE = 96  # pixels
CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=SIDE, height=SIDE)
VIEW = PageView(np.array([0.0, -1.0, 0.0]), np.zeros(3), 2.0, False)
# A lamp from each side of the picture: right, up, toward the eye.
LEFT, RIGHT, ABOVE, BELOW = (-1, 0, 1), (1, 0, 1), (0, 1, 1), (0, -1, 1)
LAMP = bg.Lamp(strength=0.5)
RELIEF = Relief(thickness=0.0, gain=1.7)


pytestmark = pytest.mark.usefixtures("folder")


def ridged(along=True, periods=3):
    """A full square brush whose height waves along u, or along v; and its slope in that direction."""
    wave = 2 * np.pi * periods * (np.arange(128) + 0.5) / 128
    height = np.tile(0.5 + 0.4 * np.sin(wave), (128, 1))
    height, slope = (one if along else one.T for one in (height, np.tile(np.cos(wave), (128, 1))))
    coverage = np.full((128, 128), 255, np.uint8)
    return bg.StrokeTexture("image", "ridged", coverage, height.astype(np.float32)), slope


def one_stroke():
    """A gray square before the camera, in the picture from corner to corner of its middle half."""
    return gaussians_at([(0, 0, 0)], (0.5, 0.4999, 0.001), opacity=1, dtype=np.float32)


def written(texture, lamp=LAMP, relief=RELIEF, strokes=None, **options):
    coat = some_coat(strokes or one_stroke(), texture, relief=relief, num_sigmas=2.0, **options)
    write_quads(Painting((coat,), lamp=lamp), CAMERA, "a.glb", view=VIEW, title="a")
    return Glb(Path("a.glb").read_bytes())


def test_a_map_says_which_way_and_how_steeply_the_paint_rises():
    """Red is against the slope along u, green against that upward: v runs down, as in pictures."""
    for along, channel, sign in ((True, 0, -1), (False, 1, 1)):
        texture, slope = ridged(along)
        normals = Bump(texture, RELIEF, np.array([64.0, 64.0])).normals() / 127.5 - 1
        assert np.corrcoef(normals[..., channel].ravel(), sign * slope.ravel())[0, 1] > 0.98
        assert np.abs(normals[..., 1 - channel]).max() < 0.01
        assert np.abs(np.linalg.norm(normals, axis=2) - 1).max() < 0.01
    texture, _ = ridged()
    # 3 periods, 0.4 x 1.7 px of height, where the blur takes less than 2 % of it.
    for side, tolerance in ((64, 0.06), (256, 0.24)):
        normals = Bump(texture, RELIEF, np.array([side, side], float)).normals() / 127.5 - 1
        steepest = np.abs(normals[..., 0] / normals[..., 2])[:, 20:108].max()
        assert steepest == pytest.approx(2 * np.pi * 3 * 0.4 * 1.7 / side, rel=tolerance)


def test_files_of_paint_in_relief_have_a_map_and_normals():
    high = replace(RELIEF, gain=17.0)
    glb = written("impasto", relief=high, strokes=some_strokes(40), underpaint=True)
    check_rules(glb)
    (material,) = glb.top["materials"]
    assert "extensions" not in material
    assert material["normalTexture"]["scale"] == 0.5
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx((2 / 42) ** 0.25)
    brushes, normals = glb.image(0), glb.image(1)
    assert normals.shape == (*brushes.shape[:2], 3)
    assert normals[0, 0].tolist() == [128, 128, 255]  # flat where there is no brush
    assert normals[..., 0].std() > 4


@for_each("along", [True, False])
def test_three_js_shades_the_ridges_by_the_side_of_the_lamp(along, open_page):
    """The difference of the pictures under two lamps follows the slope of the height; 0.985 was measured."""
    texture, slope = ridged(along)
    written(texture, bg.Lamp(strength=0.5, gloss=0.0), replace(RELIEF, gain=40.0))
    page_of("a.glb", "a.html", SIDE, SIDE)
    page = open_page(Path("a.html").resolve(), width=SIDE, height=SIDE)
    # Paint that rises to the right is lit from the left; paint that rises downward, from above.
    one, other = (lit(page, *lamp)[..., 1] for lamp in ((LEFT, RIGHT) if along else (ABOVE, BELOW)))
    seen = lit(page)[..., 1] > 0.3
    rows, columns = np.nonzero(seen)
    box = slice(rows.min() + 2, rows.max() - 1), slice(columns.min() + 2, columns.max() - 1)
    difference = (one - other)[box]
    height, width = difference.shape
    wanted = slope[np.linspace(4, 123, height).astype(int)][:, np.linspace(4, 123, width).astype(int)]
    assert height > 30
    assert width > 30
    assert difference.std() > 0.02
    assert np.corrcoef(difference.ravel(), wanted.ravel())[0, 1] > 0.9
