"""Commands limited to a part of the scene: outside nothing changes, bit for bit."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.errors import SceneWarning
from brushgs.formats.pictures.images import write_frame
from brushgs.options.where import Where, WhereConfig
from brushgs.passes.color.recolor import Palette, recolor
from brushgs.passes.reduce.prune import prune
from brushgs.pipeline.masks import MaskOpener
from brushgs.pipeline.report import Report
from brushgs.pipeline.where import where_in
from brushgs.still_life import still_life_camera
from brushgs.values.gaussians import GAUSSIAN_COLUMNS
from tests.scenes import still_life_of

HALF = "half:1,0,0,0"


@pytest.fixture(scope="module")
def scene():
    return still_life_of(2000)


@pytest.fixture(scope="module")
def file(scene, tmp_path_factory):
    path = tmp_path_factory.mktemp("where") / "scene.ply"
    bg.save(scene, path)
    return path


@pytest.fixture(scope="module")
def stored(file):
    return bg.load(file)


def same(one, other):
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in GAUSSIAN_COLUMNS)


def run(*words):
    assert cli.main([str(word) for word in words]) == 0


def refused(capsys, *words):
    assert cli.main([str(word) for word in words]) == 2
    error = capsys.readouterr().err
    sentences = [line for line in error.splitlines() if "note:" not in line]
    assert len(sentences) == 1, error
    return sentences[0]


def test_prune_drops_only_there(scene):
    inside = scene.means[:, 0] >= 0
    kept = prune(scene, 0.3, among=inside)
    is_in = kept.means[:, 0] >= 0
    assert same(kept.take(~is_in), scene.take(~inside))
    assert is_in.sum() == round(0.3 * inside.sum())
    assert prune(scene, 0.3, among=np.ones(len(scene), bool)).means.shape == prune(scene, 0.3).means.shape


def test_recolor_matches_a_part_as_if_there_were_no_other(scene):
    inside = scene.means[:, 0] >= 0
    palette = Palette.of_colors(np.random.default_rng(0).random((100, 3)))
    found = recolor(scene, palette, shares=inside.astype(float))
    assert same(found.take(~inside), scene.take(~inside))
    np.testing.assert_allclose(
        found.sh[inside], recolor(scene.take(inside), palette).sh, rtol=1e-5, atol=1e-6
    )
    half = recolor(scene, palette, shares=0.5 * inside)
    np.testing.assert_allclose(half.sh[inside], 0.5 * (scene.sh + found.sh)[inside], atol=1e-6)


def test_commands_leave_the_rest_as_it_is(stored, file, tmp_path, capsys):
    inside = stored.means[:, 0] >= 0
    output = tmp_path / "pruned.ply"
    run("prune", file, "--where", HALF, "--keep", "0.5", "-o", output, "--json")
    stage = next(s for s in json.loads(capsys.readouterr().out)["stages"] if s["name"] == "where")
    assert stage["did"] == f"{inside.sum():,} of {len(stored):,} Gaussians in {HALF}"
    pruned = bg.load(output)
    assert np.array_equal(pruned.take(pruned.means[:, 0] < 0).means, stored.means[~inside])
    output = tmp_path / "strokes.ply"
    run("cluster", file, "--where", HALF, "--strokes", "50", "-o", output, "--quiet")
    strokes = bg.load(output)
    rest = strokes.take(slice(-int((~inside).sum()), None))
    assert 40 <= len(strokes) - len(rest) <= 60
    for name in ("means", "sh"):
        assert np.array_equal(getattr(rest, name), getattr(stored, name)[~inside])
    for name in ("quats", "scales", "opacities"):  # the file stores logarithms and logits
        np.testing.assert_allclose(
            getattr(rest, name), getattr(stored.take(~inside), name), rtol=1e-6, atol=1e-7
        )


def test_a_part_without_anything_is_refused_and_all_of_it_is_told(scene, file, tmp_path, capsys):
    output = tmp_path / "out.ply"
    error = refused(capsys, "prune", file, "--where", "sphere:900,0,0,1", "-o", output)
    assert "none of" in error
    assert "sphere:900,0,0,1" in error
    report = Report()
    with pytest.warns(SceneWarning, match="--where sphere:0,0,0,900 changes nothing, since all"):
        where_in(scene, WhereConfig(Where.parse("sphere:0,0,0,900")), None, report)
    assert report.stages[0].skipped == ["limiting to a part: all of the scene lies in it"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--where-soft", "0.1"], "--where-soft needs --where"),
        (["--camera-file", "c.json"], "--camera-file needs --where"),
        (["--where", "mask:m"], "mask:m, which needs --camera-file"),
        (["--where", "cone:1"], "--where must be of the terms box:"),
        (["--where", HALF, "--where-soft", "9"], "where-soft must be 0 to 2, got 9"),
    ],
)
def test_flags_that_need_each_other_say_so(file, tmp_path, capsys, words, sentence):
    assert sentence in refused(capsys, "prune", file, "-o", tmp_path / "out.ply", *words)


def write_mask(path, inside, alpha=None):
    frame = bg.Frame(
        np.repeat(inside.astype(np.float32)[..., None], 3, 2) * (1 if alpha is None else alpha[..., None]),
        np.ones(inside.shape, np.float32) if alpha is None else alpha.astype(np.float32),
    )
    write_frame(frame, path)


def camera_file(path, names=("images/one.jpg", "images/two.jpg")):
    entries = []
    for name, shift in zip(names, (0.0, 0.5), strict=True):
        camera = still_life_camera(width=64, height=48)
        rotation = camera.viewmat[:3, :3].T
        entry = {
            "position": (camera.position + shift * rotation[:, 0]).tolist(),
            "rotation": rotation.tolist(),
            "width": 64,
            "height": 48,
            "fx": camera.K[0, 0],
            "fy": camera.K[1, 1],
        }
        entries.append(entry | ({} if name is None else {"img_name": name}))
    path.write_text(json.dumps(entries))
    return path


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
        MaskOpener(camera_file(tmp_path / "nameless.json", (None, None)))(masks)
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


def test_a_mask_limits_a_command(stored, file, tmp_path, capsys):
    inside = np.zeros((48, 64))
    inside[:, :32] = 1
    write_mask(tmp_path / "one.png", inside)
    cameras = camera_file(tmp_path / "cameras.json")
    words = ["--where", f"mask:{tmp_path / 'one.png'}", "--camera-file", cameras]
    run("prune", file, *words, "--keep", "0.1", "-o", tmp_path / "out.ply", "--quiet")
    kept = bg.load(tmp_path / "out.ply")
    camera = still_life_camera(width=64, height=48)
    x = (stored.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]) @ camera.K.T
    is_right = x[:, 0] / x[:, 2] > 34
    left = {mean.tobytes() for mean in kept.means}
    assert np.mean([mean.tobytes() in left for mean in stored.means[is_right]]) > 0.98
    assert len(kept) < 0.8 * len(stored)
