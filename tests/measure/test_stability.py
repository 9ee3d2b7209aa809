import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.measure import plotting
from brushgs.measure.box_events import off_axis_share, orientation_events, worst_shortfall
from brushgs.measure.stability import Comparison, StabilityReport, measure, measure_stability
from brushgs.measure.stability.measure import advice
from brushgs.measure.stability.painters import all_painters
from brushgs.measure.stability.run import write_plot
from brushgs.measure.stability.table import stability_table
from brushgs.measure.warp import View
from brushgs.options.experiments import StabilityConfig
from brushgs.rendering.options import RenderOptions
from tests.kit.commands import names, refused, run
from tests.measure.warped import warp_error
from tests.passes.scenes import gaussians_at
from tests.scenes import still_life_of

WHITE = (1.0, 1.0, 1.0)
WIDTH, HEIGHT = 48, 36
KERNEL = bg.StrokeTexture.open("gaussian")
BRUSH = bg.StrokeTexture.open("dry_brush")
NAMES = ["track", "anchor", "off", "published", "plain"]
LASTING = NAMES[:4]


def comparison_of(scene, strokes, cameras):
    options = RenderOptions.of(BRUSH, order="soft")
    return Comparison(scene, strokes, cameras, BRUSH, options, WHITE)


def swing(num_views):
    """Views from a small circle before the still life: steps of some 2 degrees."""
    cameras = []
    for angle in np.arange(num_views) * 2 * np.pi / num_views:
        eye = 1.2 + 0.5 * np.cos(angle), -3.35 + 0.5 * np.sin(angle), -10.2
        size = {"width": WIDTH, "height": HEIGHT}
        cameras.append(bg.Camera.look_at(eye, (0.12, -1.42, 0.2), fov_y=np.radians(29), **size))
    return cameras


@pytest.fixture(scope="module")
def comparison():
    """The still life from 8 places, closed."""
    scene = still_life_of(4000)
    cameras = swing(8)
    return comparison_of(scene, bg.cluster(bg.prune(scene), 300), [*cameras, cameras[0]])


@pytest.fixture(scope="module")
def result(comparison):
    return measure_stability(comparison, StabilityConfig(alone=2))


def unlocked(comparison, sigmas, *, fade):
    strokes = comparison.strokes
    return [bg.project(strokes, camera, num_sigmas=sigmas, fade=fade) for camera in comparison.cameras]


def test_every_configuration_has_its_figures(result):
    assert [figures.name for figures in result.configurations] == NAMES
    assert (result.num_frames, result.is_closed) == (9, True)
    for figures in result.configurations:
        # 10 is longer than the path.
        assert [(warp.gap, warp.pairs) for warp in figures.warps] == [(1, 8), (7, 2)]
        assert len(figures.errors) == len(result.starts) == 8
        assert (figures.events is not None) == (figures.name in LASTING)
        assert all(warp.valid_share > 0.4 for warp in figures.warps)  # measured: 0.42
        assert figures.seconds.draw > 0
        assert (figures.alone, figures.alone_equal) == (2, 2)
        assert figures.loop.largest < 1e-4, figures.name  # 0 measured
        if figures.name != "plain":
            assert all(warp.marks > 0 and 0 < warp.redrawn < 1.5 for warp in figures.warps)
    for warp in result["plain"].warps:
        assert warp.rmse > 0
        assert (warp.excess, warp.excess_worst_1pct, warp.marks, warp.redrawn) == (0, 0, 0, None)
    assert result["plain"].turning.excess == 0


def test_directions_are_what_the_metrics_say_of_the_boxes(comparison, result):
    for name, sigmas in (("off", BRUSH.fitted_sigmas), ("published", BRUSH.num_sigmas)):
        boxes = unlocked(comparison, sigmas, fade=name == "off")
        assert result[name].events == orientation_events(boxes, width=WIDTH, height=HEIGHT, ellipses=boxes)
        assert result[name].off_axis_share == off_axis_share(boxes, boxes) == 0
        assert result[name].shortfall == worst_shortfall(boxes, boxes)
    assert result["off"].events.flips > 0


def test_flicker_is_what_the_metrics_say_of_the_pictures(comparison, result):
    """Of the published configuration, drawn here by the public functions alone."""
    plain = [bg.render(comparison.scene, camera, KERNEL) for camera in comparison.cameras]
    how = {"height": HEIGHT, "width": WIDTH, "filter": "bilinear"}
    painted = [bg.rasterize(boxes, BRUSH, **how) for boxes in unlocked(comparison, 2.0, fade=False)]
    for gap, warp, of_plain in zip((1, 7), result["published"].warps, result["plain"].warps, strict=True):
        errors = []
        for frames in (painted, plain):
            views = [
                View(np.clip(frame.over(WHITE), 0, 1), seen.depth, seen.alpha, camera)
                for frame, seen, camera in zip(frames, plain, comparison.cameras, strict=True)
            ]
            pairs = zip(views[:-gap], views[gap:], strict=True)
            errors.append([warp_error(first, second) for first, second in pairs])
        own, ground = (np.array([(e.rmse, e.worst_1pct, e.valid_share) for e in row]) for row in errors)
        found = warp.rmse, warp.worst_1pct, warp.valid_share
        np.testing.assert_allclose(found, own.mean(axis=0), rtol=1e-6)
        np.testing.assert_allclose(of_plain.rmse, ground[:, 0].mean(), rtol=1e-6)
        np.testing.assert_allclose(warp.excess, (own - ground)[:, 0].mean(), rtol=1e-6)
        np.testing.assert_allclose(warp.excess_worst_1pct, (own - ground)[:, 1].mean(), rtol=1e-6)
        if gap == 1:
            np.testing.assert_allclose(result["published"].errors, own[:, 0], rtol=1e-6)


def test_configurations_paint_what_the_public_functions_paint_in_the_configured_order(comparison):
    hard = replace(comparison, options=replace(comparison.options, order="depth"))
    painters, by_depth = (all_painters(each, None) for each in (comparison, hard))
    for order, made, count in (("soft", painters, 9), ("depth", by_depth, 1)):
        tracked = bg.render_sequence(comparison.strokes, comparison.cameras, BRUSH, order=order, depth=False)
        for index, frame in zip(range(count), tracked, strict=False):
            assert np.array_equal(made["track"].paint(index).rgb, frame.rgb)
    for name in LASTING:
        painted, other = painters[name].paint(3).rgb, by_depth[name].paint(3).rgb
        assert np.array_equal(painted, other) == (name == "published")
        if name in ("anchor", "off"):
            options = {"lock": name, "order": "soft", "depth": False}
            frame = bg.render(comparison.strokes, comparison.cameras[3], BRUSH, **options)
            assert np.array_equal(painted, frame.rgb)


def test_a_kernel_has_no_direction_to_track_and_no_lock_to_advise(comparison):
    options = RenderOptions.of(KERNEL, order="soft")
    with_kernel = replace(comparison, texture=KERNEL, options=options, cameras=comparison.cameras[:2])
    painters = all_painters(with_kernel, None)
    frame = bg.render(comparison.strokes, comparison.cameras[0], KERNEL, depth=False)
    for name in ("track", "anchor", "off"):
        assert np.array_equal(painters[name].paint(0).rgb, frame.rgb)
    assert painters["track"].timer.track.seconds == 0
    found = measure_stability(with_kernel, StabilityConfig(alone=0))
    assert found.advice == advice(found)
    assert found.advice.startswith("for this path every lock draws the same strokes")


def test_fewer_pairs_are_some_of_all_pairs(comparison, result):
    """And only their frames are painted."""
    config = StabilityConfig(gaps=(1, 2), pairs=2, alone=0)
    painted = []
    some = measure_stability(comparison, config, advance=lambda: painted.append(1))
    assert (some.stride, some.starts) == (4, (0, 4))
    assert len(painted) == measure.num_painted_frames(comparison, config) == 7  # 0 1 2 4 5 6, and the last
    for name in NAMES:
        assert some[name].errors == (result[name].errors[0], result[name].errors[4])


def test_a_camera_that_stands_still_on_an_open_path_shows_no_flicker(comparison):
    still = replace(comparison, cameras=comparison.cameras[:1] * 2)
    for figures in measure_stability(still, StabilityConfig(alone=0)).configurations:
        assert [warp.gap for warp in figures.warps] == [1]  # it is too short for others
        # Pixels are read exactly where they lie, but for the rounding of the way there and back.
        assert figures.warps[0].rmse < 1e-5
        assert figures.warps[0].redrawn is None or figures.warps[0].redrawn < 1e-4
        assert (figures.turning, figures.loop, figures.alone, figures.alone_equal) == (None, None, 0, 0)
        assert figures.events is None or figures.events.largest_step == 0


def test_frames_that_show_nothing_in_common_are_not_compared(comparison, tmp_path):
    first, far = comparison.cameras[0], comparison.cameras[0].viewmat.copy()
    far[0, 3] += 1e3  # nothing but the ground is in sight
    blind = replace(first, viewmat=far)
    config = StabilityConfig(gaps=(1, 2), alone=0)
    with pytest.warns(bg.SceneWarning, match="no two frames of the path show the same surface"):
        found = measure_stability(replace(comparison, cameras=[first, blind]), config)
    assert found.starts == ()
    for figures in found.configurations:
        assert (figures.warps, figures.errors, figures.turning) == ((), (), None)
    assert stability_table(found).row_count > 8
    write_plot(found, tmp_path / "empty.png", "nothing")
    assert names(tmp_path) == ["empty.png"]
    cameras = [first, blind, blind, first, comparison.cameras[0]]
    found = measure_stability(replace(comparison, cameras=cameras), config)
    assert found.starts == (3,)
    assert [(warp.gap, warp.pairs) for warp in found["off"].warps] == [(1, 1)]
    assert stability_table(found).row_count > 15


def needles(angles):
    """One needle per angle of the picture, side by side before a camera at the origin that looks along z."""
    angles = np.asarray(angles, np.float64)
    count, zeros = len(angles), np.zeros(len(angles))
    means = np.stack([np.linspace(-1, 1, count), zeros, np.full(count, 4.0)], axis=1)
    quats = np.stack([np.cos(angles / 2), zeros, zeros, np.sin(angles / 2)], axis=1)
    return gaussians_at(means, (0.3, 0.03, 0.03), 0.64, quats=quats, dtype=np.float32)


def rolled(*angles):
    """Cameras at the origin that look along z, turned about that axis."""
    K = np.array([[60.0, 0, WIDTH / 2], [0, 60.0, HEIGHT / 2], [0, 0, 1]])
    cameras = []
    for angle in angles:
        viewmat = np.eye(4)
        viewmat[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        cameras.append(bg.Camera(viewmat, K, WIDTH, HEIGHT))
    return cameras


def test_a_planted_flip_shows_in_the_row_and_where_strokes_turn():
    """One of three needles passes the upright, where the unlocked direction jumps by half a turn."""
    scene = needles(np.radians([10, 89, -40]))
    both = (comparison_of(scene, scene, rolled(0.0, np.radians(degrees))) for degrees in (2, -2))
    found, calm = (measure_stability(one, StabilityConfig(alone=0)) for one in both)
    events = found["off"].events
    assert (events.flips, events.spins, events.stroke_frames) == (1, 0, 3)
    assert events.flip_share == pytest.approx(1 / 3, abs=0.01)
    assert np.degrees(events.largest_step) == pytest.approx(178, abs=0.01)
    assert found["off"].turning.rmse > 2 * found["plain"].turning.rmse  # measured: 2.9 times
    assert calm["off"].events.flips == 0
    assert calm["off"].turning is None


def test_paths_and_numbers_by_which_nothing_can_be_compared_are_refused():
    scene = needles([0.0])
    for cameras, match in (
        (rolled(0.0), "at least 2 views to compare, got 1"),
        ([*rolled(0.0), rolled(0.0)[0].resized(20, 10)], "one size, got 20x10 and 48x36"),
    ):
        with pytest.raises(ValueError, match=match):
            measure_stability(comparison_of(scene, scene, cameras))
    for options, match in (
        ({"gaps": ()}, "gaps must ascend from 1, got none"),
        ({"gaps": (1, 7, 7)}, "gaps must ascend from 1, got 1, 7, 7"),
        ({"gaps": (2, 3)}, "gaps must ascend from 1, got 2, 3"),
    ):
        with pytest.raises(ValueError, match=match):
            StabilityConfig(**options)


SMALL = ["--stroke", "dry_brush", "--strokes", "80", "--size", "32x24", "--orbit", "4"]
WHOLE = [*SMALL, "--look-at", "scene"]  # from so far that views 90 degrees apart show the same surfaces


@pytest.mark.usefixtures("folder")
def test_the_command_writes_figures_and_plot_and_prints_a_table(scene, capsys, monkeypatch):
    totals, calls, stage = [], [], StabilityReport.stage

    def recorded(self, name, *, total=None, **clocks):
        totals.append(total)
        return stage(self, name, total=total, **clocks)

    monkeypatch.setattr(StabilityReport, "stage", recorded)
    monkeypatch.setattr(StabilityReport, "advance", lambda self: calls.append(1))
    code, out, err = run(capsys, "stability", scene, *WHOLE, "--seed", "3")
    assert (code, out) == (0, "pears-stability\n"), err
    assert [total for total in totals if total is not None] == [len(calls)] == [4]  # frames of the path
    assert names("pears-stability") == ["stability.json", "stability.png"]
    assert names() == ["pears-stability"]
    height, width, _ = read_image("pears-stability/stability.png").shape
    assert (width, height) == (1440, 544)
    assert Path("pears-stability/stability.png").stat().st_size < 150_000
    assert "4 frames, 24 per second, a loop" in err
    assert "4 frames in 5 configurations" in err  # one number of one thing
    assert "5 frames" not in err
    value = json.loads(Path("pears-stability/stability.json").read_text())
    advice, settings = value["stability"]["advice"], value["settings"]
    assert err.rstrip().splitlines()[-1] == advice
    assert advice.startswith("for this path --lock ")
    assert [one["name"] for one in value["stability"]["configurations"]] == NAMES
    assert (settings["cluster"]["strokes"], settings["cluster"]["seed"]) == (80, 3)  # all that repeats it
    assert (settings["draw"]["stroke"], settings["first_camera"]["width"]) == ("dry_brush", 32)
    assert settings["measure"] == {"gaps": [1, 7, 10], "pairs": 40, "alone": 3, "skip_alone": False}
    for word in ("flips", "spins", "excess", "published", "track", "loop", "3 of 3", "ms a frame: tracking"):
        assert word in err
    assert "\x1b" not in err  # no progress bar in a pipe


def with_shares(result, **shares):
    """The same figures, with other shares of flips, spins and size pops."""
    figures = []
    for each in result.configurations:
        events = each.events
        if each.name in shares:
            flip, spin, pop = shares[each.name]
            events = replace(events, flip_share=flip, spin_share=spin, pop_share=pop)
        figures.append(replace(each, events=events))
    return replace(result, configurations=tuple(figures))


def test_the_advice_names_the_steadiest_lock(result):
    found = with_shares(result, track=(0, 0.003, 0), anchor=(0.01, 0.02, 0), off=(0.1, 0, 0.02))
    excess = max(0.0, 255 * result["track"].warps[0].excess)
    assert advice(found) == (
        "for this path --lock track (the default) is steadiest: 0.30% of the painted area turns or jumps in "
        "a frame, 3.00% with anchor and 12.00% with off; "
        f"it flickers by {excess:.1f} of 255 more than the plain picture"
    )
    coarse = advice(with_shares(result, track=(0, 0.2, 0), anchor=(0.1, 0.2, 0), off=(0.1, 0, 0.02)))
    assert coarse.startswith("for this path --lock off is steadiest: 12.00% of")
    assert coarse.endswith("; smaller steps of the camera (more frames) would be steadier")
    even = advice(with_shares(result, track=(0, 0, 0), anchor=(0, 0, 0), off=(0, 0, 0)))
    assert even.startswith("for this path --lock track (the default) is steadiest: 0.00% of")


@pytest.mark.usefixtures("folder")
def test_the_plot_needs_matplotlib_and_the_figures_do_not(scene, capsys, monkeypatch):
    assert run(capsys, "stability", scene, *SMALL, "-o", "one.png", "--quiet") == (0, "", "")
    assert names() == ["one.png"]  # the plot alone
    monkeypatch.setattr(plotting, "find_spec", lambda name: None)
    code, out, err = run(capsys, "stability", scene, *WHOLE)
    assert (code, out) == (0, "pears-stability\n")
    note = f"pears-stability/stability.png is skipped: {plotting.NO_MATPLOTLIB}"
    assert (err.partition("\n")[0], err.count("note:")) == (f"brushgs: note: {note}", 1)
    assert names("pears-stability") == ["stability.json"]
    words = "stability", scene, *WHOLE, "-o", "two.png"
    assert "the plot needs matplotlib, which is not installed" in refused(capsys, *words)
    assert names() == ["one.png", "pears-stability"]


@pytest.mark.usefixtures("folder")
def test_bad_input_is_one_sentence_and_leaves_nothing(scene, capsys):
    bg.save(bg.Frame(np.ones((4, 4, 3), np.float32), np.ones((4, 4), np.float32)), "brush.png")
    for words, match in (
        (["-o", "report.pdf"], "output must be a folder or end in .json, .png, got 'report.pdf'"),
        (["-o", "a.png", "--no-plot"], "--no-plot cannot be combined with an output that is a plot"),
        (["--stroke", "brush.png", "-o", "brush.png"], "is the input, which is never overwritten"),
        (["--background", "transparent"], "background must be a color or an image"),
        (["--path", "way.json"], "either an orbit or a path from a file, got both"),
        (["--lock", "off"], "unrecognized arguments: --lock off"),
    ):
        assert match in refused(capsys, "stability", scene, *SMALL, *words)
    assert names() == ["brush.png"]
