"""Which moment of a moving scene each frame of a film shows."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.pipeline.clip import Clip
from tests.kit.for_each import for_each

SECONDS = 2.0


def film(fps=None, num_frames=None, *, duration=SECONDS, **options):
    scene = bg.MovingScene(duration, has_rows=True, sample=lambda time: None)
    return Clip(scene, bg.ClipConfig(**options)).film(fps=fps, num_frames=num_frames)


def test_a_film_shows_all_of_the_scene_at_a_rate_and_a_speed_or_a_part_of_it():
    shown = film()
    assert (shown.fps, len(shown.times), shown.is_loop) == (30, 61, False)
    np.testing.assert_allclose(shown.times, np.arange(61) / 30)
    assert not shown.shares.any()
    np.testing.assert_array_equal(shown.moments, shown.times)
    np.testing.assert_allclose(film(fps=10).times, np.arange(21) / 10)
    np.testing.assert_allclose(film(fps=10, speed=2).times, np.arange(11) / 5)
    np.testing.assert_allclose(film(speed=0.5).times, np.arange(121) / 60)
    part = film(fps=10, start=bg.Moment(0.5), end=bg.Moment(0.5, is_share=True))
    np.testing.assert_allclose(part.times, [0.5, 0.6, 0.7, 0.8, 0.9, 1.0])
    assert film(start=bg.Moment(1), end=bg.Moment(1)).times.tolist() == [1.0]
    # A camera path decides how many frames there are.
    longer = film(fps=10, num_frames=30)
    assert longer.times[20:].tolist() == [2.0] * 10, "the scene rests at its end"
    np.testing.assert_allclose(film(fps=10, num_frames=4).times, [0, 0.1, 0.2, 0.3])


def test_there_and_back_repeats_no_frame_and_closes():
    loop = film(fps=10, loop=True)
    np.testing.assert_allclose(loop.times, [*np.arange(20) / 10, *(2 - np.arange(20) / 10)])
    assert loop.is_loop
    assert len(loop.moments) == 21, "what is seen twice is computed once"
    again = film(fps=10, loop=True, num_frames=80)
    assert again.is_loop
    np.testing.assert_array_equal(again.times[40:], loop.times)
    assert not film(fps=10, loop=True, num_frames=50).is_loop


def test_a_cross_fade_ends_where_the_film_begins():
    loop = film(fps=10, loop=True, cross_fade=0.5)
    assert loop.is_loop
    np.testing.assert_allclose(loop.times, 0.5 + np.arange(15) / 10)
    fading = loop.shares > 0
    np.testing.assert_allclose(loop.shares[fading], [0.2, 0.4, 0.6, 0.8], atol=1e-9)
    np.testing.assert_allclose(loop.others[fading], [0.1, 0.2, 0.3, 0.4], atol=1e-9)
    np.testing.assert_array_equal(loop.others[~fading], loop.times[~fading])


@for_each("num_frames", [None, 7, 15, 22, 30, 41])
@for_each("options", [{}, {"loop": True}, {"loop": True, "cross_fade": 0.5}])
def test_runs_hold_every_frame_and_have_no_jump(options, num_frames):
    shown = film(fps=10, num_frames=num_frames, **options)
    found = {}
    for run in shown.runs():
        assert np.abs(np.diff(run.times)).max(initial=0) <= 0.1 + 1e-9
        for k, (frame, time) in enumerate(zip(run.frames, run.times, strict=True)):
            assert (int(frame), k < run.num_fading) not in found
            found[int(frame), k < run.num_fading] = time
    expected = {(i, False): t for i, t in enumerate(shown.times)}
    expected |= {(i, True): t for i, t in enumerate(shown.others) if shown.shares[i] > 0}
    assert found == expected


def held(num=10, rate=24.0, num_frames=None, **options):
    """The film of numbered files, the last of which is shown as long as any other; times in moments."""
    times = np.arange(num) / rate
    scene = bg.MovingScene(num / rate, has_rows=False, sample=lambda time: None, times=times)
    shown = Clip(scene, bg.ClipConfig(**options)).film(num_frames=num_frames)
    return replace(shown, times=shown.times * rate, others=shown.others * rate)


def test_each_of_numbered_files_is_shown_as_long_as_any_other():
    np.testing.assert_allclose(held(fps=24).times, np.arange(10))
    shown = held(rate=1.0)
    np.testing.assert_allclose(shown.times, np.arange(300) / 30)
    assert held(rate=1.0, fps=30, speed=2).times[-1] == pytest.approx(10 - 1 / 15)
    assert [len(held(num, fps=30).times) for num in (1, 2, 24, 48)] == [1, 2, 30, 60]
    assert len(held(rate=1e6).times) == 1


def test_numbered_files_turn_at_the_last_moment_without_a_rest():
    loop = held(fps=24, loop=True)
    np.testing.assert_allclose(loop.times, [*range(10), *range(8, 0, -1)])
    assert loop.is_loop
    assert held(fps=24, loop=True, start=bg.Moment(0.95, is_share=True)).times.tolist() == [9.5]


@for_each(
    ("options", "message"),
    [
        ({"start": bg.Moment(3)}, "start must be in the 2 s of the scene, got 3 s"),
        ({"end": bg.Moment(2.5)}, "end must be in the 2 s of the scene, got 2.5 s"),
        ({"start": bg.Moment(1), "end": bg.Moment(0.5)}, "end must not be before start, got 0.5 s and 1 s"),
        ({"speed": 1e-4}, "at most 99,999 can be painted; show less of it, --end"),
        ({"loop": True, "cross_fade": 1.5}, "cross-fade must be at most half of the 2 s shown, got 1.5 s"),
        ({"loop": True, "cross_fade": 0}, "cross-fade must be above 0 seconds, got 0"),
        ({"cross_fade": 0.5}, "cross-fade needs loop"),
    ],
)
def test_what_cannot_be_shown_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        film(**options)
