"""A part of the scene that is typed in the page: what it may say, and which strokes it finds."""

from pathlib import Path

import numpy as np
import pytest

from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.options.where import Where, WhereConfig
from brushgs.outlets.studio.settings import Settings
from brushgs.outlets.studio.where import MAX_TYPED, Finder, given_in, read_where
from brushgs.pipeline.report import Report
from tests.kit.for_each import for_each
from tests.outlets.studio.conftest import FEW
from tests.outlets.studio.test_session import header_of


def paint(scene, *words):
    """What a session of a command with these words paints."""
    return session_of(parse(["view", str(scene), *FEW, *map(str, words)])).paint(Settings(), Report())


def found(painted, text):
    return Finder().find(painted.prepared, painted.rows, read_where(text))


@for_each(
    ("text", "message"),
    [
        (7, "where must be text"),
        ("x" * (MAX_TYPED + 1), "where must be at most 2,000 characters, got 2,001"),
        ("subjekt", "subject"),
        ("mask:/etc/passwd", "where: mask: reads files, which a page must not name"),
        ("not (subject or mask:a.png)", "where: mask: reads files"),
        ("text:the pear", "where: text: reads files"),
    ],
)
def test_what_cannot_be_or_reads_files_is_refused(text, message):
    with pytest.raises(ValueError, match=message):
        read_where(text)


def test_files_and_regions_that_the_command_line_names_may_be_asked_for(scene, tmp_path):
    mask, cameras = Where.parse("mask:a.png and subject"), Path("cameras.json")
    given = (WhereConfig(Where.parse("subject")), WhereConfig(mask, camera_file=cameras))
    assert read_where("not mask:a.png", given).camera_file == cameras
    with pytest.raises(ValueError, match="mask: reads files"):
        read_where("mask:b.png", given)
    rules = tmp_path / "rules.toml"
    text = 'camera_file = "cameras.json"\n[[region]]\nname = "left"\nwhere = "half:-1,0,0,0"\n'
    rules.write_text(text + '[[region]]\nwhere = "sphere:9,9,9,1 or surroundings"\n')
    painted = paint(scene, "--rules", rules)
    assert header_of(painted.contents)["regions"] == ["left", "region 2"]
    first, second = given_in(painted.config)
    assert str(first.expression) == "half:-1,0,0,0"
    assert second.camera_file == cameras


def test_strokes_are_in_it_where_the_scene_around_them_is(scene):
    painted = paint(scene, "--see", "views")
    across = painted.prepared.whole_scene.means[:, 0]
    middle = float(across.min() + across.max()) / 2
    sides = [found(painted, f"half:{sign},0,0,{sign * middle}") for sign in (1, -1)]
    (coat,), (rows,) = painted.prepared.painting.coats, painted.rows
    across = coat.strokes.means[rows, 0] - middle
    scale = coat.strokes.scales[rows].max(axis=1)
    is_clear = np.abs(across) > 5 * scale  # long strokes are shorter than what they were made of
    assert is_clear.sum() > 20
    np.testing.assert_array_equal(sides[0].columns[0][is_clear], np.where(across[is_clear] > 0, 255, 0))
    total = sides[0].columns[0].astype(int) + sides[1].columns[0]
    assert np.abs(total - 255).max() <= 1
    assert sides[0].total == len(rows)
    assert sides[0].num == np.count_nonzero(sides[0].columns[0] >= 128)
    everything = found(painted, "subject or not subject")
    assert (everything.columns[0] == 255).all()
    assert everything.num == everything.total


def test_what_is_not_painted_is_found_too_and_the_backdrop_is_in_no_part(scene):
    painted = paint(scene, "--where", "half:-1,0,0,0", "--backdrop", "on")
    assert [str(one) for one in given_in(painted.config)] == ["half:-1,0,0,0"]
    (backdrop, coat), (_, rows) = painted.prepared.painting.coats, painted.rows
    assert backdrop.name == "backdrop"
    assert len(rows) > len(coat.strokes) > 0
    everything, right = found(painted, "subject or not subject"), found(painted, "half:1,0,0,0.5")
    assert not everything.columns[0].any()
    assert (everything.columns[1] == 255).all()
    assert everything.num == everything.total == len(rows)
    points = np.concatenate([coat.strokes.means, coat.plain.means])[rows]
    scene = painted.prepared.whole_scene.means
    away = np.linalg.norm(points[:, None].astype(float) - scene, axis=2)
    around = np.argsort(away, axis=1)[:, :8]  # as the eight Gaussians around each are
    np.testing.assert_allclose(right.columns[1], 255 * (scene[around, 0] >= 0.5).mean(axis=1), atol=0.51)
    with pytest.raises(ValueError, match="part:999 is not there; the subject has"):
        found(painted, "part:999")
    assert found(painted, "sphere:900,0,0,1").num == 0
