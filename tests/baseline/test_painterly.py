import numpy as np
import pytest

import brushgs as bg
from brushgs.still_life import still_life_camera
from tests.baseline.painterly import ENOUGH, image_boxes, paint_image
from tests.scenes import still_life_of

WHITE = (1.0, 1.0, 1.0)
BRUSH = bg.StrokeTexture.open("dry_brush")


@pytest.fixture(scope="module")
def plain():
    camera = still_life_camera(width=96, height=72)
    frame = bg.render(still_life_of(20_000), camera, bg.StrokeTexture.open("gaussian"), depth=False)
    return np.clip(frame.over(WHITE), 0, 1)


def psnr(picture, truth):
    return -10 * np.log10(np.mean((np.clip(picture, 0, 1) - truth) ** 2))


def ramp(width=80, height=60, angle=0.0):
    """Grey that grows along a direction."""
    y, x = np.mgrid[:height, :width]
    along = np.cos(angle) * x + np.sin(angle) * y
    return np.repeat(((along - along.min()) / np.ptp(along))[..., None], 3, axis=2)


def test_the_painting_resembles_its_picture(plain):
    frame = paint_image(plain, BRUSH, num_strokes=1000)
    assert psnr(frame.over(WHITE), plain) > 24.5  # measured: 25.1 dB
    assert frame.rgb.dtype == np.float32
    assert frame.depth is None


def test_more_strokes_come_nearer(plain):
    few, many = (psnr(paint_image(plain, BRUSH, num_strokes=n).over(WHITE), plain) for n in (100, 2000))
    assert many > few + 3


def test_equal_input_gives_equal_bits_in_any_number_of_threads(plain):
    one = paint_image(plain, BRUSH, num_strokes=300, num_threads=1)
    two = paint_image(plain.copy(), BRUSH, num_strokes=300, num_threads=2)
    assert one.rgb.tobytes() == two.rgb.tobytes()
    assert one.alpha.tobytes() == two.alpha.tobytes()


def test_the_seed_moves_the_strokes(plain):
    first, second = (image_boxes(plain, BRUSH, num_strokes=300, seed=seed) for seed in (0, 1))
    assert not np.array_equal(first.centers, second.centers)


def test_the_number_of_strokes_is_met_where_there_is_enough_to_paint(plain):
    for count in (1, 7, 300, 1000):
        assert len(image_boxes(plain, BRUSH, num_strokes=count)) == count


def test_what_looks_like_the_ground_is_left_open():
    white = np.ones((40, 60, 3))
    assert len(image_boxes(white, BRUSH, num_strokes=50)) == 0
    assert not paint_image(white, BRUSH, num_strokes=50).alpha.any()
    assert len(image_boxes(white, BRUSH, num_strokes=50, background=(0, 0, 0))) > 0
    assert len(image_boxes(white - ENOUGH / 2, BRUSH, num_strokes=50)) == 0


def test_a_stroke_in_two_pictures_has_its_place_by_its_id(plain):
    """The grid does not flicker by itself: where the same cell is painted, it is the same place."""
    first, second = (image_boxes(picture, BRUSH, num_strokes=300) for picture in (plain, plain[:, ::-1]))
    _, i, j = np.intersect1d(first.ids, second.ids, return_indices=True)
    assert 50 < len(i) < 300
    np.testing.assert_array_equal(first.centers[i], second.centers[j])
    np.testing.assert_array_equal(first.half_extents[i], second.half_extents[j])


@pytest.mark.parametrize("degrees", [0, 30, 90, 135])
def test_strokes_run_across_the_gradient(degrees):
    boxes = image_boxes(ramp(angle=np.radians(degrees)), BRUSH, num_strokes=200)
    x, y = boxes.centers.T  # the border repeats the last pixel, which bends the gradient
    is_inside = (x > 12) & (x < 80 - 12) & (y > 12) & (y < 60 - 12)
    off = np.abs(np.remainder(boxes.angles - np.radians(degrees), np.pi) - np.pi / 2)
    assert np.count_nonzero(is_inside) > 30
    assert off[is_inside].max() < np.radians(1)
    assert (np.abs(boxes.angles) <= np.float32(np.pi / 2)).all()


def test_small_strokes_lie_over_large_ones(plain):
    boxes = image_boxes(plain, BRUSH, num_strokes=500)
    widths = boxes.half_extents[:, 1]
    assert (np.diff(widths) >= 0).all()  # nearest first: finest first
    assert len(np.unique(widths)) == 5


def test_a_plain_colour_has_no_direction_and_no_noise():
    boxes = image_boxes(np.full((30, 40, 3), 0.25), BRUSH, num_strokes=60)
    assert not boxes.angles.any()
    np.testing.assert_allclose(boxes.colors, 0.25, atol=1e-6)


@pytest.mark.parametrize("name", ["ellipse", "gaussian", "swirl", "x"])
def test_any_stroke_paints(plain, name):
    frame = paint_image(plain, bg.StrokeTexture.open(name), num_strokes=1000)
    assert psnr(frame.over(WHITE), plain) > 22.5  # measured: 23.3 dB and more


def test_a_picture_of_one_pixel_is_painted():
    frame = paint_image(np.zeros((1, 1, 3)), BRUSH, num_strokes=3)
    assert frame.alpha.shape == (1, 1)


@pytest.mark.parametrize(
    ("rgb", "options", "error", "match"),
    [
        (np.zeros((4, 4)), {}, ValueError, r"rgb must have shape \[H=4, W=4, 3\], got \[4, 4\]"),
        (np.zeros((4, 4, 3), np.uint8), {}, TypeError, "must be floating"),
        (np.zeros((0, 4, 3)), {}, ValueError, "must have pixels"),
        (np.full((4, 4, 3), np.nan), {}, ValueError, "must be finite, got 48"),
        (np.zeros((4, 4, 3)), {"num_strokes": 0}, ValueError, "num_strokes must be at least 1, got 0"),
        (np.zeros((4, 4, 3)), {"seed": -1}, ValueError, "seed must be 0 or more, got -1"),
        (np.zeros((4, 4, 3)), {"filter": "best"}, ValueError, "filter must be one of"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(rgb, options, error, match):
    with pytest.raises(error, match=match):
        paint_image(rgb, BRUSH, **{"num_strokes": 10} | options)
