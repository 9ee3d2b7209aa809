"""The canvas of the page, its surfaces and its lamp, against those of the exact renderer."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import canvas as exact
from brushgs.rendering.light import BLUR, Lamp
from brushgs.rendering.relief import Relief, canvas_scale
from brushgs.rendering.surface import GRAIN, LINEN_HEIGHT, PAPER_HEIGHT, flat, linen, paper
from brushgs.still_life import still_life_camera
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from tests.chromium import blank_tab
from tests.outlets.page.easel import Easel
from tests.outlets.page.studio import hiding, painting_of
from tests.scenes import still_life_of

WIDTH, HEIGHT = 60, 45
CAMERA = Camera.look_at((0, 0, -6), (0, 0, 0), width=WIDTH, height=HEIGHT)
CLAY = (0.62, 0.5, 0.41)
SURFACES = {"flat": flat, "linen": linen, "paper": paper}
HEIGHTS = {"linen": LINEN_HEIGHT, "paper": PAPER_HEIGHT}
# Targets of half floats: colours near 1 are rounded by 1/4096, in each of some passes.
HALF = 0.002


@pytest.fixture(scope="module")
def easel(browser):
    with blank_tab(browser) as page:
        yield Easel(page)


@dataclass(frozen=True)
class Laid:
    """A coat that was painted already: a frame, and how it is laid."""

    frame: Frame
    blend: str = "cover"
    dry: float = 0.0
    tolerance: float | None = None
    hides: bool = False

    @property
    def facts(self):
        """As it stands in the header."""
        relief = None if self.frame.height is None else {"thickness": 1, "gain": 1}
        return {
            "blend": self.blend,
            "dry": self.dry,
            "tolerance": self.tolerance,
            "relief": relief,
            "isHiding": self.hides,
        }

    @property
    def planes(self):
        """Colour [H, W, 4] and detail [H, W, 2] as the page draws them."""
        frame, zeros = self.frame, np.zeros_like(self.frame.alpha)
        height = zeros if frame.height is None else frame.height
        depth = zeros if frame.depth is None else frame.depth * frame.alpha
        alpha = 1 - frame.alpha if self.blend == "glaze" else frame.alpha
        return np.dstack([frame.rgb, alpha]), np.dstack([height, depth])

    @property
    def for_exact(self):
        return SimpleNamespace(
            **dict.fromkeys(("texture", "options", "strokes")),
            effect=hiding if self.hides else None,
            is_flat=False,
            cut=None,
            **{name: getattr(self, name) for name in ("blend", "dry", "tolerance")},
        )


def paint(seed, *, has_depth=False, has_height=False, **laid):
    """Paint that covers, none to all of what lies below, thick in squares."""
    draw = np.random.default_rng(seed)
    alpha = np.clip(draw.uniform(-0.2, 1.2, (HEIGHT, WIDTH)), 0, 0.99).astype(np.float32)
    rgb = alpha[..., None] * draw.uniform(0, 1, (HEIGHT, WIDTH, 3)).astype(np.float32)
    depth = draw.uniform(-1, 1, (HEIGHT, WIDTH)).astype(np.float32)
    squares = np.kron(draw.uniform(0, 2, (HEIGHT // 5, WIDTH // 5)), np.ones((5, 5)))
    height = (alpha * squares).astype(np.float32)
    return Laid(Frame(rgb, alpha, depth if has_depth else None, height if has_height else None), **laid)


def glaze(seed, **laid):
    draw = np.random.default_rng(seed)
    alpha = np.clip(draw.uniform(-0.2, 1.2, (HEIGHT, WIDTH)), 0, 0.99).astype(np.float32)
    tint = draw.uniform(0.1, 1, (HEIGHT, WIDTH, 3)).astype(np.float32) ** alpha[..., None]
    return Laid(Frame(tint, alpha), blend="glaze", **laid)


@dataclass(frozen=True)
class Ground:
    kind: str
    color: object = CLAY
    strength: float = 4.0  # much, for the difference to be seen

    def facts(self):
        color = {"image": "ground"} if np.ndim(self.color) == 3 else {"color": list(self.color)}
        return {"kind": self.kind, "strength": self.strength, "seed": 0} | color

    @property
    def image(self):
        return np.rint(255 * self.color).astype(np.uint8) if np.ndim(self.color) == 3 else None

    def made(self):
        more = {} if self.kind == "flat" else {"strength": self.strength}
        return SURFACES[self.kind](self.color, height=HEIGHT, width=WIDTH, **more)


def header(laid, ground=None, lamp=None, *, background=None, is_transparent=False):
    shape = None if ground is None or ground.image is None else ground.image.shape
    return {
        "coats": [coat.facts for coat in laid],
        "surface": None if ground is None else ground.facts(),
        "background": background,
        "isTransparent": is_transparent,
        "lamp": None
        if lamp is None
        else {
            "direction": lamp.direction.tolist(),
            "halfWay": lamp.half_way.tolist(),
            "strength": lamp.strength,
            "gloss": lamp.gloss,
            "exponent": lamp.exponent,
            "blur": BLUR,
        },
        "arrays": {} if shape is None else {"ground": {"shape": shape}},
    }


class Exact:
    """What the exact renderer makes of coats that were painted already."""

    def __init__(self, monkeypatch, laid, surface=None, lamp=None, *, is_transparent=False):
        canvas = exact.Canvas(CAMERA, surface, is_transparent=is_transparent)
        given = (coat.frame for coat in laid)
        with monkeypatch.context() as patched:
            # The depth test is that of strokes, and has its own tests.
            patched.setattr("brushgs.rendering.depth_test.DepthTest.by_picture", lambda *_, **__: None)
            patched.setattr(exact, "rasterize_with", lambda *_, **__: _copied(next(given)))
            for coat in laid:
                canvas.lay(coat.for_exact, None)
        self.before = None if canvas._frame is None else _copied(canvas._frame)
        self.frame = canvas.finish(lamp)

    @property
    def rgba(self):
        return np.dstack([self.frame.rgb, self.frame.alpha])

    def over(self, color):
        return np.dstack([self.frame.over(color), np.ones((HEIGHT, WIDTH))])


def _copied(frame):
    return replace(
        frame,
        **{
            name: plane.copy() if isinstance(plane, np.ndarray) else plane
            for name, plane in vars(frame).items()
        },
    )


def painted(easel, laid, *given, ground=None, lamp=None, options=None, **facts):
    planes = [coat.planes for coat in laid]
    image = None if ground is None else ground.image
    facts = header(laid, ground, lamp, **facts)
    return easel.picture(facts, planes, width=WIDTH, height=HEIGHT, image=image, **(options or {}))


@pytest.mark.parametrize(("width", "height", "seed"), [(480, 360, 0), (360, 480, 7), (7, 5, 0)])
@pytest.mark.parametrize("kind", HEIGHTS)
def test_threads_and_bumps_are_those_of_the_exact_renderer(easel, kind, width, height, seed):
    page = easel.pattern(kind, width, height, seed=seed)
    exact = SURFACES[kind](CLAY, height=height, width=width, seed=seed)
    assert exact.height.any() or (kind, width) == ("linen", 7)
    np.testing.assert_allclose(
        page, exact.height / (HEIGHTS[kind] * canvas_scale(width, height)), atol=1e-3, rtol=0
    )
    np.testing.assert_allclose(np.clip(0.5 + GRAIN * page, 0, 1), exact.grain, atol=1e-3)


COVERS = {
    "one": [paint(0)],
    "two": [paint(0), paint(1)],
    "pressed": [paint(0), paint(1, dry=0.42)],
    "pressed first": [paint(0, dry=0.2), paint(1)],
    "glazed": [paint(0), glaze(1)],
    "glazed below": [glaze(0), paint(1)],
    "glazes": [glaze(0), glaze(1)],
    "pressed glaze": [glaze(0, dry=0.3), paint(1, dry=0.4), glaze(2)],
    "hidden": [paint(0), paint(1, hides=True), paint(2)],
}


@pytest.mark.parametrize(
    ("name", "kind"), [*((name, "paper") for name in COVERS), ("two", "flat"), ("pressed glaze", "flat")]
)
def test_coats_lie_on_each_other_and_on_the_ground(easel, monkeypatch, name, kind):
    laid, ground = COVERS[name], Ground(kind)
    page, _, _ = painted(easel, laid, ground=ground)
    exact = Exact(monkeypatch, laid, ground.made()).rgba
    assert np.abs(page - exact).max() < HALF


@pytest.mark.parametrize("name", COVERS)
def test_without_a_ground_they_are_transparent(easel, monkeypatch, name):
    laid = COVERS[name]
    alone, coarse = (
        Exact(monkeypatch, laid),
        Exact(monkeypatch, laid, Ground("paper").made(), is_transparent=True),
    )
    page, _, _ = painted(easel, laid)
    assert np.abs(page - alone.rgba).max() < HALF
    page, _, _ = painted(easel, laid, background=[0.2, 0.4, 0.9])
    assert np.abs(page - alone.over((0.2, 0.4, 0.9))).max() < HALF
    page, _, _ = painted(easel, laid, ground=Ground("paper"), is_transparent=True)
    assert np.abs(page - coarse.rgba).max() < HALF


LIT = {
    "thick": [paint(0, has_height=True)],
    "thick on thick": [paint(0, has_height=True), paint(1, has_height=True)],
    "thick, pressed": [paint(0, has_height=True), paint(1, has_height=True, dry=0.4)],
    "flat on thick": [paint(0, has_height=True), paint(1)],
    "thick on flat": [paint(0), paint(1, has_height=True)],
    "flat": [paint(0)],
    "thick, glazed": [paint(0, has_height=True), glaze(1, dry=0.2)],
    "tested": [
        paint(0, has_height=True, has_depth=True),
        paint(1, has_height=True, has_depth=True),
        paint(2, has_height=True, tolerance=1.6),
    ],
}
LAMP = Lamp(0.7, 0.6, strength=0.7, gloss=0.3, exponent=12)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        *((name, "paper") for name in LIT),
        *((name, kind) for name in ("thick on thick", "flat", "thick, glazed") for kind in ("flat", None)),
    ],
)
def test_a_lamp_shines_on_paint_and_canvas(easel, monkeypatch, name, kind):
    laid, ground = LIT[name], None if kind is None else Ground(kind)
    page, detail, _ = painted(easel, laid, ground=ground, lamp=LAMP)
    exact = Exact(monkeypatch, laid, None if ground is None else ground.made(), LAMP)
    # Steep edges of squares: slopes of up to 2 pixels a pixel, by heights that are rounded by 1/1024 pixel.
    assert np.abs(page - exact.rgba).max() < 0.008
    assert np.sqrt(np.mean((page - exact.rgba) ** 2)) < 5e-4
    if exact.before.height is not None and detail is not None:
        assert np.abs(detail[..., 0] - exact.before.height).max() < 0.005


def test_what_later_coats_are_tested_against_is_the_mean_depth(easel, monkeypatch):
    laid = [paint(0, has_depth=True), paint(1, has_depth=True, dry=0.4), paint(2, tolerance=1.6)]
    _, detail, _ = painted(easel, laid, ground=Ground("paper"))
    exact = Exact(monkeypatch, laid[:2], Ground("paper").made()).before
    assert np.abs(detail[..., 1] - exact.depth * exact.alpha).max() < HALF
    assert (exact.alpha > 0.5).mean() > 0.3


@pytest.mark.parametrize("kind", ["flat", "paper"])
def test_a_picture_as_ground_fills_the_page_and_is_cropped_to_its_centre(easel, monkeypatch, kind):
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    image = np.dstack([x / WIDTH, y / HEIGHT, 0.5 + 0.4 * np.sin(x / 9)]).astype(np.float32)
    image = np.rint(255 * image) / np.float32(255)
    page, _, _ = painted(easel, [paint(0)], ground=Ground(kind, image))
    exact = Exact(monkeypatch, [paint(0)], Ground(kind, image).made()).rgba
    assert np.abs(page - exact).max() < 0.004  # textures are read between texels to 1/256
    wide = np.concatenate([np.zeros_like(image), image, np.ones_like(image)], axis=1)
    page, _, _ = painted(easel, [paint(0)], ground=Ground(kind, wide))
    assert np.abs(page - exact)[:, 2:-2].max() < 0.004


@pytest.fixture(scope="module")
def lit_painting():
    texture = StrokeTexture.open("impasto")
    surface = paper(CLAY, width=160, height=120, strength=2)
    return painting_of(
        still_life_of(1000), texture, surface=surface, lamp=Lamp(), relief=Relief(), order="depth"
    )


def view(width, height):
    return still_life_camera(width=width, height=height)


def test_a_lost_context_comes_back(easel, lit_painting):
    easel.load(lit_painting, view(160, 120))
    first = easel.paint(view(160, 120), ground=True)
    easel.page.evaluate("""async () => {
      const { gl, painter } = studio, lose = gl.getExtension("WEBGL_lose_context");
      const told = (name) => new Promise((tell) => gl.canvas.addEventListener(name, (event) => {
        event.preventDefault();
        tell();
      }, { once: true }));
      const lost = told("webglcontextlost"), restored = told("webglcontextrestored");
      lose.loseContext();
      await lost;
      await new Promise((go) => setTimeout(go, 20)); // until the event is over
      lose.restoreContext();
      await restored;
      gl.getExtension("EXT_color_buffer_float");
      gl.getExtension("EXT_float_blend");
      painter.restore();
    }""")
    np.testing.assert_array_equal(easel.paint(view(160, 120), ground=True), first)


@pytest.fixture
def without(easel):
    """Has the browser lack extensions of which the names match."""

    def lack(pattern):
        easel.page.evaluate(
            """(pattern) => {
              const own = WebGL2RenderingContext.prototype.getExtension;
              studio.gl.getExtension = (name) =>
                new RegExp(pattern).test(name) ? null : own.call(studio.gl, name);
            }""",
            pattern,
        )

    yield lack
    easel.page.evaluate("() => { delete studio.gl.getExtension; }")


def test_a_browser_without_float_targets_paints_flat_and_says_so(easel, lit_painting, without):
    without("EXT_color_buffer")
    easel.load(lit_painting, view(160, 120))
    page = easel.paint(view(160, 120), ground=True)
    assert easel.page.evaluate("studio.painter.notes") == [
        "this browser cannot draw into float textures: the painting is shown without relief, lamp and threads"
    ]
    board = replace(lit_painting, surface=flat(CLAY, width=160, height=120), lamp=None)
    exact = board.frame(view(160, 120))
    assert np.sqrt(np.mean((page[..., :3] - exact.rgb) ** 2)) < 0.01


def test_half_floats_are_enough(easel, lit_painting, without):
    """As phones have them: the threads, too, are stored in halves."""
    easel.load(lit_painting, view(160, 120))
    usual = easel.paint(view(160, 120), ground=True)
    num_bytes = easel.page.evaluate("studio.painter.counts.targetBytes")
    without("EXT_color_buffer_float")
    easel.load(lit_painting, view(160, 120))
    halves = easel.paint(view(160, 120), ground=True)
    assert easel.page.evaluate("studio.painter.notes") == []
    assert easel.page.evaluate("studio.painter.counts.targetBytes") < num_bytes
    assert 0 < np.abs(halves - usual).max() < 0.002
