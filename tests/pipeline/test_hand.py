"""Films that are made by hand: options, frames alone, notes."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.cli.configs import path_config
from brushgs.cli.parser import command_parser
from brushgs.options.hand import HandConfig, Pace
from brushgs.options.maps import Map
from brushgs.options.rules import Rules
from brushgs.pipeline.hand import describe_hand, flashing_area
from brushgs.pipeline.report import Report
from brushgs.rendering.hand import Hand
from tests.pipeline.test_sequence import FILES, config, contents, paint, scene, stage

__all__ = ["scene"]
RULES = '[[region]]\nwhere = "height:40%.."\nhold = 3\nboil = 0.2\n'


def by_hand(**hand):
    return replace(config(), hand=HandConfig(**hand))


def pictures(folder):
    return [np.asarray(Image.open(Path(folder, name)), np.int16) for name in FILES]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_held_frames_are_equal_where_the_camera_is_held_and_painted_once(scene):
    report = paint(scene, paint_config=by_hand(hold=2, hold_camera=True))
    files = contents("f")
    assert [files[FILES[i]] == files[FILES[i + 1]] for i in range(5)] == [True, False] * 2 + [True]
    assert stage(report, "paint").counts["repeated"] == 3


ALL = {"hold": 2, "boil": 0.5, "redraw": 2.0, "smear": 1.0}


@pytest.mark.parametrize("hand", [ALL, {"boil": 0.5, "boil_every": 2}])
def test_a_frame_alone_is_that_of_the_film(scene, hand):
    made = replace(by_hand(**hand), rules=None)
    paint(scene, "all/", paint_config=made)
    paint(scene, "some/", paint_config=made)
    for name in FILES[2:4]:
        Path("some", name).unlink()
    paint(scene, "some/", paint_config=made, is_resumed=True, jobs=2)
    assert contents("some") == contents("all")
    with pytest.raises(bg.SceneError, match=r"hand .*boil 0\.5.*, now plain"):
        paint(scene, "some/", is_resumed=True)


def test_parts_have_their_own_rates(scene):
    Path("parts.toml").write_text(RULES)
    paint(scene, "plain/")
    paint(scene, "parts/", paint_config=replace(config(), rules=Rules.of(Path("parts.toml"))))
    changed = [
        np.abs(one - other).max(axis=-1) > 8
        for one, other in zip(pictures("plain"), pictures("parts"), strict=True)
    ]
    assert 0 < np.mean(changed) < 0.6


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--hold", "2"], r"--hold needs --orbit, --path or --grow; a single picture does not use it"),
        (["--boil", "0.3"], r"--boil needs --orbit, --path or --grow"),
        (["--redraw", "1"], r"--redraw needs --orbit, --path or --grow"),
    ],
)
def test_they_are_refused_of_one_picture(words, sentence):
    args = command_parser("render").parse_args(["scene.ply", *words])
    with pytest.raises(ValueError, match=sentence):
        path_config(args)


def test_holding_the_camera_needs_a_hold():
    with pytest.raises(ValueError, match="hold-camera needs hold"):
        HandConfig(hold_camera=True)


def test_a_map_holds_a_part_as_a_rule_does(scene, folder):
    """Off its soft edge, which lies beside the strokes here."""
    Path("rules.toml").write_text('[[region]]\nwhere = "height:-900%.."\nhold = 3\n', encoding="utf-8")
    ruled = replace(config(), rules=Rules.of(Path("rules.toml")))
    mapped = replace(
        config(), strokes=replace(config().strokes, maps=(Map.parse("hold=height:-900%..:1..3"),))
    )
    paint(scene, "steady/", paint_config=replace(config(), rules=None))
    paint(scene, "ruled/", paint_config=ruled)
    paint(scene, "mapped/", paint_config=replace(mapped, rules=None))
    steady, rule, found = (pictures(name) for name in ("steady", "ruled", "mapped"))
    np.testing.assert_array_equal(rule, found)
    assert any((one != two).any() for one, two in zip(steady, found, strict=True))


@pytest.mark.parametrize(("rate", "flashes"), [(1, False), (4, True)])
def test_flashes_are_counted_in_a_part_of_the_picture(rate, flashes):
    film = np.full((24, 30, 60, 3), 0.3)
    film[:, :, :30] += 0.2 * (np.arange(24) * rate // 12 % 2)[:, None, None, None]
    assert (flashing_area(list(film), 24) > 0.25) is flashes


@pytest.mark.parametrize(("light", "flashes"), [(0.05, False), (0.4, True)])
def test_a_film_that_flashes_says_so(light, flashes):
    film = Hand((Pace(boil=1.0),), 1, False, 24.0, 48, False, {})
    frames = [np.full((20, 30, 3), 0.3 + light * (index // 3 % 2)) for index in range(48)]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        describe_hand(film, lambda side: iter(frames), Report())
    assert any("flashes more than 3 times a second" in str(one.message) for one in told) is flashes
