from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene, up_vector
from brushgs.cli.configs import paint_config
from brushgs.cli.parser import parse
from brushgs.options.painting import ClusterConfig
from brushgs.options.stroke_target import ErrorBudget, StrokeSize
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint
from brushgs.rendering.options import RenderOptions
from brushgs.still_life import still_life_camera
from brushgs.stroke_count.choose import FEWEST, counts_to_sample
from brushgs.stroke_count.search import SIZE_TRIES
from brushgs.stroke_count.view_model import ViewModel
from tests.kit import BLIND, for_each, real_scene, refused, stages, stages_of, still_life_of, without_look

SWIRL = bg.StrokeTexture.open("swirl")
KERNEL = bg.StrokeTexture.open("gaussian")


@pytest.fixture(scope="module")
def pears():
    return still_life_of(2000)


@pytest.fixture(scope="module")
def camera():
    return still_life_camera(width=160, height=120)


def test_the_choice_lies_within_the_scene_and_says_what_to_expect(pears, camera):
    choice = bg.choose_strokes(pears, camera, SWIRL, cost="frame")
    assert FEWEST <= choice.strokes <= len(pears)
    assert choice.knee.strokes == choice.strokes
    assert choice.curve.strokes[-1] == len(pears)
    assert list(choice.curve.strokes[:-1]) == counts_to_sample(len(pears), "knee")
    assert (np.diff(choice.sizes) <= 0).all()
    at = bg.render(bg.cluster(pears, choice.strokes), camera, SWIRL).over((1, 1, 1))
    error = at - bg.render(pears, camera, KERNEL).over((1, 1, 1))
    assert choice.psnr == pytest.approx(-10 * np.log10(np.mean(error**2)), abs=1.0)


def test_scenes_of_few_of_equal_and_of_unseen_gaussians_give_no_more_strokes_than_they_have(pears, camera):
    same = pears.take(np.zeros(600, np.intp))
    away = replace(pears, means=pears.means + np.float32(1000))
    for scene in (pears.take([0]), pears.take([0, 1]), pears.take(slice(100))):
        for target in ({"psnr": 12.0}, {"size": 40.0}, {}):
            choice = bg.choose_strokes(scene, camera, SWIRL, **target)
            assert 1 <= choice.strokes <= len(scene)
        assert (choice.strokes, choice.knee) == (len(scene), None)
    for scene in (same, away):
        assert 1 <= bg.choose_strokes(scene, camera, SWIRL).strokes <= len(scene)
    assert bg.choose_strokes(away, camera, SWIRL, size=9.0).size == 0


def test_a_stricter_budget_never_gives_fewer_strokes(pears, camera):
    counts = [bg.choose_strokes(pears, camera, SWIRL, psnr=psnr).strokes for psnr in np.linspace(8, 20, 5)]
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


def test_the_choice_follows_how_strokes_are_made_and_no_number_of_threads(pears, camera):
    def curve(**options):
        return bg.choose_strokes(pears, camera, SWIRL, cost="frame", **options).curve

    one, two = curve(num_threads=1), curve(num_threads=2)
    assert np.array_equal(one.rmse, two.rmse)
    assert np.array_equal(one.seconds, two.seconds)
    for options in ({"features": "paper"}, {"merge": "paper"}, {"background": (0, 0, 0)}):
        assert not np.array_equal(curve(**options).rmse, one.rmse)


def test_what_cannot_be_chosen_for_is_refused(pears, camera):
    for options, words in (
        ({"psnr": 20.0, "size": 4.0}, "psnr cannot be combined with size"),
        ({"psnr": 0.0}, "psnr must be above 0"),
        ({"size": np.inf}, "size must be above 0 and finite"),
        ({"psnr": 90.0}, "budget must be one that 'swirl' can meet, got 90 dB; all 2,202 strokes reach"),
        ({"plain": bg.render(pears, camera.resized(64, 48), KERNEL)}, "plain must have shape"),
    ):
        with pytest.raises(ValueError, match=words):
            bg.choose_strokes(pears, camera, SWIRL, **options)
    with pytest.raises(ValueError, match="at least one row"):
        bg.choose_strokes(pears.take(slice(0)), camera, SWIRL)
    with pytest.raises(ValueError, match="strokes must be a number, auto"):
        ClusterConfig("some")
    with pytest.raises(TypeError, match="strokes must be a count, a share or None, got 9dB"):
        ClusterConfig(ErrorBudget(9.0)).num_strokes(10)


def test_errors_are_those_of_the_pictures_on_their_ground(pears, camera):
    strokes, plain = bg.cluster(pears, 200), bg.render(pears, camera, KERNEL)
    for ground in (np.ones(3), np.random.default_rng(0).random((120, 160, 3))):
        view_model = ViewModel(camera, SWIRL, RenderOptions.of(SWIRL), plain, ground)
        shown = [np.clip(frame.over(ground), 0, 1) for frame in (bg.render(strokes, camera, SWIRL), plain)]
        rmse = np.sqrt(np.mean((shown[0] - shown[1]) ** 2))
        assert view_model.rmse(view_model.boxes(strokes)) == pytest.approx(rmse, rel=1e-4)


def painted(pears, strokes):
    config, report = without_look("swirl", strokes, (160, 90), strokes=BLIND), Report()
    return paint(pears, config, report=report), stages(report)


def test_a_painting_says_why_it_has_so_many_strokes(pears):
    _, stages = painted(pears, "auto:frame")
    count = stages["count"].counts["strokes"]
    assert stages["count"].did.startswith(f"{count:,} strokes: the knee, where doubling gains ")
    assert stages["cluster"].counts["after"] <= count
    assert list(stages).index("plain") < list(stages).index("prune") < list(stages).index("count")
    assert painted(pears.take(slice(100)), "auto:frame")[1]["count"].did.endswith(" of so small a scene")
    assert not {"plain", "count"} & set(painted(pears, 300)[1])  # a count that is given takes no look


def test_the_knee_of_a_still_is_of_clustering_and_the_time_of_a_painting(monkeypatch, camera):
    """Where merging costs nothing there are few strokes, and where it costs more than it saves all."""
    scene = still_life_of(6000)
    few = {"CLUSTER": 0.0, "CUT": 0.0, "START": 0.0, "SEARCH": 0.0, "LOOK": 0.0}
    for name, value in few.items():
        monkeypatch.setattr(f"brushgs.stroke_count.view_model.{name}", value)
    cheap = bg.choose_strokes(scene, camera, SWIRL, cost="painting")
    assert cheap.strokes < len(scene) / 2
    assert cheap.curve.rmse[-1] < 1e-3  # no brush: all Gaussians are the plain picture
    monkeypatch.setattr("brushgs.stroke_count.view_model.CLUSTER", 15e3)
    assert bg.choose_strokes(scene, camera, SWIRL, cost="painting").strokes == len(scene)


def test_a_budget_is_kept_and_a_stricter_one_takes_more(pears):
    asked = (15.0, 20.0, 22.0)
    counts = [painted(pears, ErrorBudget(psnr))[1]["cluster"].counts for psnr in asked]
    assert all(count["psnr"] >= psnr for count, psnr in zip(counts, asked, strict=True))
    assert counts[0]["after"] < counts[1]["after"] < counts[2]["after"]


@for_each("pixels", [60.0, 90.0])
def test_a_size_is_reached_within_a_tenth(pears, pixels):
    _, stages = painted(pears, StrokeSize(pixels))
    assert stages["cluster"].counts["size"] == pytest.approx(pixels, rel=0.1)
    assert stages["cluster"].counts["tries"] <= SIZE_TRIES


def test_a_size_that_cannot_be_had_is_told(pears):
    for pixels, cure in ((1.0, "[0-9.]+px, paint a sm"), (30000.0, r"[0-9]+px, or paint a larger picture")):
        rule = rf"strokes of {pixels:g}px are not possible in this view; these .*; take --stroke-size {cure}"
        with pytest.warns(bg.SceneWarning, match=rule):
            painted(pears, StrokeSize(pixels))


def counts_of(words, capsys):
    """Counts of each stage of a command."""
    return {name: stage["counts"] for name, stage in stages_of(capsys, *words).items()}


def test_a_film_is_counted_by_the_time_of_a_frame_and_its_frames_can_be_gone_on_with(pears, tmp_path, capsys):
    bg.save(pears, tmp_path / "a.ply")
    words = ["render", tmp_path / "a.ply", "--look", "plain", "--stroke", "swirl", "--size", "64x48"]
    frame = counts_of([*words, "--strokes", "auto:frame", "-o", tmp_path / "f.png"], capsys)
    still = counts_of([*words, "-o", tmp_path / "s.png"], capsys)
    film = [*words, "--orbit", "3", "-o", tmp_path / "f/%d.png"]
    first = counts_of(film, capsys)
    assert first["count"]["strokes"] == frame["count"]["strokes"]
    assert frame["count"]["strokes"] < still["count"]["strokes"] == len(bg.prune(pears))
    (tmp_path / "f/1.png").unlink()
    again = counts_of([*film, "--resume"], capsys)
    assert again["cluster"]["after"] == first["cluster"]["after"]
    assert (again["paint"]["painted"], again["paint"]["skipped"]) == (1, 2)


@for_each(
    ("words", "strokes"),
    [
        (["--strokes", "auto:frame"], "auto:frame"),
        (["--strokes", "24dB"], ErrorBudget(24.0)),
        (["--strokes", "24.5db"], ErrorBudget(24.5)),
        (["--stroke-size", "24px"], StrokeSize(24.0)),
        (["--stroke-size", "7.5"], StrokeSize(7.5)),
        (["--stroke", "gaussian", "--strokes", "auto"], "auto"),
    ],
)
@for_each("command", ["render", "stability"])
def test_aims_are_read_from_the_command_line(words, strokes, command):
    assert paint_config(parse([command, "a.ply", *words])).cluster.strokes == strokes


@for_each(
    ("words", "sentence"),
    [
        (["--strokes", "0dB"], "--strokes must be above 0 dB and at most 100 dB, got 0 dB"),
        (["--strokes", "many"], "a PSNR such as 24dB, got 'many'"),
        (["--strokes", "dB"], "a PSNR such as 24dB, got 'dB'"),
        (["--stroke-size", "0px"], "--stroke-size must be above 0 and at most 32767 px, got 0px"),
        (["--stroke-size", "3cm"], "such as 24px, or 8mm on paper, got '3cm'"),
        (["--stroke-size", "3px", "--strokes", "5"], "--strokes cannot be combined with --stroke-size"),
    ],
)
def test_aims_that_mean_nothing_get_one_sentence(words, sentence, capsys):
    assert sentence in refused(capsys, "render", "a.ply", *words)


def test_on_a_real_scene_the_choice_is_near_the_knee_of_the_full_curve():
    """As `examples/benchmarks/stroke_count.py` measured it, in seconds of the processor."""
    gaussians, knee = bg.load(real_scene("koala.ply")), 2230
    camera = frame_scene(gaussians, width=1280, height=720, up=up_vector("-y"))
    plain = bg.render(gaussians, camera, KERNEL)
    choice = bg.choose_strokes(bg.prune(gaussians), camera, SWIRL, plain=plain, cost="frame")
    assert knee / 1.5 <= choice.strokes <= knee * 1.5
