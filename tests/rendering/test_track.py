"""The lock: directions of strokes that are continuous in one view, and along a whole path."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import brushgs as bg
from brushgs.cameras.orbit import orbit
from brushgs.measure.box_events import off_axis_share, orientation_events, worst_shortfall
from brushgs.rendering import reference
from brushgs.rendering.canonical import fit_canonical
from brushgs.rendering.project import Directions, project
from brushgs.rendering.track import Track, track_directions
from brushgs.rendering.visibility import visible_areas
from tests.kit.for_each import for_each

SIZE = {"width": 160, "height": 120}
FRONT = bg.Camera.look_at((0, 0, -4), (0, 0, 0), **SIZE)
STEP = np.radians(1.5)


def strokes(n: int, *, seed: int = 0, dtype=np.float32) -> bg.Gaussians:
    """Needles, discs, blobs and boards of random sizes and directions in a ball."""
    g = np.random.default_rng(seed)
    shapes = np.array([(1, 0.05, 0.04), (1, 0.9, 0.02), (1, 0.95, 0.9), (1, 0.5, 0.1)])
    scales = shapes[np.arange(n) % 4] * np.exp(g.uniform(np.log(0.02), np.log(0.2), (n, 1)))
    means, quats = 0.4 * g.normal(size=(n, 3)), g.normal(size=(n, 4))
    scales, opacities = scales * g.uniform(0.7, 1, (n, 3)), g.uniform(0.3, 1, n)
    return bg.Gaussians(means, quats, scales, opacities, g.normal(size=(n, 1, 3))).astype(dtype)


def one(scale, *, mean=(0, 0, 0), quat=(1, 0, 0, 0)) -> bg.Gaussians:
    columns = ([mean], [quat], [scale], [1.0], np.zeros((1, 1, 3)))
    return bg.Gaussians(*(np.asarray(column, np.float64) for column in columns))


def turntable(num_frames, *, elevation=0.3, step=STEP, distance=4.0) -> list[bg.Camera]:
    """Views from a circle around the origin, `step` apart."""
    angles = step * np.arange(num_frames)
    across = distance * np.cos(elevation)
    down = 0 * angles - distance * np.sin(elevation)
    eyes = np.stack([across * np.sin(angles), down, -across * np.cos(angles)])
    return [bg.Camera.look_at(eye, (0, 0, 0), (0, -1, 0), **SIZE) for eye in eyes.T]


def closed(cameras: list[bg.Camera]) -> list[bg.Camera]:
    return [*cameras, cameras[0]]


def judged(scene: bg.Gaussians, cameras: list[bg.Camera], lock: str):
    """Events, the share of slender strokes off both axes, and by how much a box misses its ellipse."""
    ellipses = [project(scene, camera) for camera in cameras]
    alone = (project(scene, camera, lock=lock) for camera in cameras if lock != "track")
    boxes = list(bg.track(scene, cameras) if lock == "track" else alone)
    events = orientation_events(boxes, ellipses=ellipses, **SIZE)
    return events, off_axis_share(boxes, ellipses), worst_shortfall(boxes, ellipses)


def directions_of(path: Track) -> np.ndarray:
    return np.stack([path.directions(frame).angles for frame in range(len(path))])


def steps_of(angles: np.ndarray) -> np.ndarray:
    """Turn from frame to frame, 0 to pi."""
    return np.abs((np.diff(angles, axis=0) + np.pi) % (2 * np.pi) - np.pi)


def difference(first, second) -> np.ndarray:
    return np.abs((np.asarray(first) - second + np.pi) % (2 * np.pi) - np.pi)


# One view


def test_an_anchored_stroke_points_where_its_own_first_axis_points():
    """Also a disc that faces the camera. Without a lock what is vertical flips."""
    for scale in ((0.5, 0.01, 0.01), (0.3, 0.3, 0.01), (0.3, 0.3 * (1 - 1e-9), 0.3)):
        for angle in np.linspace(-3, 3, 13):
            stroke = one(scale, quat=(np.cos(angle / 2), 0, 0, np.sin(angle / 2)))
            assert difference(project(stroke, FRONT, lock="anchor").angles[0], angle) < 1e-6
    leans = [np.pi / 2 - 0.01, np.pi / 2 + 0.01]
    quats = [(np.cos(a / 2), 0, 0, np.sin(a / 2)) for a in leans]
    assert difference(*(project(one((0.5, 0.1, 0.1), quat=q), FRONT).angles[0] for q in quats)) > 3


@for_each("elevation", [0.0, 0.3, 1.2])
def test_anchored_strokes_flip_only_where_one_looks_along_their_axis(elevation):
    """And turn by no more than 15 degrees in a step of 1.5 where that axis is 10 degrees off the view."""
    num = 400
    scene, cameras = strokes(num, seed=7, dtype=np.float64), turntable(240, elevation=elevation)
    longest = reference.rotation_matrices(scene.quats)[np.arange(num), :, np.argmax(scene.scales, axis=1)]
    angles, is_free = [], []
    for camera in cameras:
        boxes = project(scene, camera, lock="anchor")
        assert len(boxes) == num
        angles.append(boxes.angles[np.argsort(boxes.ids)])
        toward = scene.means - camera.position
        cosine = (longest * toward).sum(axis=1) / np.linalg.norm(toward, axis=1)
        is_free.append(np.abs(cosine) < np.cos(np.radians(10)))
    steps, is_free = steps_of(np.array(angles)), np.array(is_free)
    unlocked = (project(scene, camera) for camera in cameras)
    unlocked = steps_of(np.array([boxes.angles[np.argsort(boxes.ids)] for boxes in unlocked]))
    assert (unlocked > np.pi / 2).sum() > 160
    assert steps[is_free[1:] & is_free[:-1]].max() < np.radians(15)


@given(st.integers(0, 2**31), st.integers(0, 3))
@settings(max_examples=30, deadline=None)
def test_a_box_covers_its_ellipse_in_any_direction(seed, kind):
    g = np.random.default_rng(seed)
    scene = strokes(40, seed=seed, dtype=np.float64)
    angles = g.uniform(-np.pi, np.pi, 40).astype(np.float32)
    area_scales = None if kind == 0 else g.uniform(1, 4, 40).astype(np.float32)
    boxes, ellipses = project(scene, FRONT, lock=Directions(angles, area_scales)), project(scene, FRONT)
    assert worst_shortfall([boxes], [ellipses]) < 1e-9
    if area_scales is not None:
        rows = np.argsort(boxes.ids)
        smallest = ellipses.half_extents.prod(axis=1)[np.argsort(ellipses.ids)]
        areas = boxes.half_extents.prod(axis=1)[rows]
        assert (areas >= smallest * area_scales[boxes.ids[rows]] * (1 - 1e-9)).all()


# Fading


def opacity_at(scene: bg.Gaussians, distance: float) -> float:
    camera = bg.Camera.look_at((0, 0, -distance), (0, 0, 0), **SIZE, near=1.0)
    boxes = project(scene, camera, fade=True)
    return float(boxes.opacities[0]) if len(boxes) else 0.0


@for_each(("scale", "nearest", "farthest"), [(0.1, 1.0, 10.0), (1.0, 1.0, 12.0), (300.0, 40.0, 4e3)])
def test_a_stroke_that_comes_near_fades_and_does_not_vanish_at_once(scale, nearest, farthest):
    """Small ones at the near plane, large ones where they would fill the picture many times over."""
    distances = np.geomspace(nearest, farthest, 1500)
    stroke = one((scale, scale, scale / 10))
    opacities = np.array([opacity_at(stroke, d) for d in distances])
    assert opacities[0] == 0
    assert opacities.max() > 0.7  # the smallest is hardly longer than a pixel, and shrinks
    assert (np.diff(opacities) >= -1e-3).all()
    assert np.diff(opacities).max() < 0.01  # 1/255, below which strokes are culled, and the step


def test_a_stroke_that_goes_far_away_fades_in_proportion_to_its_length():
    distances = np.geomspace(8, 1e6, 2500)
    stroke = one((0.5, 0.2, 0.1))
    opacities = np.array([opacity_at(stroke, d) for d in distances])
    assert opacities[0] > 0.98
    assert opacities[-1] == 0
    wide = project(one((1.2, 1.2, 0.1)), FRONT, fade=True)  # larger than the picture, and whole
    assert 4 * wide.half_extents.prod() > SIZE["width"] * SIZE["height"]
    assert wide.opacities[0] > 0.999
    assert (np.diff(opacities) <= 1e-12).all()
    assert np.abs(np.diff(opacities)).max() < 0.01
    pixels = 0.5 * FRONT.K[0, 0] / distances  # one standard deviation
    is_small = (pixels < 0.05) & (opacities > 0)
    np.testing.assert_allclose(opacities[is_small], pixels[is_small] / np.sqrt(0.3), rtol=0.01)


def test_the_plain_picture_neither_fades_nor_turns():
    """The built-in kernels are what 3D Gaussian Splatting draws."""
    scene, camera = strokes(300), bg.Camera.look_at((0, 0, -0.3), (0, 0, 0), **SIZE, near=0.2)
    texture = bg.StrokeTexture.open("gaussian")
    boxes = project(scene, camera, num_sigmas=3.0)
    plain = bg.rasterize(boxes, texture, **SIZE)
    for lock in ("anchor", "off"):
        np.testing.assert_array_equal(bg.render(scene, camera, texture, lock=lock).rgb, plain.rgb)
    (frame,) = bg.render_sequence(scene, [camera], texture)
    np.testing.assert_array_equal(frame.rgb, plain.rgb)


# Paths


# Degrees a frame, where tracking changes at 3.5 and 12.4 -> largest share of slender strokes off their axis.
# What no stroke may spend by spinning it spends there: measured on loops 0.15, 0.6, 1.8, 3.1 and 2.1 %.
COARSE = {3.0: 0.002, 3.6: 0.003, 7.5: 0.025, 10.0: 0.04, 15.0: 0.03}
# Cameras and number of strokes; of an open and a closed path, the largest step in degrees and that share.
PATHS = {
    "turntable": (turntable(240), 400, (6, 15), (1e-3, 0.02)),
    "level": (turntable(240, elevation=0.0), 400, (6, 15), (1e-3, 0.02)),
    "from above": (turntable(240, elevation=1.3), 400, (6, 15), (1e-3, 0.02)),
    "over the poles": (orbit(strokes(400), 240, **SIZE, over_poles=True), 400, (6, 15), (0.02, 0.02)),
}
for degrees, off in COARSE.items():
    views = turntable(round(360 / degrees), step=2 * np.pi / round(360 / degrees))
    most = 15 if degrees <= 10 else 30
    PATHS[f"{degrees} degrees a frame"] = views, 800, (most, most), (off, off)


@pytest.mark.parametrize("is_closed", [False, True])
@pytest.mark.parametrize("name", PATHS)
def test_a_tracked_path_has_no_flip_no_spin_no_pop_and_closes(name, is_closed):
    """Neither flips nor spins up to 10 degrees a frame; at 15 strokes turn by up to 29 degrees."""
    cameras, num, largest_steps, largest_shares = PATHS[name]
    scene, cameras = strokes(num), closed(cameras) if is_closed else cameras
    events, off_axis, miss = judged(scene, cameras, "track")
    unlocked, _, _ = judged(scene, cameras, "off")
    assert unlocked.flips + unlocked.spins > 250
    assert events.stroke_frames == unlocked.stroke_frames or name == "over the poles"
    assert (events.flips, events.size_pops) == (0, 0)
    assert events.spins == 0 or largest_steps[0] == 30
    assert np.degrees(events.largest_step) < largest_steps[is_closed]
    # A direction that merely stands still is no lock.
    assert off_axis <= largest_shares[is_closed]
    assert miss < 1e-5
    if is_closed:
        path = track_directions(scene, cameras)
        first, last = path.directions(0), path.directions(len(cameras) - 1)
        np.testing.assert_array_equal(first.angles, last.angles)
        np.testing.assert_array_equal(first.area_scales, last.area_scales)


def test_a_line_that_winds_by_half_a_turn_is_closed_where_it_costs_least():
    """Where the path passes between two views in which a board looks round, its line comes back turned."""
    g = np.random.default_rng(11)
    num = 500
    columns = np.zeros((num, 3)), g.normal(size=(num, 4)), np.tile((0.3, 0.2, 0.05), (num, 1)), np.ones(num)
    scene = bg.Gaussians(*(column.astype(np.float32) for column in (*columns, np.zeros((num, 1, 3)))))
    cameras = turntable(240)
    boxes = [project(scene, camera) for camera in closed(cameras)]
    lines = np.unwrap([one.angles[np.argsort(one.ids)] for one in boxes], axis=0, period=np.pi)
    half_turns = np.rint((lines[-1] - lines[0]) / np.pi)
    is_odd = half_turns % 2 == 1
    assert 50 < is_odd.sum() < 450
    angles = directions_of(track_directions(scene, closed(cameras)))
    np.testing.assert_array_equal(angles[0], angles[-1])
    assert np.degrees(steps_of(angles[:, ~is_odd]).max()) < 6
    assert 6 < np.degrees(steps_of(angles[:, is_odd]).max()) < 15


def test_the_frame_rate_does_not_change_the_story():
    """Frames at the same places of a path point the same way, whatever lies between them: up to 3 degrees."""
    scene = strokes(400)
    paths = {every: turntable(480 // every + 1, step=every * STEP / 4) for every in (1, 2, 4, 8)}
    rates = {every: directions_of(track_directions(scene, path)) for every, path in paths.items()}
    slow = rates[8]
    for every, angles in rates.items():
        off = difference(angles[:: 8 // every], slow)
        assert np.degrees(np.quantile(off, 0.999)) < 1, every
        assert np.degrees(off.max()) < 6, every


def test_films_point_as_stills_do_and_with_fields_even_more():
    """Of a closed path most of what is seen points the same way as in a picture of that view alone."""
    scene, cameras = strokes(400), closed(turntable(60, step=2 * np.pi / 60))
    ellipses, areas = [project(scene, c) for c in cameras], [visible_areas(scene, c) for c in cameras]
    fields = fit_canonical(scene)
    for own, most in ((None, 0.2), (fields, 0.04)):  # 0.14 without
        path, against = track_directions(scene, cameras, fields=own), 0.0
        boxes = [project(scene, camera, lock=path.directions(k)) for k, camera in enumerate(cameras)]
        events = orientation_events(boxes, ellipses=ellipses, **SIZE)
        assert (events.flips, events.spins, events.size_pops) == (0, 0, 0)
        for frame in range(0, 60, 5):
            lock = "anchor" if own is None else own.directions(scene, cameras[frame])
            alone = project(scene, cameras[frame], lock=lock)
            off = difference(path.directions(frame).angles[alone.ids], alone.angles)
            against += areas[frame][alone.ids][off > np.pi / 2].sum()
        assert against / sum(areas[frame].sum() for frame in range(0, 60, 5)) < most


def test_short_and_broken_paths_are_followed():
    """Too few knots for a half turn of a closed path: strokes that would need one stand still."""
    for cameras in ([FRONT], [FRONT] * 2, [FRONT] * 5):  # a camera that stands still moves nothing
        angles = directions_of(track_directions(strokes(100), cameras))
        assert angles.shape == (len(cameras), 100)
        np.testing.assert_array_equal(angles, np.broadcast_to(angles[0], angles.shape))
    for num_frames in (2, 3, 9):
        there = turntable(num_frames)
        angles = directions_of(track_directions(strokes(400), [*there, *there[-2::-1]]))
        np.testing.assert_array_equal(angles[0], angles[-1])
        assert np.degrees(steps_of(angles).max()) < 15
    cut = [*turntable(20), *turntable(20, elevation=-1.0, distance=9.0)]
    steps = np.degrees(steps_of(directions_of(track_directions(strokes(400), cut))))
    assert max(steps[:19].max(), steps[20:].max()) < 6.5
    passed = [bg.Camera.look_at((0, 0, z), (0, 0, z + 1), **SIZE) for z in np.linspace(-2, 2, 200)]
    assert np.degrees(steps_of(directions_of(track_directions(strokes(400), passed))).max()) < 15
    # Of half a path nothing swells where nothing turns across.
    assert track_directions(one((0.3, 0.1, 0.1)), turntable(20)).area_scales is None


def test_any_number_of_threads_gives_the_same_directions():
    scene, cameras = strokes(500), closed(turntable(60, step=2 * np.pi / 60))
    expected = track_directions(scene, cameras, num_threads=1)
    for num_threads in (2, 7):
        path = track_directions(scene, cameras, num_threads=num_threads)
        np.testing.assert_array_equal(path.turns, expected.turns)
        np.testing.assert_array_equal(path.area_scales, expected.area_scales)


# Sequences


def test_a_frame_of_a_sequence_is_the_frame_painted_alone():
    scene, cameras = strokes(300), turntable(8)
    texture = bg.StrokeTexture.open("dry_brush")
    frames = [frame.rgb.copy() for frame in bg.render_sequence(scene, cameras, texture)]
    path = track_directions(scene, cameras)
    tracked = list(bg.track(scene, cameras, num_sigmas=texture.fitted_sigmas, fade=True, order="soft"))
    for k in (5, 0, 7):
        alone = bg.render(scene, cameras[k], texture, lock=path.directions(k), order="soft")
        np.testing.assert_array_equal(alone.rgb, frames[k])
        np.testing.assert_array_equal(bg.rasterize(tracked[k], texture, **SIZE).rgb, frames[k])
    for lock in ("anchor", "off"):
        (first, *_) = bg.render_sequence(scene, cameras, texture, lock=lock, order="depth")
        np.testing.assert_array_equal(first.rgb, bg.render(scene, cameras[0], texture, lock=lock).rgb)


# Words


@for_each(
    ("call", "words"),
    [
        (lambda s: project(s, FRONT, lock="track"), "lock must be anchor, off or Directions, got 'track'"),
        (lambda s: project(s, FRONT, lock=Directions(np.float32([0] * 3))), "lock must hold 5 directions"),
        (lambda s: Directions(np.full(5, np.nan, np.float32)), "Directions: angles must be finite"),
        (lambda s: Directions(np.zeros(5, np.float32), np.zeros(5, np.float32)), "area_scales must be >= 1"),
        (lambda s: Directions(np.zeros(5, np.float32), np.ones(4, np.float32)), "Directions: "),
        (lambda s: Directions(np.zeros(5)), "Directions: angles must be a float32 array"),
        (lambda s: track_directions(s, turntable(3)).directions(3), "frame must be 0 to 2, got 3"),
        (lambda s: track_directions(s, []), "track: cameras must hold at least one, got none"),
        (lambda s: track_directions(s, [FRONT, FRONT.resized(80, 60)]), "track: cameras must have one size"),
        (lambda s: next(bg.render_sequence(s, [FRONT], "flat", lock="on")), "lock must be one of"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(call, words):
    with pytest.raises((ValueError, TypeError, IndexError), match=words):
        call(strokes(5))
