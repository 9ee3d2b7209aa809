"""Marks of a painted layer, on a ball whose surface is known exactly."""

import numpy as np
from scipy import ndimage

from brushgs.passes.marks.changes import cut_of
from brushgs.passes.marks.place import Below, erased_of_area, marks_of_paint
from brushgs.pipeline.overpaint import coats_of_marks
from brushgs.rendering.canvas import Painting
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from brushgs.values.marks import Marks
from tests.kit.for_each import for_each
from tests.kit.regions import iou
from tests.passes.scenes import gaussians_at, on_sphere

WIDTH, HEIGHT, DISTANCE = 240, 180, 4.0
WHITE = np.ones(3)
THICK = (((80, 60), (160, 100), 20.0, (0.8, 0.1, 0.1), 1.0), ((100, 120), (140, 110), 30.0, (1, 0.8, 0), 0.6))
THIN = (((90, 110), (150, 60), 3.0, (0.1, 0.1, 0.8), 1.0), ((90, 135), (140, 140), 1.5, (0, 0, 0), 1.0))
BESIDE = (((20, 40), (24, 150), 14.0, (0, 0.6, 0), 0.5),)


def camera(degrees: float = 0.0) -> Camera:
    turn = np.radians(degrees)
    eye = (DISTANCE * np.sin(turn), 0.0, -DISTANCE * np.cos(turn))
    return Camera.look_at(eye, (0, 0, 0), (0, -1, 0), fov_y=np.radians(40), width=WIDTH, height=HEIGHT)


def points(view: Camera) -> F64:
    """[H, W, 3] points of a ball of radius 1 that the pixels show, world axes; NaN beside it."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    rays = np.stack([x, y, np.ones_like(x)], axis=2) @ np.linalg.inv(view.K).T
    rays = rays @ view.viewmat[:3, :3]
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    along = -(rays @ view.position)
    with np.errstate(invalid="ignore"):
        distance = along - np.sqrt(along**2 - DISTANCE**2 + 1)
    return np.asarray(view.position + distance[..., None] * rays)


def plain(view: Camera) -> Frame:
    """The ball."""
    depth = np.nan_to_num(points(view) @ view.viewmat[2, :3] + view.viewmat[2, 3])
    return Frame(np.zeros((HEIGHT, WIDTH, 3)), (depth > 0) * 1.0, depth)


def layer_of(*lines) -> F64:
    """[H, W, 4] a layer with lines: from, to, width in pixels, color and opacity."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    layer = np.zeros((HEIGHT, WIDTH, 4))
    for start, end, width, color, opacity in lines:
        (x0, y0), span = start, np.subtract(end, start)
        share = np.clip(((x - x0) * span[0] + (y - y0) * span[1]) / (span @ span), 0, 1)
        away = np.hypot(x - x0 - share * span[0], y - y0 - share * span[1])
        alpha = (opacity * np.clip(width / 2 - away + 0.5, 0, 1))[..., None]
        total = alpha + (1 - alpha) * layer[..., 3:]
        mixed = alpha * color + (1 - alpha) * layer[..., 3:] * layer[..., :3]
        layer[..., :3] = np.divide(mixed, total, out=np.zeros_like(mixed), where=total > 0)
        layer[..., 3:] = total
    return layer


def as_seen(values: F64, view: Camera) -> F64:
    """Values [H, W] that lie on the ball, seen from another side."""
    local = points(view) @ camera().viewmat[:3, :3].T + camera().viewmat[:3, 3]
    image = np.nan_to_num(local @ camera().K.T, nan=-1)
    at = image[..., 1] / image[..., 2] - 0.5, image[..., 0] / image[..., 2] - 0.5
    return np.asarray(ndimage.map_coordinates(values, at, order=1))


NOTHING = gaussians_at(np.zeros((0, 3)), 1, dtype=np.float32)


def below() -> Below:
    return Below.of(camera(), plain(camera()), DISTANCE)


def drawn(marks: Marks, view: Camera) -> Frame:
    return Painting(tuple(coats_of_marks(marks, NOTHING))).frame(view)


def marks_of(layer: F64) -> Marks:
    found = marks_of_paint(layer, below())
    assert found is not None
    return found


@for_each("line", [*THICK, *BESIDE])
def test_thick_paint_keeps_its_area_in_the_view_it_was_painted_in(line):
    layer = layer_of(line)
    shown = drawn(marks_of(layer), camera())
    half = 0.5 * line[4]
    assert iou(shown.alpha > half, layer[..., 3] > half) >= 0.95


@for_each("line", THIN)
def test_thin_paint_keeps_its_outline(line):
    layer = layer_of(line)
    shown = drawn(marks_of(layer), camera()).alpha > 0.4
    wanted = layer[..., 3] > 0.4
    for one, other in ((wanted, shown), (shown, wanted)):
        outline = one & ~ndimage.binary_erosion(one)
        assert (ndimage.distance_transform_edt(~other)[outline] <= 1.5).mean() >= 0.95


def test_overlapping_and_translucent_paint_keeps_its_color():
    layer = layer_of(*THICK, *THIN, *BESIDE)
    shown = drawn(marks_of(layer), camera()).over(WHITE)
    wanted = layer[..., 3:] * layer[..., :3] + 1 - layer[..., 3:]
    away = np.linalg.norm(oklab_of(shown.astype(float)) - oklab_of(wanted), axis=2)
    assert away[layer[..., 3] > 0].mean() <= 0.02
    assert away[layer[..., 3] == 0].mean() <= 0.002


@for_each("degrees", [-20.0, 20.0])
def test_paint_stays_on_the_surface_in_views_beside(degrees):
    """Against the layer as seen on the ball itself, in the views beside."""
    layer, view = layer_of(*THICK), camera(degrees)
    shown = drawn(marks_of(layer), view)
    wanted = as_seen(layer[..., 3], view)
    assert iou(shown.alpha > 0.3, wanted > 0.3) >= 0.96
    assert np.abs(shown.alpha - wanted)[wanted > 0].mean() <= 0.03
    assert drawn(marks_of(layer), camera(180)).alpha.max() == 0  # nor is it seen from behind
    assert marks_of_paint(0 * layer, below()) is None
    assert erased_of_area(layer[..., 3] > 2, below()) is None


@for_each("degrees", [0, 20])
def test_strokes_are_cut_along_what_is_erased(degrees):
    """Against the area as seen on the ball itself; what lies behind the ball stays."""
    layer, here = layer_of(THICK[0]), camera(degrees)
    erased = erased_of_area(layer[..., 3] >= 0.5, below())
    means = on_sphere(2000)
    strokes = gaussians_at(means, 0.1, opacity=1)
    cut = cut_of(strokes, erased)
    share = cut.seen(here, plain(here))
    wanted = as_seen(layer[..., 3], here) >= 0.5
    assert (share > 0.5)[wanted].mean() >= 0.99
    assert not (share > 0.5)[~ndimage.binary_dilation(wanted, iterations=5)].any()
    assert cut.inside[cut.touching].any()
    assert not cut.touching[means @ camera().viewmat[2, :3] > 0.5].any()  # behind


@for_each("degrees", [-25, 0, 25])
def test_later_paint_lies_over_earlier_on_the_same_surface(degrees):
    red, blue = (0.9, 0, 0), (0, 0, 0.9)
    lines = ((70, 90), (170, 90), 24.0, red, 1.0), ((120, 50), (120, 130), 24.0, blue, 1.0)
    layers = [layer_of(line) for line in lines]
    crossing = (layers[0][..., 3] > 0.9) & (layers[1][..., 3] > 0.9)
    for first, second, color in ((*layers, blue), (*layers[::-1], red)):
        shown = drawn(marks_of(first) + marks_of(second), camera(degrees))
        here = ndimage.binary_erosion(as_seen(crossing.astype(float), camera(degrees)) > 0.99, iterations=2)
        assert np.abs(shown.rgb[here] - color).max() <= 0.03
