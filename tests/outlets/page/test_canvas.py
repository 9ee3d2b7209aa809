"""The canvas of the page, its surfaces and its lamp, against those of the exact renderer."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from brushgs.rendering.canvas import Painting
from brushgs.rendering.light import Lamp
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import flat, linen, paper
from tests.kit.for_each import for_each
from tests.outlets.page.paintings import some_coat
from tests.outlets.page.strokes import CAMERAS, hard_strokes

CAMERA = CAMERAS[0].resized(120, 90)
CLAY, BLUE = (0.62, 0.5, 0.41), (0.2, 0.4, 0.9)
SIZE = {"width": CAMERA.width, "height": CAMERA.height}
# Much, for a difference to be seen.
PAPER, LINEN = (make(CLAY, strength=4.0, **SIZE) for make in (paper, linen))
LAMP = Lamp(0.7, 0.6, strength=0.7, gloss=0.3, exponent=12)


def coat(seed, **options):
    strokes = hard_strokes(60, seed=seed, degree=0)
    return some_coat(strokes, "flat", f"coat {seed}", **options)


glaze, thick = partial(coat, blend="glaze"), partial(coat, relief=Relief(0.4, 1.2))
COATS = {
    "pressed": (coat(0), coat(1, dry=0.42)),
    "pressed first": (coat(0, dry=0.2), coat(1)),
    "glazed below": (glaze(0), coat(1)),
    "pressed glazes": (glaze(0, dry=0.3), coat(1, dry=0.4), glaze(2)),
    "thick on thick, pressed": (thick(0), thick(1, dry=0.4)),
    "flat on thick": (thick(0), coat(1)),
    "thick, glazed": (coat(0), thick(1), glaze(2, dry=0.2)),
    "tested": (thick(0), thick(1), thick(2, tolerance=0.5)),
    "tested glaze": (coat(0), glaze(1, tolerance=0.5)),
}
GROUNDS = {
    "paper": {"surface": PAPER},
    "lit paper": {"surface": PAPER, "lamp": LAMP},
    "lit linen": {"surface": LINEN, "lamp": LAMP},
    "lit board": {"surface": flat(CLAY, **SIZE), "lamp": LAMP},
    "nothing": {},
    "cut out": {"surface": PAPER, "is_transparent": True},
}
OTHERS = [ground for ground in GROUNDS if ground != "lit paper"]


def decibels(page, exact):
    return 10 * np.log10(1 / np.square(page.astype(float) - exact).mean())


def rgba(frame):
    return np.dstack([frame.rgb, frame.alpha])


@for_each(
    ("coats", "ground"),
    [
        *((coats, "lit paper") for coats in COATS),
        *((coats, ground) for coats in ("pressed glazes", "thick, glazed") for ground in OTHERS),
    ],
)
def test_coats_lie_on_each_other_and_on_the_ground_as_exactly(studio, coats, ground):
    painting = Painting(COATS[coats], **GROUNDS[ground])
    studio.load(painting, CAMERA)
    found = decibels(studio.paint(CAMERA, ground=True), rgba(painting.frame(CAMERA)))
    assert found > 50, (coats, ground, found)


def test_coats_share_programs_and_other_paintings_those_that_there_are(studio):
    count = "studio.painter._programs._made.size"
    numbers = []
    for coats in ((coat(0), coat(1, dry=0.2)), (coat(0), *(coat(seed, dry=0.4) for seed in (1, 2, 3)))):
        studio.load(Painting(coats, PAPER), CAMERA)
        studio.paint(CAMERA, ground=True)
        numbers.append(studio.page.evaluate(count))
    assert numbers[0] == numbers[1]
    shown = studio.paint(CAMERA, ground=True)
    studio.page.evaluate("studio.painter.replace(studio.painter.contents)")
    assert np.array_equal(studio.paint(CAMERA, ground=True), shown)
    assert studio.page.evaluate(count) == numbers[1]


def test_what_lies_behind_is_a_color_or_a_picture_that_is_cropped_to_its_centre(studio):
    painting = Painting(COATS["pressed"])
    studio.load(painting, CAMERA, background=BLUE)
    page = studio.paint(CAMERA, ground=True)
    assert decibels(page[..., :3], painting.frame(CAMERA).over(BLUE)) > 50
    y, x = np.mgrid[:90, :120] / 90
    image = np.dstack([x / 1.4, y, 0.5 + 0.4 * np.sin(9 * x)]).astype(np.float32)
    exact = painting.frame(CAMERA).over(image)
    for shown in (image, np.concatenate([np.zeros_like(image), image, np.ones_like(image)], axis=1)):
        studio.load(painting, CAMERA, background=shown)
        page = studio.paint(CAMERA, ground=True)
        assert decibels(page[:, 2:-2, :3], exact[:, 2:-2]) > 50


@pytest.fixture
def without(studio):
    """Has the browser lack extensions of which the names match."""

    def lack(pattern):
        studio.page.evaluate(
            """(pattern) => {
              const own = WebGL2RenderingContext.prototype.getExtension;
              studio.gl.getExtension = (name) =>
                new RegExp(pattern).test(name) ? null : own.call(studio.gl, name);
            }""",
            pattern,
        )

    yield lack
    studio.page.evaluate("() => { delete studio.gl.getExtension; }")


def test_half_floats_are_enough_and_without_float_targets_it_is_flat_and_says_so(studio, without):
    """As phones have them: the threads, too, are stored in halves."""
    painting = Painting(COATS["thick on thick, pressed"], PAPER, LAMP)
    pictures, sizes, notes = [], [], []
    for pattern in ("nothing", "EXT_color_buffer_float", "EXT_color_buffer"):
        without(pattern)
        studio.load(painting, CAMERA)
        pictures.append(studio.paint(CAMERA, ground=True))
        sizes.append(studio.page.evaluate("studio.painter.counts.targetBytes"))
        notes.append(studio.page.evaluate("studio.painter.notes"))
    assert 0 < np.abs(pictures[1] - pictures[0]).max() < 0.004
    assert sizes[1] < sizes[0]
    said = "this browser cannot draw into float textures: the painting is shown without relief, lamp and "
    assert notes == [[], [], [said + "threads"]]
    board = replace(painting, surface=flat(CLAY, **SIZE), lamp=None)
    assert decibels(pictures[2], rgba(board.frame(CAMERA))) > 40
