"""A moving scene in the studio: its page plays, and pictures and videos are of the moment that is shown."""

import tomllib

import numpy as np
import pytest

from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.formats.pictures.images import read_image
from brushgs.options.viewer import FilmConfig
from brushgs.outlets.studio.settings import Film, Settings, Shot
from brushgs.pipeline.other_views import at_moment
from brushgs.pipeline.report import Report
from tests.clips import DURATION, save_clip
from tests.io.test_video import read
from tests.outlets.studio.conftest import paged, until
from tests.outlets.studio.test_session import header_of
from tests.outlets.studio.test_studio_page import slide

FEW = ["--strokes", "90", "--size", "96x72", "--backdrop", "off", "--see", "off", "--look", "plain"]


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A folder of numbered moments."""
    return save_clip(tmp_path_factory.mktemp("clip") / "frames")


@pytest.fixture
def session(clip, tmp_path):
    return session_of(parse(["view", str(clip), *FEW, "-o", str(tmp_path)]))


def test_a_clip_is_painted_with_its_motion_and_one_moment_without(session, clip):
    painted = session.paint(Settings(), Report())
    header = header_of(painted.contents)
    assert header["motion"]["times"][-1] == pytest.approx(DURATION, abs=1 / 30)
    assert header["command"]["scene"] == str(clip)
    assert "--time" not in header["command"]["options"]
    made = dict(session.made)
    session.paint(Settings(relief=0.5), Report())
    assert session.made["motion of rows"] == made["motion of rows"] == 1  # strokes are not followed anew
    still = session_of(parse(["view", str(clip), *FEW, "--time", "50%"])).paint(Settings(), Report())
    assert "motion" not in header_of(still.contents)


def test_a_picture_is_of_the_moment_that_is_shown(session):
    painted = session.paint(Settings(), Report())
    camera = painted.prepared.camera
    shots = [session.shoot(painted, Shot(camera, seconds), Report()) for seconds in (0, DURATION, 9)]
    first, last, later = map(read_image, shots)
    assert np.abs(first - last).max() > 0.4  # the body is elsewhere
    np.testing.assert_array_equal(last, later)
    film = painted.prepared.moving.film
    middle = at_moment(painted.prepared, 2 / film.fps).painting.coats[0].strokes
    exact = painted.prepared.painting.posed(painted.prepared.moving.pose(2)).coats[0].strokes
    np.testing.assert_allclose(middle.means, exact.means, atol=1e-6)


def test_saved_options_have_the_moment_where_the_page_rests(clip, tmp_path, open_page):
    file, words = tmp_path / "mine.toml", ["view", str(clip), *FEW, "-o", str(tmp_path)]
    saving = session_of(parse([*words, "--save", str(file)]))
    with paged(saving, tmp_path, open_page, is_drawn=False) as (page, _):
        page.locator("#moment").evaluate("e => { e.value = 0.1; e.dispatchEvent(new Event('input')); }")
        until(page, "location.hash.includes('t=0.1')")
        slide(page, "relief", 0.4)
    saved = tomllib.loads(file.read_text(encoding="utf-8"))
    assert (float(saved["moment"]), float(saved["relief"])) == (0.1, 0.4)
    assert parse(["render", str(clip), "--config", str(file)]).look == "plain"  # for which it means nothing
    (tmp_path / "again").mkdir()
    again = session_of(parse(["view", str(clip), "--config", str(file), "-o", str(tmp_path)]))
    with paged(again, tmp_path / "again", open_page, is_drawn=False) as (page, _):
        assert page.evaluate("brushgs.player.seconds") == pytest.approx(0.1)


def test_the_scene_moves_in_videos(session):
    painted = session.paint(Settings(), Report())
    camera = painted.prepared.camera
    rests = session.film(painted, Film(FilmConfig("clip", DURATION, 96, 72, fps=24), [camera]), Report())
    frames, _, _ = read(rests)
    assert len(frames) == 4
    assert np.abs(frames[0].astype(int) - frames[-1]).max() > 100
    center = tuple(header_of(painted.contents)["center"])
    turn = session.film(painted, Film(FilmConfig("turn", 0.2, 96, 72, fps=20), [camera], center), Report())
    assert len(read(turn)[0]) == 4


def test_a_page_scrubs_and_a_reload_keeps_the_moment(session, tmp_path, open_page):
    with paged(session, tmp_path, open_page) as (page, _):
        assert page.get_by_role("slider", name="Moment").is_visible()
        page.locator("#moment").evaluate("e => { e.value = 0.1; e.dispatchEvent(new Event('input')); }")
        until(page, "location.hash.includes('t=0.1')")
        slide(page, "relief", 0.4)  # another painting, at the same moment
        assert page.evaluate("brushgs.player.seconds") == pytest.approx(0.1)
        page.focus("#painting")
        page.keyboard.press(".")
        until(page, "location.hash.includes('t=0.14')")
        page.reload()
        until(page, "window.brushgs.studio?.isSettled")
        assert page.evaluate("brushgs.player.seconds") == pytest.approx(0.14)
        page.fill("#studio input[name=width]", "64")
        page.fill("#studio input[name=height]", "48")
        assert page.input_value("#studio select[name=path]") == "clip"
        page.click("#render")
        until(page, "document.querySelector('#output').open")
    assert len(list(tmp_path.glob("*.png"))) == 1
