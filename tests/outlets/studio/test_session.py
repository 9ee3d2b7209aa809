"""From settings to a painting, and from views of it to files that are never overwritten."""

import gzip
import json
import struct
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import strokes_folder
from brushgs.cli import main
from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.pictures.images import read_image
from brushgs.formats.pictures.metadata import read_metadata
from brushgs.options.viewer import FilmConfig
from brushgs.outlets.studio.session import Dropped, reserve
from brushgs.outlets.studio.settings import Film, Settings, Shot
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_file
from tests.io.test_video import read
from tests.outlets.studio.conftest import FEW

OTHERS = ["--backdrop", "off", "--see", "off"]  # of the command line


def header_of(contents):
    content = gzip.decompress(contents)
    (length,) = struct.unpack("<I", content[8:12])
    return json.loads(content[12 : 12 + length])


@pytest.fixture(scope="module")
def painted(scene, tmp_path_factory):
    """A session, and its first painting."""
    session = session_of(parse(["view", str(scene), *FEW, "-o", str(tmp_path_factory.mktemp("out"))]))
    return session, session.paint(Settings(), Report())


def anew(session, settings):
    """What settings paint, and the stages that were gone through."""
    before = dict(session.made)
    painted = session.paint(settings, Report())
    return painted, {step for step, count in session.made.items() if count > before.get(step, 0)}


def test_the_first_painting_is_that_of_the_command_line(painted):
    _, first = painted
    assert header_of(first.contents)["command"]["options"] == ["--strokes", "120", *OTHERS]
    assert first.facts["look"] == "oil"
    assert first.facts["strokes"] == len(first.prepared.strokes) <= 120


def test_relief_lamp_and_brush_make_no_strokes_anew(painted):
    session, first = painted
    lit, made = anew(session, Settings(relief=0.9, lamp=(20, 60), stroke="dab"))
    assert {"own_brushes", "site", "key"} <= made
    assert made.isdisjoint({"read", "cleaned", "first_view", "plain_views", "pruned", "cluster", "repaint"})
    np.testing.assert_array_equal(lit.prepared.strokes.means, first.prepared.strokes.means)
    header = header_of(lit.contents)
    assert [brush["name"] for brush in header["brushes"]] == ["dab"]
    assert header["command"]["options"][-6:] == ["--stroke", "dab", "--relief", "0.9", "--lamp", "20,60"]
    assert (lit.facts["relief"], lit.facts["lamp"], lit.facts["stroke"]) == (0.9, [20, 60], "dab")


def test_another_number_makes_strokes_anew_of_the_scene_as_it_was_loaded(painted):
    session, _ = painted
    session.paint(Settings(), Report())
    fewer, made = anew(session, Settings(strokes=40))
    assert made.isdisjoint({"read", "cleaned", "first_view", "plain_views"})
    assert "cluster" in made
    header = header_of(fewer.contents)
    assert sum(coat["count"] for coat in header["coats"]) == fewer.facts["strokes"] <= 40
    assert header["command"]["options"] == [*OTHERS, "--strokes", "40"]  # not twice


def test_a_change_paints_what_its_command_paints(painted, scene, tmp_path):
    session, _ = painted
    changed = session.paint(Settings(look="gouache", strokes=60, keep=0.8), Report())
    options = header_of(changed.contents)["command"]["options"]
    words = ["render", str(scene), *options, "--size", "96x72", "-o", str(tmp_path / "a.png")]
    assert main([*words, "--quiet"]) == 0
    shot = Shot(changed.prepared.camera)
    path = session.shoot(changed, shot, Report())
    assert np.array_equal(read_image(path), read_image(tmp_path / "a.png"))
    command = read_metadata(path).command
    assert command.startswith(f"brushgs render {scene.name} ")
    assert "--look gouache" in command
    assert read_metadata(replace(session, writes_metadata=False).shoot(changed, shot, Report())) is None


def test_a_dropped_picture_is_a_brush_or_a_palette_and_is_called_as_it_was(painted, scene, tmp_path):
    session, first = painted
    paint_file(session.source, tmp_path / "picture.png", first.config)
    session.dropped = {"id1": Dropped("my brush.png", tmp_path / "picture.png")}
    with pytest.warns(SceneWarning, match="the stroke image has no empty margin"):
        own = session.paint(Settings(stroke="id1", palette="id1"), Report())
    assert header_of(own.contents)["command"]["options"][-4:] == [
        "--stroke", "my brush.png", "--palette", "my brush.png"
    ]  # fmt: skip
    assert own.facts["palette"] == 1
    assert not np.array_equal(own.prepared.strokes.sh, first.prepared.strokes.sh)
    words = ["--palette", str(tmp_path / "picture.png"), "--palette-strength", "50%"]
    with_palette = session_of(parse(["view", str(scene), *FEW, *words]))
    assert with_palette.config(Settings()).palette is not None
    assert with_palette.config(Settings(palette="none")).palette is None
    assert with_palette.options({"palette.file": None}) == ["--strokes", "120", *OTHERS]


def test_a_file_has_the_next_free_number_and_keeps_others(painted, tmp_path):
    session, first = painted
    session = replace(session, folder=tmp_path)
    (tmp_path / "pears-oil-1.png").write_text("mine")
    (tmp_path / "pears-oil-3.png").write_text("mine too")
    shot = Shot(first.prepared.camera.resized(40, 30))
    names = [session.shoot(first, shot, Report()).name for _ in range(3)]
    assert names == ["pears-oil-2.png", "pears-oil-4.png", "pears-oil-5.png"]
    assert (tmp_path / "pears-oil-1.png").read_text() == "mine"
    assert (tmp_path / "pears-oil-3.png").read_text() == "mine too"
    assert read_image(tmp_path / "pears-oil-2.png").shape[:2] == (30, 40)


def test_a_picture_that_fails_frees_its_name_and_a_bad_folder_is_named(painted, tmp_path, monkeypatch):
    session, first = painted
    session = replace(session, folder=tmp_path / "missing")
    monkeypatch.setattr("brushgs.pipeline.still.paint_view", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        session.shoot(first, Shot(first.prepared.camera), Report())
    assert list((tmp_path / "missing").iterdir()) == []
    (tmp_path / "file").touch()
    with pytest.raises(SceneError, match="file: the folder cannot be made"):
        reserve(tmp_path / "file", "a", ".png")


def test_a_turn_and_a_path_through_views_are_videos(painted, tmp_path):
    session, first = painted
    session = replace(session, folder=tmp_path)
    camera = first.prepared.camera.resized(64, 48)
    shift = np.eye(4)
    shift[0, 3] = 0.2
    keys = [camera, replace(camera, viewmat=shift @ camera.viewmat)]
    path = session.film(first, Film(FilmConfig("path", 2, 64, 48, fps=1), keys), Report())
    frames, _, _ = read(path)
    assert (path.name, len(frames), frames[0].shape) == ("pears-oil-1.mp4", 3, (48, 64, 3))
    assert not np.array_equal(frames[0], frames[2])
    center = tuple(header_of(first.contents)["center"])
    turn = session.film(first, Film(FilmConfig("turn", 1, 64, 48, fps=4), [camera], center), Report())
    assert len(read(turn)[0]) == 4
    assert read_metadata(turn).command.startswith("brushgs render pears")


@pytest.fixture
def saving(scene, tmp_path):
    """Words of a command that saves, and its file."""
    file = tmp_path / "mine.toml"
    return ["view", str(scene), *FEW, "--relief", "0.1", "--save", str(file)], file


def test_saved_options_go_on_where_a_killed_server_was(saving, tmp_path):
    words, file = saving
    odd = 'a\x7f"\\ü\U0001f58c.png'
    session_of(parse([*words[:2], "--stroke", odd, *words[2:]])).saved.write({}, [])
    assert tomllib.loads(file.read_text(encoding="utf-8"))["stroke"] == odd
    with pytest.raises(SceneError, match=r"mine.toml: exists; add --config .* to go on with it"):
        session_of(parse(words))
    with pytest.raises(ValueError, match=r"save must name a \.toml file, got 'mine.png'"):
        session_of(parse([*words[:-1], str(file.with_suffix(".png"))]))
    file.unlink()
    session = session_of(parse(words))
    assert not file.exists()  # nothing was changed
    settings = Settings(look="gouache", stroke_size=20, relief=0.75, lamp=(20, 60), keep=0.5)
    session.save(settings)
    session.save(settings)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]
    again = parse(["view", words[1], "--config", str(file), "--save", str(file)])
    assert session_of(again).config(Settings()) == session.config(settings)
    assert parse(["render", words[1], "--config", str(file)]).look == "gouache"


def test_a_dropped_picture_is_saved_beside_the_options(saving, tmp_path):
    words, file = saving
    session = session_of(parse(words))
    dropped = tmp_path / "dropped"
    dropped.write_bytes((strokes_folder() / "swirl.png").read_bytes())
    session.dropped = {"id1": Dropped("../my brush.PNG", dropped)}
    session.save(Settings(stroke="id1", palette="id1"))
    dropped.unlink()  # with the folder of a killed server
    config = session_of(parse(["view", words[1], "--config", str(file)])).config(Settings())
    assert config.draw.stroke == str(tmp_path / "mine-id1.png")
    assert config.palette.file == tmp_path / "mine-id1.png"
    read_image(tmp_path / "mine-id1.png")
