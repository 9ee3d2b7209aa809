"""Commands limited to a part of the scene: outside nothing changes, bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.pictures.images import read_image
from brushgs.options.where import Where, WhereConfig
from brushgs.pipeline.masks import MaskOpener
from brushgs.pipeline.report import Report
from brushgs.pipeline.where import where_in
from brushgs.still_life import still_life_camera
from brushgs.values.gaussians import GAUSSIAN_COLUMNS
from tests.kit import run, save_opaque, stages_of, write_cameras

HALF = "half:1,0,0,0"


@pytest.fixture(scope="module")
def stored(scene):
    return bg.load(scene)


def assert_stored(found, expected):
    """Means and colors to the bit; the file stores logarithms and logits of the rest."""
    for name in GAUSSIAN_COLUMNS:
        atol = 0 if name in ("means", "sh") else 1e-7
        np.testing.assert_allclose(getattr(found, name), getattr(expected, name), rtol=10 * atol, atol=atol)


def test_commands_leave_the_rest_as_it_is(stored, scene, folder, capsys):
    inside = stored.means[:, 0] >= 0
    prune = ["prune", scene, "--where", HALF, "--keep", "0.5", "-o", "pruned.ply"]
    stage = stages_of(capsys, *prune)["where"]
    assert stage["did"] == f"{inside.sum():,} of {len(stored):,} Gaussians in {HALF}"
    pruned = bg.load("pruned.ply")
    is_in = pruned.means[:, 0] >= 0
    assert_stored(pruned.take(~is_in), stored.take(~inside))
    assert is_in.sum() == pytest.approx(0.5 * inside.sum(), abs=1)
    words = ["cluster", scene, "--where", HALF, "--strokes", "50", "-o", "strokes.ply", "--quiet"]
    assert run(capsys, *words)[0] == 0
    strokes = bg.load("strokes.ply")
    rest = strokes.take(slice(-int((~inside).sum()), None))
    assert 40 <= len(strokes) - len(rest) <= 60
    assert_stored(rest, stored.take(~inside))
    save_opaque("a.png", np.random.default_rng(0).random((9, 12, 3)))
    words = ["recolor", scene, "--where", HALF, "--palette", "a.png", "-o", "colored.ply", "--quiet"]
    assert run(capsys, *words)[0] == 0
    found = bg.load("colored.ply")
    np.testing.assert_array_equal(found.sh[~inside], stored.sh[~inside])
    alone = bg.recolor(stored.take(inside), bg.Palette.of_image(read_image("a.png")))
    np.testing.assert_allclose(found.sh[inside], alone.sh, rtol=1e-5, atol=1e-6)


def test_all_of_a_scene_as_its_part_is_told(stored):
    report = Report()
    with pytest.warns(bg.SceneWarning, match="--where sphere:0,0,0,900 changes nothing, since all"):
        where_in(stored, WhereConfig(Where.parse("sphere:0,0,0,900")), None, report)
    assert report.stages[0].skipped == ["limiting to a part: all of the scene lies in it"]


def camera_file(path, names=("images/one.jpg", "images/two.jpg")):
    first = still_life_camera(width=64, height=48)
    aside = first.viewmat - np.array([[0, 0, 0, 0.5], *np.zeros((3, 4))])
    return write_cameras(path, [first, replace(first, viewmat=aside)], names)


def write_mask(path, inside):
    save_opaque(path, np.repeat(inside[..., None], 3, axis=2))


def test_masks_belong_to_cameras_by_name_or_by_order(tmp_path):
    masks = tmp_path / "masks"
    masks.mkdir()
    left = np.zeros((96, 128))
    left[:, :64] = 1
    write_mask(masks / "two.png", left)
    named = MaskOpener(camera_file(tmp_path / "named.json"))
    (view,) = named(masks)
    assert (view.camera.width, view.camera.height) == (128, 96)
    np.testing.assert_array_equal(view.inside, left)
    first, second = named._cameras.cameras
    np.testing.assert_allclose(view.camera.viewmat, second.viewmat)
    assert view.camera.K[0, 0] == pytest.approx(2 * second.K[0, 0])
    with pytest.raises(bg.SceneError, match=r"1 masks for the 2 cameras of nameless\.json; name each"):
        MaskOpener(camera_file(tmp_path / "nameless.json", ()))(masks)
    write_mask(masks / "10.png", 1 - left)
    with pytest.raises(bg.SceneError, match=r"10\.png.*has no camera of this name"):
        named(masks)
    (masks / "two.png").rename(masks / "9.png")
    views = MaskOpener(tmp_path / "nameless.json")(masks)
    np.testing.assert_allclose([v.camera.viewmat for v in views], [first.viewmat, second.viewmat])
    np.testing.assert_array_equal(views[0].inside, left)


def test_masks_that_cannot_be_are_refused(tmp_path):
    opener = MaskOpener(camera_file(tmp_path / "c.json"))
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(bg.SceneError, match="holds no masks; put pictures in it"):
        opener(empty)
    write_mask(tmp_path / "one.png", np.zeros((64, 64)))
    with pytest.raises(bg.SceneError, match="has other sides than its camera: 64x64, its camera 64x48"):
        opener(tmp_path / "one.png")
    with pytest.raises(bg.SceneError, match=r"two\.png"):
        opener(tmp_path / "two.png")


def test_a_mask_limits_a_command(stored, scene, folder, capsys):
    inside = np.zeros((48, 64))
    inside[:, :32] = 1
    write_mask(folder / "one.png", inside)
    cameras = camera_file(folder / "cameras.json")
    words = ["--where", "mask:one.png", "--camera-file", cameras, "--keep", "0.1", "-o", "out.ply"]
    assert run(capsys, "prune", scene, *words, "--quiet")[0] == 0
    kept = bg.load("out.ply")
    camera = still_life_camera(width=64, height=48)
    x = (stored.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]) @ camera.K.T
    is_right = x[:, 0] / x[:, 2] > 34
    left = {mean.tobytes() for mean in kept.means}
    assert np.mean([mean.tobytes() in left for mean in stored.means[is_right]]) > 0.98
    assert len(kept) < 0.8 * len(stored)
