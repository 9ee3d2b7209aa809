"""Boxes of films that are made by hand."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.hand import Pace
from brushgs.rendering import hand as hand_module
from brushgs.rendering.coat import Coat
from brushgs.rendering.drawn_anew import SIZE, TURN
from brushgs.rendering.hand import DAB, LAID_ASIDE, Hand, Rhythm, Seen
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.track import track_directions
from tests.kit import for_each, still_life_of
from tests.passes.scenes import gaussians_at

NUM_FRAMES, FPS = 24, 12
BRUSHES = bg.BrushSet.open(["flat", "flat_2", "dab"])
COLUMNS = ("centers", "half_extents", "angles", "depths", "colors", "opacities", "ids", "brushes")


def coat_of(strokes):
    """Strokes in two parts, left and right."""
    g = np.random.default_rng(0)
    brushes = g.integers(0, len(BRUSHES), len(strokes)).astype(np.uint8)
    strokes = replace(strokes, brushes=brushes, regions=(strokes.means[:, 0] > 0).astype(np.uint8))
    return Coat("strokes", strokes, BRUSHES, RenderOptions.of(BRUSHES, order="soft", lock="track"))


@pytest.fixture(scope="module")
def coat():
    return coat_of(bg.cluster(still_life_of(2000), 120))


@pytest.fixture(scope="module")
def seen(coat):
    return frames_of(coat, bg.orbit(coat.strokes, NUM_FRAMES, width=64, height=48))


def frames_of(coat, cameras):
    """Gives the coat in each frame."""
    track = track_directions(coat.strokes, [*cameras, cameras[0]])
    frames = [Seen(coat, camera, track.directions(index)) for index, camera in enumerate(cameras)]
    return frames.__getitem__


def hand(coat, *paces, every=3, is_loop=False, places=None, **options):
    """A film of these paces: of what is in no part, then of the parts."""
    rhythm = Rhythm.of(coat, paces, NUM_FRAMES / FPS, is_loop=is_loop, places=places)
    rhythms = {coat.name: rhythm}
    return Hand(paces, every, False, FPS, NUM_FRAMES, is_loop, rhythms, **options)


def same(boxes, others, columns=COLUMNS):
    return all(np.array_equal(getattr(boxes, name), getattr(others, name)) for name in columns)


def paired(boxes, others):
    """Rows of the strokes that both have."""
    return np.intersect1d(boxes.ids, others.ids, return_indices=True)[1:]


@for_each("hold", [2, 3])
def test_held_strokes_keep_their_drawing_and_move_with_the_scene(coat, seen, hold):
    film, steady = hand(coat, Pace(hold), Pace(hold)), hand(coat, Pace(), Pace())
    assert all(steady.boxes(index, seen) is seen(index).boxes for index in range(5))
    for index in range(hold):
        held, now = film.boxes(index, seen), seen(index).boxes
        first, i = paired(seen(0).boxes, held)
        kept = ("half_extents", "angles", "colors", "opacities", "brushes", "depths")
        assert all(
            np.array_equal(getattr(held, name)[i], getattr(seen(0).boxes, name)[first]) for name in kept
        )
        i, j = paired(held, now)
        assert np.abs(held.centers[i] - now.centers[j]).max() < 1e-3
    assert same(film.boxes(hold, seen), seen(hold).boxes)


def test_parts_are_held_at_their_own_rates_and_none_leaves_its_place(coat, seen):
    film = hand(coat, Pace(), Pace(3))
    boxes, now = film.boxes(2, seen), seen(2).boxes
    assert np.all(np.diff(boxes.depths) >= 0)
    assert len(np.unique(boxes.ids)) == len(boxes) >= len(now)
    i, j = paired(boxes, now)
    assert np.abs(boxes.centers[i] - now.centers[j]).max() < 1e-3
    is_held = coat.strokes.regions[boxes.ids[i]] == 1
    assert np.array_equal(boxes.angles[i][~is_held], now.angles[j][~is_held])
    assert not np.array_equal(boxes.angles[i][is_held], now.angles[j][is_held])


@for_each(("hold", "every", "numbers"), [(1, 3, [0, 0, 0, 1]), (2, 3, [0, 0, 0, 0, 1, 1])])
def test_what_boils_is_drawn_anew_at_whole_holds(coat, hold, every, numbers):
    pace = Pace(hold, 0.5)
    film = hand(coat, pace, pace, every=every)
    assert [film.drawing(film.starts(index)[0], pace) for index in range(len(numbers))] == numbers
    assert film.beat == len(numbers) - numbers.count(1)


def test_strokes_are_laid_over_the_old_ones_along_their_direction(coat, seen):
    film = hand(coat, Pace(redraw=2), Pace(redraw=2))
    boxes = film.boxes(5, seen)
    ids, counts = np.unique(boxes.ids, return_counts=True)
    assert counts.max() == 2
    assert set(ids) == set(seen(5).boxes.ids)
    new = np.flatnonzero(boxes.ids[1:] == boxes.ids[:-1])
    assert len(new) == (counts == 2).sum()
    assert np.all(boxes.depths[new] == boxes.depths[new + 1])
    assert np.all(boxes.half_extents[new, 0] > 0)
    as_seen = seen(5).boxes
    is_dab = as_seen.half_extents[:, 1] >= DAB * as_seen.half_extents[:, 0]
    assert 5 < is_dab.sum() < len(is_dab) - 5
    assert set(ids[counts == 2]).isdisjoint(as_seen.ids[is_dab]), (
        "what is hardly longer than wide comes whole"
    )


@for_each("wave", [False, True])
@for_each("rate", [0.5, 2.0])
def test_a_loop_closes_and_lays_as_much_as_was_asked_for(coat, seen, rate, wave):
    places = np.linspace(0, 1, len(coat.strokes)) if wave else None
    film = hand(coat, Pace(redraw=rate), Pace(redraw=rate), is_loop=True, places=places)
    for index in (0, 3):
        first, again = (film.boxes(at, lambda _: seen(0)) for at in (index, index + NUM_FRAMES))
        assert same(first, again)
    is_open = hand(coat, Pace(redraw=rate), Pace(redraw=rate), places=places)
    first, again = (is_open.boxes(at, lambda _: seen(0)) for at in (0, NUM_FRAMES))
    assert not same(first, again)  # what is asserted above is no matter of course
    # Strokes laid in the film, by area.
    scales = np.sort(coat.strokes.scales, axis=1)
    paint = scales[:, 1] * scales[:, 2] * coat.strokes.opacities
    rates = film.rhythms["strokes"].rates
    assert (rates * paint).sum() / paint.sum() == pytest.approx(rate, rel=0.35)


@for_each("blend", ["cover", "glaze"])
def test_transparent_paint_is_never_there_twice(coat, seen, blend):
    """What is left of the old stroke begins where the new one ends; paint that covers hides it longer."""
    glazed = replace(coat, blend=blend)
    boxes = hand(coat, *[Pace(redraw=2)] * 2).boxes(5, lambda k: replace(seen(k), coat=glazed))
    new = np.flatnonzero(boxes.ids[1:] == boxes.ids[:-1])
    lengths = boxes.half_extents[new, 0] + boxes.half_extents[new + 1, 0]
    row_of = {stroke: row for row, stroke in enumerate(seen(5).boxes.ids.tolist())}
    whole = seen(5).boxes.half_extents[[row_of[stroke] for stroke in boxes.ids[new].tolist()], 0]
    assert len(new) > 5
    assert (np.max(lengths / whole) < np.exp(SIZE * LAID_ASIDE) + 1e-5) == (blend == "glaze")


def test_what_moves_fast_trails_thinner_strokes_behind_it(coat, seen):
    film = hand(coat, Pace(), Pace(), smear=1.0, is_loop=True)
    boxes, now = film.boxes(4, seen), seen(4).boxes
    assert len(boxes) > len(now)
    i, j = paired(boxes, now)  # the first of each stroke is itself
    assert np.array_equal(boxes.centers[i], now.centers[j])
    assert same(film.boxes(4, lambda _: seen(4)), now)  # at rest


def turned(boxes, others):
    """[M] by how much each box is turned against the one of its stroke among others, radians."""
    row_of = np.zeros(boxes.ids.max() + 1, int)
    row_of[others.ids] = np.arange(len(others))
    steps = boxes.angles - others.angles[row_of[boxes.ids]]
    return np.abs((steps + np.pi) % (2 * np.pi) - np.pi)


def asked_for(pace):
    """By how much a pace turns strokes at most, radians, with the rounding of float32."""
    return TURN * (pace.boil**2 + LAID_ASIDE * (pace.redraw > 0)) + 1e-5


@for_each("pace", [Pace(2), Pace(3, 0.5), Pace(1, 0.3, 1.0), Pace(2, 1.0, 4.0)])
def test_strokes_turn_by_what_was_asked_for_and_no_more(coat, seen, pace):
    film = hand(coat, pace, pace)
    frames = range(0, 6, pace.hold)
    steps = [turned(film.boxes(k, seen), seen(film.starts(k)[0]).boxes) for k in frames]
    most = max(step.max() for step in steps)
    assert most <= asked_for(pace)
    assert most > asked_for(replace(pace, boil=0.8 * pace.boil, redraw=0.0)) or not (pace.boil or pace.redraw)


def sheet(columns=16, rows=12):
    """An upright sheet of paint, one stroke thick, on nothing."""
    g = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(-2, 2, columns), np.linspace(-1.5, 1.5, rows))
    count, angles = x.size, g.uniform(0, np.pi, x.size)
    means = np.stack([x.ravel(), y.ravel(), g.uniform(0, 0.1, count)], axis=1)
    quats = np.stack([np.cos(angles / 2), 0 * angles, 0 * angles, np.sin(angles / 2)], axis=1)
    return gaussians_at(means, (0.3, 0.15, 0.01), opacity=1, quats=quats, dtype=np.float32)


def test_no_paper_opens_where_parts_on_different_rates_meet(monkeypatch):
    """A gap is a pixel without paint that has it both where all parts are held and where none is."""
    coat, size = coat_of(sheet()), {"width": 64, "height": 48}
    ways = [(0.3 * index, 0.05 * index) for index in range(6)]  # 4 pixels a frame
    cameras = [bg.Camera.look_at((*way, -6), (*way, 0), fov_y=0.6, **size) for way in ways]
    seen = frames_of(coat, cameras)

    def painted(index, *holds):
        boxes = hand(coat, *(Pace(hold) for hold in holds)).boxes(index, seen)
        return bg.rasterize(boxes, BRUSHES, **size).alpha

    def gaps():
        """Largest share of the picture."""
        least = [np.minimum(painted(k, 1, 1), painted(k, 3, 3)) for k in range(6)]
        rates = [(1, 3), (3, 1), (2, 3)]
        return max(
            ((least[k] > 0.5) & (painted(k, *holds) < 0.25)).mean() for k in range(6) for holds in rates
        )

    assert gaps() == 0
    # Planted: what is held stays where it was in the picture.
    monkeypatch.setattr(hand_module, "projected", lambda coat, ids, camera: np.zeros((len(ids), 2)))
    assert gaps() > 0.005
