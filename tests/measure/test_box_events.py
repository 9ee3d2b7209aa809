from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.box_events import off_axis_share, orientation_events, worst_shortfall
from tests.kit.for_each import for_each

SIZE = {"width": 200, "height": 100}


def whole_pixels(boxes):
    """Half extents rounded up to whole pixels, as the published method does."""
    return replace(boxes, half_extents=np.ceil(boxes.half_extents))


def boxes_of(angles, *, half_extents=(20.0, 5.0), opacities=0.8, center=(100.0, 50.0), ids=None):
    """Boxes on one spot, one per angle."""
    angles = np.atleast_1d(np.asarray(angles, float))
    num = len(angles)
    return bg.Boxes(
        np.broadcast_to(np.asarray(center, float), (num, 2)),
        np.broadcast_to(np.asarray(half_extents, float), (num, 2)),
        angles,
        np.arange(num, dtype=float),
        np.ones((num, 3)),
        np.broadcast_to(np.asarray(opacities, float), num),
        np.arange(num, dtype=np.int32) if ids is None else np.asarray(ids, np.int32),
    )


def covering(angle, ellipse):
    """The smallest boxes around the ellipses along other directions."""
    turn = angle - ellipse.angles
    a, b = ellipse.half_extents.T
    u, v = np.hypot(np.cos(turn) * a, np.sin(turn) * b), np.hypot(np.sin(turn) * a, np.cos(turn) * b)
    return replace(ellipse, angles=np.broadcast_to(angle, turn.shape), half_extents=np.stack([u, v], 1))


@for_each(
    ("degrees", "flips", "spins"),
    [(10, 0, 0), (16, 0, 1), (-80, 0, 1), (100, 1, 0), (180, 1, 0), (350, 0, 0)],
)
def test_steps_of_a_direction_are_wrapped_and_sorted_by_size(degrees, flips, spins):
    step = np.radians(degrees)
    # Matched by their numbers, in any order; one turns.
    first, second = boxes_of([0.3, 2.0], ids=[7, 3]), boxes_of([2.0, 0.3 + step], ids=[3, 7])
    events = orientation_events([first, second], **SIZE)
    assert (events.num_steps, events.stroke_frames, events.flips, events.spins) == (1, 2, flips, spins)
    assert events.largest_step == pytest.approx(abs(np.angle(np.exp(1j * step))))


def test_shares_are_weighted_by_painted_area():
    sides = [[20.0, 5.0], [10.0, 5.0]]
    first = boxes_of([0.0, 0.0], half_extents=sides, opacities=[0.5, 1.0])
    events = orientation_events([first, replace(first, angles=np.array([np.pi, 0.0]))], **SIZE)
    assert events.flip_share == pytest.approx(0.5)
    third = boxes_of([0.0, 0.0], half_extents=sides, opacities=[0.5, 0.5], center=(0.0, 50.0))
    turned = orientation_events([third, replace(third, angles=np.array([np.pi, 0.0]))], **SIZE)
    assert turned.flip_share == pytest.approx(2 / 3)  # both lie half outside


def test_a_box_that_turns_round_its_ellipse_pops_and_smooth_changes_of_shape_do_not():
    ellipse = boxes_of(0.2)
    held = [covering(0.2, ellipse), covering(0.2 + np.radians(12), ellipse)]
    events = orientation_events(held, ellipses=[ellipse, ellipse], **SIZE)
    assert (events.size_pops, events.kinks, events.spins, events.pop_share) == (1, 0, 0, 1)
    rng = np.random.default_rng(3)
    ellipses = [boxes_of(rng.uniform(-1, 1, 50), half_extents=rng.uniform(1, 300, 2)) for _ in range(20)]
    events = orientation_events(ellipses, ellipses=ellipses, **SIZE)
    assert (events.size_pops, events.kinks) == (0, 0)
    turned = [covering(e.angles + 0.01 * k, e) for k, e in enumerate(ellipses)]
    assert orientation_events(turned, ellipses=ellipses, **SIZE).kinks == 0


def test_sides_rounded_to_whole_pixels_kink_once_a_pixel_and_pop_where_small():
    ellipses = [boxes_of(0.0, half_extents=(20.3 + 0.1 * k, 2.95 + 0.02 * k)) for k in range(11)]
    rounded = [whole_pixels(frame) for frame in ellipses]
    events = orientation_events(rounded, ellipses=ellipses, **SIZE)
    assert events.kinks == 2  # 21 pixels are passed, and 3
    assert events.size_pops == 1  # 3 to 4 pixels wide, by a third in one step


def test_a_box_that_is_widened_evenly_does_not_kink():
    ellipse = boxes_of(0.3, half_extents=(60.0, 20.0))
    wide = [replace(ellipse, half_extents=ellipse.half_extents * 1.015 ** (k**2 / 8)) for k in range(9)]
    steps = np.diff([frame.half_extents[0, 0] for frame in wide])
    assert steps.max() > 1  # by more than a pixel a frame in the end
    assert np.diff(steps).max() < 0.5  # but smoothly
    assert orientation_events(wide, ellipses=[ellipse] * 9, **SIZE).kinks == 0


def test_strokes_that_come_or_go_inside_the_picture_count_by_opacity():
    both, one = boxes_of([0.0, 0.0], opacities=[0.8, 0.25]), boxes_of(0.0, opacities=0.8)
    events = orientation_events([both, one, both], **SIZE)
    assert (events.vanished, events.stroke_frames) == (pytest.approx(0.5), 2)
    at_border = boxes_of([0.0, 0.0], half_extents=(4.0, 4.0), center=(3.0, 50.0))
    assert orientation_events([at_border, boxes_of(0.0)], **SIZE).vanished == 0
    near = boxes_of([0.0, 0.0], half_extents=(1e4, 1e4), opacities=[0.0, 1.0])
    events = orientation_events([near, boxes_of(0.0)], **SIZE)
    assert events.vanished == 1
    assert events.vanished_share > 1  # the picture is lost; what stays is less than that


def test_no_frames_and_no_strokes_have_no_events_and_sequences_must_agree():
    for frames in ([], [boxes_of([])], [boxes_of([]), boxes_of([])]):
        events = orientation_events(frames, **SIZE)
        assert (events.stroke_frames, events.flips, events.flip_share, events.largest_step) == (0, 0, 0, 0)
    with pytest.raises(ValueError, match="size must be at least 1x1, got 0x4"):
        orientation_events([], width=0, height=4)
    with pytest.raises(ValueError, match="shorter"):
        orientation_events([boxes_of(0.0)], ellipses=[], **SIZE)


def test_only_slender_strokes_off_both_axes_count_as_off_axis():
    ellipses = boxes_of(np.zeros(4), half_extents=[(20, 5), (20, 5), (20, 5), (20, 15)])
    directions = np.radians([9.0, 95.0, -101.0, 45.0])
    assert off_axis_share([covering(directions, ellipses)], [ellipses]) == pytest.approx(1 / 3)
    assert off_axis_share([boxes_of(0.0, half_extents=(5, 5))], [boxes_of(0.0, half_extents=(5, 5))]) == 0


def test_a_box_that_cuts_its_ellipse_reports_by_how_much():
    ellipse = boxes_of([0.4, 0.4])
    whole = covering(np.array([0.0, 1.1]), ellipse)
    assert worst_shortfall([whole], [ellipse]) == pytest.approx(0, abs=1e-12)
    cut = replace(whole, half_extents=whole.half_extents * [[1, 1], [1, 0.9]])
    assert worst_shortfall([whole, cut], [ellipse, ellipse]) == pytest.approx(0.1)
    assert worst_shortfall([whole_pixels(ellipse)], [ellipse]) <= 0
