"""Films that are made by hand: options, frames alone, notes."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.options.hand import HandConfig, Pace
from brushgs.options.maps import Map
from brushgs.options.rules import Rules
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.hand import describe_hand, flashing_area
from brushgs.pipeline.report import Report
from brushgs.rendering.hand import Hand
from tests.kit import for_each, stages, write_cameras
from tests.pipeline.test_sequence import FILES, config, contents, paint, read_image

RULES = '[[region]]\nwhere = "height:40%.."\nhold = 3\nboil = 0.2\n'


def by_hand(**hand):
    return replace(config(), hand=HandConfig(**hand))


def pictures(folder):
    return [np.asarray(Image.open(Path(folder, name)), np.int16) for name in FILES]


pytestmark = pytest.mark.usefixtures("folder")


def test_held_frames_are_equal_where_the_camera_is_held_and_painted_once(scene):
    report = paint(scene, paint_config=by_hand(hold=2, hold_camera=True))
    files = contents("f")
    assert [files[FILES[i]] == files[FILES[i + 1]] for i in range(5)] == [True, False] * 2 + [True]
    assert stages(report)["paint"].counts["repeated"] == 3


ALL = {"hold": 2, "boil": 0.5, "redraw": 2.0, "smear": 1.0}


@for_each("hand", [ALL, {"boil": 0.5, "boil_every": 2}])
def test_a_frame_alone_is_that_of_the_film(scene, hand):
    made = by_hand(**hand)
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
    films = zip(pictures("plain"), pictures("parts"), strict=True)
    changed = [np.abs(one - other).max(axis=-1) > 8 for one, other in films]
    assert 0 < np.mean(changed) < 0.6


def test_holding_the_camera_needs_a_hold():
    with pytest.raises(ValueError, match="hold-camera needs hold"):
        HandConfig(hold_camera=True)


def test_a_map_holds_a_part_as_a_rule_does(scene):
    """Off its soft edge, which lies beside the strokes here."""
    Path("rules.toml").write_text('[[region]]\nwhere = "height:-900%.."\nhold = 3\n', encoding="utf-8")
    maps = (Map.parse("hold=height:-900%..:1..3"),)
    films = {
        "steady/": config(),
        "ruled/": replace(config(), rules=Rules.of(Path("rules.toml"))),
        "mapped/": replace(config(), strokes=replace(config().strokes, maps=maps)),
    }
    for name, made in films.items():
        paint(scene, name, paint_config=made)
    steady, ruled, mapped = map(pictures, films)
    np.testing.assert_array_equal(ruled, mapped)
    assert not np.array_equal(steady, mapped)


@for_each(("light", "rate", "flashes"), [(0.05, 4, False), (0.4, 4, True), (0.4, 1, False)])
def test_a_film_that_flashes_says_so(light, rate, flashes):
    film = Hand((Pace(boil=1.0),), 1, False, 24.0, 48, False, {})
    frames = np.full((48, 20, 30, 3), 0.3)
    frames[:, :, :15] += light * (np.arange(48) * rate // 12 % 2)[:, None, None, None]  # in a part of it
    assert (flashing_area(list(frames), 24) > 0.25) is flashes
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        describe_hand(film, lambda side: iter(frames), Report())
    assert any("flashes more than 3 times a second" in str(one.message) for one in told) is flashes


# Films close where the path of their camera does


NUM_FRAMES, FPS = 24, 12
SWAY = PathConfig(orbit=NUM_FRAMES, sway=0.05, fps=FPS)  # small steps: what changes is what is made by hand
FILE = Path("closed.json")


def film(scene, path, **hand):
    """The frames [F, H, W, 3] of a film, 0 to 1."""
    folder = Path("closed" if path.loop or path.orbit else "open")
    paint(scene, f"{folder}/", path, replace(config(), hand=HandConfig(**hand)))
    return np.stack([read_image(file)[..., :3] for file in sorted(folder.glob("*.png"))])


def changes(frames):
    """Rms of the change of each frame to the next; of the last one to the first one."""
    return np.sqrt(np.square(np.roll(frames, -1, axis=0) - frames).mean(axis=(1, 2, 3)))


def closed_file(scene):
    """A file of cameras on a small circle, whose last view is its first one."""
    cameras = bg.orbit(read_scene(scene)[0], 40 * NUM_FRAMES, width=48, height=36, zoom=1.2)
    away = np.rint(NUM_FRAMES / 4 * np.sin(2 * np.pi * np.arange(NUM_FRAMES + 1) / NUM_FRAMES)).astype(int)
    write_cameras(FILE.resolve(), [cameras[step] for step in away])


@for_each("of_file", [False, True])
@for_each("hand", [{"boil": 0.5}, {"redraw": 2.0}, {"redraw": 2.0, "redraw_from": Path("left")}])
def test_a_film_closes_where_the_path_of_its_camera_closes(of_file, hand, scene):
    if of_file:
        closed_file(scene)
    path = PathConfig(file=FILE, loop=True, fps=FPS) if of_file else SWAY
    found = changes(film(scene, path, **hand))
    assert len(found) == NUM_FRAMES
    if "boil" in hand:
        found = found[2::3]  # from drawing to drawing: the last one is over when the film begins again
    assert 0.9 * found[:-1].min() < found[-1] < 1.05 * found[:-1].max()  # 0 where the first frame comes twice
