"""Flatness, coherence and continuity of marks: 0 without a defect, and more with each put in on purpose."""

from dataclasses import replace
from itertools import chain, repeat

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.flow import SceneFlow, displacements
from brushgs.measure.marks import MarkMeter, circular_earth_movers, earth_movers
from brushgs.measure.warp import View
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, grid

WIDTH, HEIGHT, FPS = 160, 120, 30.0
KERNEL = bg.StrokeTexture.open("gaussian")
STEPS = 8
SPEED = np.array([0.04, 0.01, 0.0])  # world units a frame: 1.3 pixels


def wall(shift=(0, 0, 0)):
    """A closed wall at z = 0."""
    means = grid(60, 3.0) + shift
    return gaussians_at(means, (0.08, 0.08, 0.008), opacity=0.95, dtype=np.float32)


def marks_on(shift=(0, 0, 0), num=150):
    """Slender strokes on that wall."""
    rng = np.random.default_rng(5)
    means = np.pad(rng.uniform((-1.6, -1.1), (1.2, 0.9), (num, 2)), ((0, 0), (0, 1))) + shift
    turns = rng.uniform(0, np.pi, num) / 2
    quats = np.stack([np.cos(turns), 0 * turns, 0 * turns, np.sin(turns)], axis=1)
    scales = np.tile([0.1, 0.03, 0.01], (num, 1)) * rng.uniform(0.7, 1.3, (num, 1))
    return gaussians_at(means, scales, quats=quats, dtype=np.float32)


def camera_at(distance=5.0, roll=0.0):
    up = np.sin(roll), -np.cos(roll), 0
    return bg.Camera.look_at((0, 0, -distance), (0, 0, 0), up, width=WIDTH, height=HEIGHT, fov_y=0.9)


def project(strokes, camera):
    return bg.project(strokes, camera, num_sigmas=2.0, low_pass=0)


def flows_of(shifts, cameras):
    flows = []
    for k in range(len(shifts) - 1):
        now, before = wall(shifts[k + 1]), wall(shifts[k])
        frame = bg.render(now, cameras[k + 1], KERNEL)
        view = View(frame.rgb, frame.depth, frame.alpha, cameras[k + 1])
        flows.append(SceneFlow(cameras[k], view, displacements(now, before.means, cameras[k + 1])))
    return flows


@pytest.fixture(scope="module")
def drift():
    """A wall that drifts before a camera at rest: boxes of the strokes on it, and the flow."""
    shifts = [k * SPEED for k in range(STEPS)]
    cameras = [camera_at()] * STEPS
    return [project(marks_on(s), c) for s, c in zip(shifts, cameras, strict=True)], flows_of(shifts, cameras)


def measure(boxes, flows, **options):
    meter = MarkMeter(width=WIDTH, height=HEIGHT, **options)
    for found, flow in zip(boxes, chain([None], flows, repeat(None)), strict=False):
        meter.add(found, flow)
    return meter.figures(FPS)


def renumbered(boxes, ids):
    rows = np.arange(len(boxes))
    return replace(boxes.take(rows), ids=np.asarray(ids, np.int32))


def with_opacities(boxes, factors):
    return replace(boxes, opacities=(boxes.opacities * factors).astype(np.float32))


def test_marks_that_move_with_the_scene_have_no_defect(drift):
    found = measure(*drift)
    assert found.slip_pixels < 0.01
    assert found.slip < 0.01
    assert (found.births, found.deaths, found.pops) == (0, 0, 0)
    assert found.size_drift < 1e-3
    assert found.direction_drift < 1e-3


def test_marks_pinned_to_the_screen_slip_by_the_flow(drift):
    boxes, flows = drift
    found = measure([boxes[0]] * STEPS, flows)
    focal = camera_at().K[0, 0]
    assert found.slip_pixels == pytest.approx(np.linalg.norm(SPEED) * focal / 5, rel=0.01)
    assert found.slip > 20 * measure(*drift).slip
    on_picture = measure([boxes[0]] * STEPS, flows, in_space=False)
    assert on_picture.slip_pixels == pytest.approx(found.slip_pixels, rel=0.01)
    assert (found.births, found.size_drift) == (0, 0)
    rng = np.random.default_rng(0)
    shuffled = [renumbered(frame, rng.permutation(frame.ids)) for frame in boxes]
    assert measure(shuffled, flows).slip_pixels > 10


def test_births_without_fades_are_counted_by_the_area_they_paint(drift):
    """In the middle a third of the marks is replaced by others at the same places."""
    boxes, flows = drift
    is_new = [frame.ids % 3 == 0 for frame in boxes]
    late = STEPS // 2
    abrupt = [
        renumbered(frame, np.where(new & (k >= late), frame.ids + 1000, frame.ids))
        for k, (frame, new) in enumerate(zip(boxes, is_new, strict=True))
    ]
    found = measure(abrupt, flows)
    painted = [frame.opacities * frame.half_extents.prod(1) for frame in boxes]
    share = sum(area[new].sum() for area, new in zip(painted, is_new, strict=True)) / np.sum(painted)
    seconds = (STEPS - 1) / FPS
    assert found.births == pytest.approx(share / seconds, rel=0.1)
    assert found.deaths == pytest.approx(found.births, rel=0.05)
    # The same births, over all frames: a mark is 1 / 8 there when it is first seen.
    faded = []
    for k, (frame, new) in enumerate(zip(boxes, is_new, strict=True)):
        faded.append(with_opacities(frame, np.where(new, (k + 1) / STEPS, 1)))
    gentle = measure([faded[0].take(~is_new[0]), *faded[1:]], flows)
    assert gentle.births < 0.4 * found.births
    assert gentle.pops == 0
    assert measure(boxes, flows).births == 0


def test_marks_that_flash_or_jump_in_size_pop(drift):
    boxes, flows = drift
    flashing = [with_opacities(frame, 0.5 if k % 2 else 1.0) for k, frame in enumerate(boxes)]
    sizes = [frame.half_extents * np.float32(1.2 if k % 2 else 1) for k, frame in enumerate(boxes)]
    pumping = [replace(frame, half_extents=size) for frame, size in zip(boxes, sizes, strict=True)]
    for defect in (flashing, pumping):
        assert measure(defect, flows).pops > 10  # nearly all, 30 times a second
    breathing = [with_opacities(frame, 1 - 0.1 * (k % 2)) for k, frame in enumerate(boxes)]
    assert measure(breathing, flows).pops == 0


def test_what_comes_nearer_grows_and_what_turns_turns():
    distances, rolls = np.linspace(5, 3.5, STEPS), np.linspace(0, 0.3, STEPS)
    still = [np.zeros(3)] * STEPS
    nearing = [camera_at(d) for d in distances]
    inner = marks_on().take(np.arange(150)[np.abs(marks_on().means[:, 0]) < 0.8])
    boxes = [project(inner, camera) for camera in nearing]
    flows = flows_of(still, nearing)
    found = measure(boxes, flows)
    assert found.size_drift == pytest.approx(np.log2(5 / distances[1:]).mean(), rel=0.05)
    assert found.slip_pixels < 0.01  # they stick, and so they grow
    kept = [replace(frame, half_extents=boxes[0].half_extents) for frame in (boxes[0],) * STEPS]
    assert measure(kept, flows).size_drift == 0
    assert measure(kept, flows).slip_pixels > 0.3  # they keep their size, and so they slip
    rolling = [camera_at(5.0, roll) for roll in rolls]
    turning = measure([project(inner, camera) for camera in rolling], flows_of(still, rolling))
    # Marks in all directions stay marks in all directions.
    assert turning.direction_drift < 0.1
    along = replace(inner, quats=np.tile(np.float32([1, 0, 0, 0]), (len(inner), 1)))
    turning = measure([project(along, camera) for camera in rolling], flows_of(still, rolling))
    assert turning.direction_drift == pytest.approx(rolls[1:].mean(), rel=0.02)


def test_marks_at_the_border_come_and_go(drift):
    boxes, flows = drift
    moved = [replace(frame, centers=frame.centers * np.float32(0.001) + np.float32(3)) for frame in boxes]
    new = [renumbered(frame, frame.ids + 1000 * k) for k, frame in enumerate(moved)]
    found = measure(new, flows)
    assert (found.births, found.deaths) == (0, 0)
    assert found.slip is None


def test_earth_movers_distance_by_hand():
    one, two = np.array([0.0, 1.0]), np.array([2.0])
    assert earth_movers(one, np.array([1.0, 3.0]), two, np.array([5.0])) == pytest.approx(0.25 * 2 + 0.75)
    assert earth_movers(one, np.ones(2), one[::-1], np.ones(2)) == 0
    assert earth_movers(one, np.zeros(2), two, np.ones(1)) == 0


@for_each("shift", [0.2, 1.0, 2.5])
def test_on_a_circle_the_shorter_way_counts(shift):
    rng = np.random.default_rng(2)
    many, weights = rng.uniform(0, 0.3, 50), rng.uniform(0.1, 1, 50)
    found = circular_earth_movers(many, weights, many + shift, weights, period=np.pi)
    assert found == pytest.approx(min(shift, np.pi - shift))
    assert earth_movers(many, weights, many + shift, weights) == pytest.approx(shift)


def test_what_cannot_be_measured_is_refused(drift):
    boxes, flows = drift
    with pytest.raises(ValueError, match=r"frames need \d+ flows"):
        measure(boxes, flows[:-1])
    with pytest.raises(ValueError, match="there must be a frame"):
        measure([], [])
    with pytest.raises(ValueError, match="must be > 0"):
        MarkMeter(width=0, height=3)
    with pytest.raises(ValueError, match="must be > 0"):
        MarkMeter(width=9, height=9).figures(0)
    alone = measure(boxes[:1], [])
    assert (alone.size_drift, alone.slip, alone.births) == (0, None, 0)
