"""The state of the page: the latest change wins, outputs show what was changed before, errors are told."""

import threading
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace

import pytest

from brushgs.brushes.texture import strokes_folder
from brushgs.errors import SceneError
from brushgs.options.scene_source import SceneSource
from brushgs.options.viewer import FilmConfig
from brushgs.outlets.studio.overpainting import Overpainting
from brushgs.outlets.studio.scenes import MAX_DROPPED
from brushgs.outlets.studio.session import Painted
from brushgs.outlets.studio.settings import Film, Known, Settings, Shot
from brushgs.outlets.studio.studio import MAX_OUTPUTS
from tests.outlets.studio.conftest import SECONDS, studio_of


@dataclass
class FakeSession:
    """A session whose stages a test lets go, one by one."""

    folder: Path
    stages: dict = field(default_factory=dict)  # number of strokes -> event that lets its stage go on
    began: dict = field(default_factory=dict)  # number of strokes -> event that it began
    error: Exception | None = None
    save_error: Exception | None = None
    painted: list = field(default_factory=list)
    saved: list = field(default_factory=list)
    dropped: dict = field(default_factory=dict)
    known: Known = field(default_factory=Known)
    source: SceneSource = field(default_factory=lambda: SceneSource.of("fake.ply"))
    overpainting: Overpainting = field(default_factory=lambda: Overpainting(Path))  # nothing
    moment: float = 0.0

    def config(self, settings):
        if settings.relief is not None and settings.relief > 1:
            raise ValueError("relief must be 0 to 1")

    def save(self, settings):
        if self.save_error is not None:
            raise self.save_error
        self.saved.append(settings)

    def of_scene(self, source):
        return replace(self, source=source)

    def hold(self, count):
        self.stages[count], self.began[count] = threading.Event(), threading.Event()

    def paint(self, settings, report):
        count = settings.strokes or 0
        with report.stage("cluster"):
            if count in self.stages:
                self.began[count].set()
                assert self.stages[count].wait(SECONDS)
        if self.error is not None:
            raise self.error
        with report.stage("page"):
            self.painted.append(count)
        return Painted(settings, None, None, b"contents %d" % count, {"strokes": count})

    def shoot(self, painted, shot, report):
        with report.stage("rasterise"):
            path = self.folder / f"{painted.facts['strokes']}.png"
            path.write_bytes(b"picture")
        return path

    def film(self, painted, film, report):
        if self.error is not None:
            raise self.error
        with report.stage("paint", total=3):
            self.began["film"].set()
            for _ in range(3):
                assert self.stages["film"].wait(SECONDS)
                report.advance()
        return self.folder / "film.mp4"


@pytest.fixture
def session(tmp_path):
    return FakeSession(tmp_path)


@pytest.fixture
def studio(session, tmp_path):
    uploads = tmp_path / "uploads"
    uploads.mkdir()
    first = Painted(Settings(), None, None, b"contents 0", {"strokes": 0})
    with studio_of(session, uploads, first) as studio:
        yield studio
        for event in session.stages.values():
            event.set()


SHOT = Shot(SimpleNamespace(width=4, height=3))
FILM = Film(FilmConfig("turn", 1, 4, 3), [])


def states_of(studio):
    return [output["state"] for output in studio.state()["outputs"]]


def test_the_latest_change_wins_and_the_others_are_left_at_their_next_stage(session, studio):
    for count in (1, 2, 3):
        session.hold(count)
    studio.change(Settings(strokes=1))
    assert session.began[1].wait(SECONDS)
    studio.change(Settings(strokes=2))
    studio.change(Settings(strokes=3))
    state = studio.state()
    assert (state["version"], state["settings"]) == (1, {"strokes": 3})
    assert state["progress"] == {"stage": "waiting", "done": 0, "total": None}
    for event in session.stages.values():
        event.set()
    assert studio.wait(SECONDS)
    assert session.painted == [3]
    assert not session.began[2].is_set()
    assert studio.contents() == (2, b"contents 3")
    assert studio.state()["progress"] is None


def test_the_state_is_told_as_soon_as_it_changes(session, studio):
    session.hold(1)
    before = studio.state()["number"]
    assert studio.state(before, 0)["number"] == before
    studio.change(Settings(strokes=1))
    assert session.began[1].wait(SECONDS)
    known = studio.state()["number"]
    told = []
    waiting = threading.Thread(target=lambda: told.append(studio.state(known, SECONDS)))
    waiting.start()
    session.stages[1].set()
    waiting.join(SECONDS)
    assert told[0]["number"] > known


def test_a_change_that_fails_is_told_and_leaves_the_painting(session, studio):
    before = studio.state()
    with pytest.raises(ValueError, match="relief must be 0 to 1"):
        studio.change(Settings(relief=2))
    assert studio.state() == before  # refused at once
    for version, error, told in (
        (1, SceneError("a.ply", "is damaged; get it again"), "a.ply: is damaged; get it again"),
        (2, KeyError("x"), "internal error, KeyError: 'x'"),
    ):
        session.error = error
        studio.change(Settings(strokes=5))
        assert studio.wait(SECONDS)
        assert (studio.state()["version"], studio.state()["error"]) == (version, told)
        session.error = None
        studio.change(Settings(strokes=6))
        assert studio.wait(SECONDS)
        assert (studio.contents(), studio.state()["error"]) == ((version + 1, b"contents 6"), None)


def test_a_picture_shows_the_changes_that_were_made_before_it(session, studio, tmp_path):
    session.hold(7)
    studio.change(Settings(strokes=7))
    key = studio.shoot(SHOT)
    assert session.began[7].wait(SECONDS)
    assert states_of(studio) == ["waiting"]
    assert studio.output(key) is None
    session.stages[7].set()
    assert studio.wait(SECONDS)
    assert studio.output(key) == tmp_path / "7.png"
    assert studio.state()["outputs"][0]["name"] == "7.png"


def test_a_change_does_not_wait_for_a_video(session, studio):
    session.hold("film")
    key = studio.film(FILM)
    assert session.began["film"].wait(SECONDS)
    studio.change(Settings(strokes=8))
    assert studio._changes.wait(seconds=SECONDS)
    assert studio.contents() == (2, b"contents 8")
    assert states_of(studio) == ["running"]
    assert studio.state()["outputs"][0]["progress"] == {"stage": "paint", "done": 0, "total": 3}
    session.stages["film"].set()
    assert studio.wait(SECONDS)
    assert studio.output(key).name == "film.mp4"


def test_a_video_that_fails_is_told(session, studio):
    session.error = ValueError("a path must have at least 2 different key views")
    key = studio.film(FILM)
    assert studio.wait(SECONDS)
    (output,) = studio.state()["outputs"]
    assert (output["state"], output["error"], studio.output(key)) == ("failed", str(session.error), None)


def test_outputs_can_be_stopped_while_they_wait_and_run_and_are_not_too_many(session, studio):
    session.hold("film")
    keys = [studio.film(FILM) for _ in range(MAX_OUTPUTS)]
    with pytest.raises(ValueError, match="at most 32 pictures and videos can wait"):
        studio.shoot(SHOT)
    assert session.began["film"].wait(SECONDS)
    assert all(studio.stop(key) for key in reversed(keys))
    session.stages["film"].set()
    assert studio.wait(SECONDS)
    assert set(states_of(studio)) == {"stopped"}
    assert not studio.stop(keys[0])
    assert not studio.stop("nothing")


def test_what_is_dropped_must_be_a_picture_and_its_name_is_no_path(studio, session, tmp_path):
    with pytest.raises(ValueError, match=r"^../../evil.png: "):
        studio.add_file("../../evil.png", b"no picture")
    assert list((tmp_path / "uploads").iterdir()) == []
    content = (strokes_folder() / "swirl.png").read_bytes()
    key = studio.add_file("../../evil.png", content)
    assert session.dropped[key].name == "../../evil.png"
    assert session.dropped[key].path == tmp_path / "uploads" / key / "evil.png"
    other = studio.add_file("..", content)
    assert session.dropped.pop(other).path == tmp_path / "uploads" / other / "dropped"
    assert studio.choices()["dropped"] == [{"id": key, "name": "../../evil.png"}]


def test_closing_a_studio_leaves_its_work(session, studio):
    session.hold(1)
    session.hold("film")
    studio.film(FILM)
    assert session.began["film"].wait(SECONDS)
    studio.change(Settings(strokes=1))
    assert session.began[1].wait(SECONDS)
    assert not studio.close(0)
    for event in session.stages.values():
        event.set()
    assert studio.close(SECONDS)
    assert session.painted == []
    assert states_of(studio) == ["stopped"]


def test_changes_are_saved_before_they_are_painted(session, studio):
    session.hold(1)
    studio.change(Settings(strokes=1))
    assert session.saved == [Settings(strokes=1)]
    session.save_error = SceneError("mine.toml", "cannot be written; check the disk")
    with pytest.raises(SceneError, match=r"mine\.toml: cannot be written"):
        studio.change(Settings(strokes=2))
    assert studio.state()["settings"] == {"strokes": 1}
    session.stages[1].set()


SPLAT = bytes(32)  # one Gaussian without size


def test_another_scene_is_painted_with_the_same_settings_and_shown_when_it_is_done(session, studio):
    studio.change(Settings(strokes=5, focus=(0, 0, 0, 1), azimuth=20))  # places are those of one scene
    assert studio.wait(SECONDS)
    before = studio.state()["scene"]
    session.hold(5)
    key = studio.add_scene("../garden.splat", BytesIO(SPLAT))
    assert session.began[5].wait(SECONDS)
    assert studio.state()["scene"] == before
    assert studio.session.source.name == "fake"
    session.stages[5].set()
    assert studio.wait(SECONDS)
    state = studio.state()
    assert (state["scene"], state["settings"], state["version"]) == (key, {"strokes": 5}, 3)
    assert studio.session.source.name == "garden"
    scenes = [(one["id"], one["name"]) for one in studio.choices()["scenes"]]
    assert scenes == [(before, "fake.ply"), (key, "../garden.splat")]
    assert studio.choices()["recent"] == [key, before]
    studio.open_scene(before)
    assert studio.wait(SECONDS)
    assert studio.session.source.name == "fake"
    assert studio.choices()["recent"] == [before, key]


def test_a_scene_that_fails_leaves_the_one_that_is_shown(session, studio, tmp_path):
    before = studio.state()["scene"]
    uploads = tmp_path / "uploads"
    with pytest.raises(ValueError, match=r"^a\.ply: is empty"):
        studio.add_scene("a.ply", BytesIO(b""))
    assert list(uploads.iterdir()) == []
    session.error = SceneError("x", "holds no strokes")
    studio.add_scene("b.splat", BytesIO(SPLAT))
    assert studio.wait(SECONDS)
    assert (studio.state()["scene"], studio.state()["error"]) == (before, "x: holds no strokes")
    session.error = None
    studio.change(Settings(strokes=7))
    assert studio.wait(SECONDS)
    assert studio.session.source.name == "fake"
    for _ in range(MAX_DROPPED - 1):
        studio.add_scene("b.splat", BytesIO(SPLAT))
    with pytest.raises(ValueError, match="at most 8 scenes can be dropped"):
        studio.add_scene("b.splat", BytesIO(SPLAT))
    with pytest.raises(ValueError, match="there is no such scene; reload the page"):
        studio.open_scene("../b.splat")
