"""What the page makes of a scene is what passes of `brushgs` make of it; both refuse the same files."""

import base64
import random
import warnings
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs import cli
from brushgs.brushes.texture import without_number
from brushgs.cameras.framing import AXES, camera_axes, fit_eye
from brushgs.first_view import find_first_view
from brushgs.formats.pictures.images import read_image
from brushgs.formats.scenes.spz import open_scene
from brushgs.outlets.page.contents import coarse_to_fine
from brushgs.outlets.painter import build
from brushgs.outlets.painter.page import BRUSHES, LOOKS
from brushgs.passes.add.backdrop import Tone, ground_color
from brushgs.passes.add.stage import find_site, open_stage
from brushgs.passes.add.stage_ground import BAND
from brushgs.passes.add.stage_paint import Brushwork, painted_stage
from brushgs.passes.color.broken_color import CHROMA, LIGHTNESS
from brushgs.passes.color.pigments import use_pigments
from brushgs.passes.color.tone import grade
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.choose_brushes import GROUPS
from brushgs.passes.reduce.crumbs import find_crumbs
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.pipeline.look import open_relief
from brushgs.rendering.options import RenderOptions
from brushgs.values.colors import oklab_of
from brushgs.values.sh import C0
from tests.brushes.test_texture import write_image
from tests.first_view.scenes import about, moved, on_a_plaza, statue
from tests.fuzz import corpus
from tests.fuzz.mutate import mutate
from tests.io.scenes import spz_format
from tests.kit.for_each import for_each
from tests.outlets.painter.conftest import wait_until
from tests.passes.add.test_stage import crate, plaza
from tests.passes.reduce.test_crumbs import block, smears
from tests.scenes import still_life_of

NUM_STROKES = 300
DONE = "!window.brushgs.dropping.isBusy"
STATE = "document.getElementById('dropState').textContent"
COLUMNS_OF_STROKES = ("means", "quats", "scales", "opacities", "sh")
PICTURE = """window.brushgs.picture().then((blob) => blob.arrayBuffer())
    .then((bytes) => btoa(Array.from(new Uint8Array(bytes), (byte) => String.fromCharCode(byte)).join("")))"""


def dropped(page, path, count=None, *, stage=True):
    """Give the page a file, and wait until it is painted, in so many strokes, or refused."""
    if count is not None:
        ask_for(page, count)
    page.evaluate(
        """(has) => {
      const { looks } = window.brushgs.dropping._blank.header.painter;
      for (const look of Object.values(looks)) {
        look.kept ??= look.stage;
        look.stage = has ? look.kept : null;
      }
    }""",
        stage,
    )
    page.set_input_files("#dropFile", path)
    wait_until(page, DONE)


def drop_quince(page, folder):
    bg.save(still_life_of(1000), folder / "quince.ply")
    dropped(page, folder / "quince.ply")


def choose(page, field, value):
    page.select_option(field, value)
    wait_until(page, DONE)


def strokes_in(page, coat="strokes"):
    script = """(coat) => Object.fromEntries(
        Object.entries(window.brushgs.contents.header.coats.find(({ name }) => name === coat).arrays)
        .map(([name, array]) => [name, Array.from(window.brushgs.contents.arrays[array])]))"""
    columns = page.evaluate(script, coat)
    count = len(columns["opacities"])
    return {name: np.array(values).reshape(count, -1) for name, values in columns.items()}


def picture_of(page, folder):
    (folder / "page.png").write_bytes(base64.b64decode(page.evaluate(PICTURE)))
    return read_image(folder / "page.png")


def sharp_picture_of(page, folder):
    """Of the first view, after the levels of all brushes were made."""
    page.evaluate("""() => {
      window.brushgs.isPaused = false;
      window.brushgs.controls.jump(window.brushgs.controls.orbit.first);
    }""")
    page.wait_for_timeout(2000)
    picture = picture_of(page, folder)
    page.evaluate("window.brushgs.isPaused = true")
    return picture


def ask_for(page, count):
    page.evaluate(f"document.getElementById('dropCount').value = Math.log({count})")


def strokes_of_passes(path, count):
    """The cleaned scene, and its strokes before their colors are broken and after."""
    gaussians = bg.clean(bg.load(path))
    kept = bg.prune(gaussians, at_least=count)
    merged = bg.cluster(kept, count)
    solid = bg.solidify(merged.take(worth_keeping(merged)) if len(kept) > count else merged)
    plain = bg.orient(solid, kept)
    return gaussians, kept, plain, bg.break_colors(plain, follows=1)


def compared(page, gaussians, plain, strokes):
    """Assert that the page has these strokes, but for their broken color; returns its shifts and theirs."""
    rows = coarse_to_fine(strokes)
    rows = rows[strokes.opacities[rows] >= 1 / 255]
    found = strokes_in(page)
    expected = {name: getattr(strokes, name)[rows].reshape(len(rows), -1) for name in COLUMNS_OF_STROKES}
    expected["means"] = expected["means"] - robust_frame(gaussians.means)[0]
    assert len(found["means"]) == len(rows)
    # q and -q are one rotation
    found["quats"] *= np.sign(np.sum(found["quats"] * expected["quats"], axis=1, keepdims=True))
    before, shifted = (one.sh[rows, 0].astype(np.float64) for one in (plain, strokes))
    shifts = found["sh"][:, :3] - before, shifted - before
    expected["sh"], found["sh"] = expected["sh"][:, 3:], found["sh"][:, 3:]
    for name, values in expected.items():
        # Measured: one step of float32 in 2000 strokes of koala, as exp and log round apart from NumPy's, and
        # 0.007 of a quaternion in truck, where two axes are equally long.
        tolerance = 0.01 if name == "quats" else 2e-6
        np.testing.assert_allclose(found[name], values, rtol=tolerance, atol=tolerance, err_msg=name)
    return shifts


@for_each("suffix", [".ply", ".splat", ".spz"])
def test_strokes_are_those_of_an_unguided_painting(painter, tmp_path, suffix):
    """The scene has floaters, Gaussians that are pruned, and strokes that are not worth keeping."""
    path = tmp_path / f"pears{suffix}"
    fruit = still_life_of(4000)
    specks = fruit.take(slice(0, 100))
    specks = replace(specks, means=5 * specks.means + 10, opacities=np.full(100, 0.2, np.float32))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a .splat loses what depends on the view
        bg.save(bg.Gaussians.joined([fruit, specks]), path)
    dropped(painter, path, NUM_STROKES, stage=False)
    gaussians, kept, plain, strokes = strokes_of_passes(path, NUM_STROKES)
    assert len(bg.load(path)) > len(gaussians) > len(kept)
    assert len(strokes) > 0.9 * NUM_STROKES
    found, expected = compared(painter, gaussians, plain, strokes)
    # A hash of the position decides the shift of a color: where that rounds to another float32, as 8 of 10
    # do here, there is another one of the same distribution.
    is_same = (np.abs(found - expected) < 2e-6).all(axis=1)
    assert is_same.mean() > 0.1
    np.testing.assert_allclose(found.std(axis=0), expected.std(axis=0), rtol=0.25)
    assert np.abs(found.mean(axis=0)).max() < 0.1 * expected.std()


@for_each("look", [name for name in LOOKS if name != "plain"])
def test_a_look_has_its_colors_brushes_ground_and_number_of_strokes(painter, tmp_path, look):
    path = tmp_path / "pears.ply"
    bg.save(still_life_of(4000), path)
    dropped(painter, path, stage=False)
    choose(painter, "#dropLook", look)
    config = bg.Look.open(look).config
    assert painter.evaluate("window.brushgs.dropping.strokes") == config.cluster.strokes.count
    dropped(painter, path, NUM_STROKES, stage=False)
    gaussians, _, plain, _ = strokes_of_passes(path, NUM_STROKES)
    color, lightness, ground = config.color, config.strokes.broken_color, config.ground
    names = ("chroma", "contrast", "pivot", "shadows", "lights")
    colored = grade(plain, **{name: getattr(color, name) for name in names})
    if color.pigments:
        colored = use_pigments(colored, color.pigments, share=color.pure)
    strokes = bg.break_colors(colored, lightness, lightness / LIGHTNESS * CHROMA, follows=1)
    found, expected = compared(painter, gaussians, colored, strokes)
    np.testing.assert_allclose(found.std(axis=0), expected.std(axis=0), rtol=0.25)
    assert np.abs(found.mean(axis=0)).max() < 0.2 * expected.std()
    kit = bg.BrushKit(**{group: getattr(config.brushes, group) for group in GROUPS})
    rows = bg.choose_brushes(strokes, kit, material=1).brushes
    own = [BRUSHES.index(without_number(name)) for name in kit.images]
    shares, of_page = (
        np.bincount(one, minlength=len(BRUSHES)) / len(rows)
        for one in (np.array(own)[rows], strokes_in(painter)["brush"][:, 0].astype(int))
    )
    np.testing.assert_allclose(of_page, shares, atol=0.1)  # they are chosen by hashes of places
    assert ((shares > 0.05) <= (of_page > 0)).all()
    if ground.ground == "toned":
        toned = ground_color(gaussians, Tone(ground.lightness, ground.complement, ground.warmth))
        surface = painter.evaluate("window.brushgs.contents.header.surface")
        np.testing.assert_allclose(surface["color"], toned, atol=1e-6)
    choose(painter, "#dropLook", "oil")


@for_each("version, degree", [(1, 0), (2, 1), (3, 2), (3, 4), (4, 0), (4, 2), (4, 4)])
@for_each("axes", [0, 3, 5, 9, 16])
def test_spz_of_every_version_and_handedness_is_read(painter, tmp_path, version, degree, axes):
    made = spz_format.make(64, degree)
    made["log_scales"] = np.random.default_rng(0).uniform(-3, -1, (64, 3))
    record = spz_format.record(spz_format.COORDINATE_SYSTEM, axes.to_bytes(4, "little"))
    path = tmp_path / "odd.spz"
    path.write_bytes(spz_format.encode(made, version, extensions=record, packed=axes != 9))
    ask_for(painter, NUM_STROKES)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # few rows have a degree of 4
        dropped(painter, path, stage=False)
        gaussians, _, plain, strokes = strokes_of_passes(path, NUM_STROKES)
        up = open_scene(path).up
    compared(painter, gaussians, plain, strokes)
    if axes:
        assert painter.evaluate("document.getElementById('dropUp').value") == up


def framed_in(page, view):
    """[2], [2] bounds of what a first view frames, in shares of the picture of the page."""
    camera = page.evaluate("window.brushgs.contents.header.camera")
    viewmat, K = np.reshape(camera["viewmat"], (4, 4)), np.reshape(camera["K"], (3, 3))
    seen = (view.points @ viewmat[:3, :3].T + viewmat[:3, 3]) @ K.T
    places = seen[:, :2] / seen[:, 2:] / (camera["width"], camera["height"])
    return places.min(axis=0), places.max(axis=0)


def test_a_subject_is_framed_without_its_surroundings(painter, tmp_path):
    scene = on_a_plaza()
    bg.save(scene, tmp_path / "plaza.ply")
    dropped(painter, tmp_path / "plaza.ply", NUM_STROKES)
    view = find_first_view(bg.clean(scene))
    assert view.has_surroundings
    low, high = framed_in(painter, view)
    assert (high - low).max() > 0.75
    assert low[1] > 0.09
    assert high.max() < 1


def whole_scene(scene, view, path):
    """The scene without crumbs, saved."""
    whole = scene.take(~find_crumbs(scene, view))
    bg.save(whole, path)
    return whole


def test_crumbs_below_an_object_are_dropped_with_the_axis_that_is_up(painter, tmp_path):
    scene = bg.Gaussians.joined([block(), smears()])
    path = tmp_path / "block.ply"
    bg.save(scene, path)
    dropped(painter, path, NUM_STROKES, stage=False)
    for up, is_clean in (("+z", True), ("+x", False), ("+z", True)):
        choose(painter, "#dropUp", up)
        assert painter.evaluate("window.brushgs.contents.header.up") == list(AXES[up])
        down = painter.evaluate("window.brushgs.contents.header.camera.viewmat")[4:7]
        assert np.dot(down, AXES[up]) < -0.9
        whole = whole_scene(scene, find_first_view(scene, up=up), tmp_path / "whole.ply")
        assert len(whole) == len(scene) - (12 if is_clean else 0)
        found = strokes_in(painter)["means"] + painter.evaluate("window.brushgs.contents.header.origin")
        *_, plain, _ = strokes_of_passes(tmp_path / "whole.ply", NUM_STROKES)
        np.testing.assert_allclose(found, plain.means[coarse_to_fine(plain)], atol=1e-6)


def test_the_first_view_is_upright_and_from_the_front(painter, tmp_path):
    for turn in (np.eye(3), about((1, 0, 0), 90) @ about((0, 1, 0), 100)):
        scene = moved(statue(), rotation=turn)
        bg.save(scene, tmp_path / "statue.ply")
        dropped(painter, tmp_path / "statue.ply")
        view = find_first_view(bg.clean(scene))
        name = painter.evaluate("document.getElementById('dropUp').value")
        assert AXES[name] == tuple(np.rint(view.up))
        axes = np.reshape(painter.evaluate("window.brushgs.contents.header.camera.viewmat"), (4, 4))[:3, :3]
        expected = camera_axes(view.up, view.azimuth, view.elevation)
        np.testing.assert_allclose(axes, expected, atol=1e-6)
        camera = painter.evaluate("window.brushgs.contents.header.camera")
        tangents = 0.5 * np.array([1280, 0.91 * 720]) / camera["K"][0]  # below the fields of the page
        place, distance = fit_eye(view.points @ expected.T, tangents)
        rise = 0.09 * 0.5 * 720 / camera["K"][0] * distance
        shift = np.reshape(camera["viewmat"], (4, 4))[:3, 3]
        # Hulls of many points, which views keep, lack some: 0.0007 was measured.
        np.testing.assert_allclose(shift, -place + (0, rise, 0), atol=2e-3)
        low, high = framed_in(painter, view)
        assert low[1] > 0.09 + 0.04
        assert 0.96 < high[1] < 0.98


def test_the_page_offers_its_brushes_and_shows_the_name_of_the_scene(painter, tmp_path):
    drop_quince(painter, tmp_path)
    options = painter.evaluate("Array.from(document.getElementById('brush').options, (one) => one.text)")
    assert tuple(options[1:]) == BRUSHES
    assert "quince" in painter.evaluate("document.getElementById('painting').getAttribute('aria-label')")
    assert painter.evaluate("document.getElementById('drop').hidden")
    picture = picture_of(painter, tmp_path)[..., :3]
    middle = picture[60:-60, 80:-80]  # of linen alone all of it deviates by 0.02
    assert middle.std(axis=(0, 1)).max() > 0.05


def test_paint_has_the_relief_of_oil_and_a_lamp_that_moves(painter, tmp_path):
    bg.save(still_life_of(1000), tmp_path / "quince.ply")
    ask_for(painter, NUM_STROKES)
    dropped(painter, tmp_path / "quince.ply", stage=False)
    _, _, plain, _ = strokes_of_passes(tmp_path / "quince.ply", NUM_STROKES)
    rows = coarse_to_fine(plain)
    found = strokes_in(painter)
    assert len(found["relief"]) == len(plain)  # none is too faint
    sh = plain.sh.copy()
    sh[rows] = found["sh"].reshape(sh.shape)  # broken color of the page
    relief = open_relief(bg.Look.open("oil").config.light)
    np.testing.assert_allclose(found["relief"], relief.of_strokes(replace(plain, sh=sh))[rows], rtol=1e-5)
    before = painter.evaluate(PICTURE)
    painter.evaluate("""() => {
      document.getElementById("dropAround").value = 20;
      document.getElementById("dropHeight").value = 30;
      document.getElementById("dropHeight").dispatchEvent(new Event("input"));
    }""")
    lamp = painter.evaluate("window.brushgs.contents.header.lamp")
    expected = bg.Lamp(np.radians(20), np.radians(30))
    np.testing.assert_allclose(lamp["direction"], expected.direction, atol=1e-12)
    np.testing.assert_allclose(lamp["halfWay"], expected.half_way, atol=1e-12)
    assert painter.evaluate("window.brushgs.contents.header.command.options")[-1] == "20,30"
    assert painter.evaluate(PICTURE) != before


def test_a_plain_painting_has_no_lamp_and_is_saved_as_a_page_of_its_own(painter, open_page, tmp_path):
    drop_quince(painter, tmp_path)
    for look in ("plain", "oil"):
        choose(painter, "#dropLook", look)
        assert (painter.evaluate("window.brushgs.contents.header.lamp") is None) == (look == "plain")
        assert painter.evaluate("document.querySelector('.of-lamp').hidden") == (look == "plain")
        with painter.expect_download() as download:
            painter.evaluate("document.getElementById('dropSave').click()")
        saved = tmp_path / f"{look}.html"
        download.value.save_as(saved)
        page = open_page(saved)
        wait_until(page, "window.brushgs.firstPictureMs !== null")
        page.evaluate("window.brushgs.controls.setTurning(false)")
        assert page.title() == "quince"
        assert page.evaluate("document.getElementById('dropFields')") is None
        for name, values in strokes_in(painter).items():
            np.testing.assert_array_equal(strokes_in(page)[name], values)
        both = [sharp_picture_of(tab, tmp_path) for tab in (page, painter)]
        np.testing.assert_allclose(*both, atol=1 / 255 + 1e-6)


def test_after_a_refusal_the_scene_before_can_be_painted_anew(painter, tmp_path):
    drop_quince(painter, tmp_path)
    (tmp_path / "odd.ply").write_bytes(b"no scene at all")
    dropped(painter, tmp_path / "odd.ply")
    assert painter.evaluate(STATE).startswith("odd.ply: is neither a PLY nor a .splat or SPZ")
    painter.evaluate("document.getElementById('dropCancel').click()")
    assert painter.evaluate("document.getElementById('drop').hidden")
    ask_for(painter, 200)
    painter.dispatch_event("#dropCount", "change")
    wait_until(painter, DONE)
    assert 180 <= len(strokes_in(painter)["means"]) <= 200


def test_what_goes_on_can_be_cancelled(painter, tmp_path):
    drop_quince(painter, tmp_path)
    before = len(strokes_in(painter)["means"])
    ask_for(painter, 900)
    painter.evaluate("""() => {
      document.getElementById('dropCount').dispatchEvent(new Event('change'));
      document.getElementById('dropCancel').click();
    }""")
    wait_until(painter, DONE)
    assert painter.evaluate("document.getElementById('drop').hidden")
    assert len(strokes_in(painter)["means"]) == before


def ply(*lines, rows=b""):
    return "\n".join(["ply", "format binary_little_endian 1.0", *lines, "end_header", ""]).encode() + rows


NAMES = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
COLUMNS = [f"property float {name}" for name in NAMES.split()]
LATEST = spz_format.encode(spz_format.make(9), 4)
REFUSED = {
    "empty.ply": b"",
    "cut.ply": ply("element vertex 9", *COLUMNS, rows=bytes(100)),
    "none.ply": ply("element vertex 0", *COLUMNS),
    "header.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n",
    "count.ply": ply("element vertex -3", *COLUMNS),
    "type.ply": ply("element vertex 3", "property half x"),
    "twice.ply": ply("element vertex 3", *COLUMNS, COLUMNS[0]),
    "points.ply": ply("element vertex 1", *COLUMNS[:3], rows=bytes(12)),
    "lacks.ply": ply("element vertex 1", *COLUMNS[:-1], rows=bytes(52)),
    "bands.ply": ply("element vertex 1", *COLUMNS, "property float f_rest_0", rows=bytes(60)),
    "odd.splat": bytes(range(200, 233)) * 3,
    "cut.spz": spz_format.encode(spz_format.make(9), 3, packed=False)[:-1],
    "head.spz": b"NGSP\3\0\0",
    "head_4.spz": LATEST[:24],
    "cut_4.spz": LATEST[:-1],
    "table.spz": LATEST[:16] + b"\xff\xff\0\0" + LATEST[20:],
    "streams.spz": LATEST[:15] + b"\7" + LATEST[16:],
    "sizes.spz": LATEST[:40] + b"\1" + LATEST[41:],
    "future.spz": b"NGSP\7\0\0\0" + bytes(8),
    "none.spz": b"NGSP\3\0\0\0" + bytes(8),
    "degree.spz": b"NGSP\3\0\0\0\1\0\0\0\5\0\0\0",
    "bits.spz": b"NGSP\3\0\0\0\1\0\0\0\0\x63\0\0",
    "tree.spz": b"NGSP\3\0\0\0\1\0\0\0\0\0\x80\0",
    "huge.spz": b"NGSP\3\0\0\0\0\0\0\1" + bytes(99),
}


@for_each("name", REFUSED)
def test_what_load_refuses_the_page_refuses_in_the_same_words(painter, tmp_path, name):
    path = tmp_path / name
    path.write_bytes(REFUSED[name])
    with pytest.raises(bg.SceneError) as refusal:
        bg.load(path)
    dropped(painter, path)
    assert painter.evaluate(STATE) == str(refusal.value).replace(str(path), name)


def test_a_subject_stands_on_the_stage_that_the_command_makes(painter, tmp_path):
    """The random numbers of its strokes are others, so places and colors are compared as a whole."""
    path = tmp_path / "crate.ply"
    bg.save(crate() + plaza(), path)
    dropped(painter, path, NUM_STROKES)
    view = find_first_view(crate() + plaza())
    scene = whole_scene(crate() + plaza(), view, tmp_path / "whole.ply")
    *_, plain, _ = strokes_of_passes(tmp_path / "whole.ply", NUM_STROKES)
    facts = painter.evaluate("window.brushgs.contents.header")
    camera = bg.Camera(
        *(np.reshape(facts["camera"][name], (n, n)) for name, n in (("viewmat", 4), ("K", 3))), 1280, 720
    )
    stage = open_stage(find_site(scene, view), plain, [camera], values=1.0)
    assert stage.ground is not None
    strokes, own = strokes_in(painter, "backdrop"), strokes_in(painter)
    points = stage.place.local(strokes["means"] + facts["origin"])
    rho = np.hypot(points[:, 0], points[:, 2])
    size = stage.place.radius
    is_cove = rho < 0.98 * stage.surface.wall
    heights = np.interp(rho[is_cove], stage.surface.rho, stage.surface.height)
    np.testing.assert_allclose(points[is_cove, 1], heights, atol=1e-2 * size)
    usual = Brushwork(1.8)
    expected = painted_stage(stage, usual, [camera])
    assert len(points) == pytest.approx(len(expected), rel=0.05)
    for rows, of_page in ((strokes["sh"], points), (expected.sh[:, 0], stage.place.local(expected.means))):
        lab = oklab_of(np.clip(0.5 + C0 * rows, 0, 1))
        near = np.hypot(of_page[:, 0], of_page[:, 2]) < 1.2 * size
        wall = of_page[:, 1] > size
        parts = [np.median(lab[part], axis=0) for part in (near, wall)]
        if rows is strokes["sh"]:
            found = parts
    np.testing.assert_allclose(found, parts, atol=0.02)
    heights = stage.place.local(own["means"] + facts["origin"])[:, 1]
    assert heights.min() > -1.1 * BAND * size  # nothing is left below the table


def picture_file(folder, kind, seed=0):
    """A stroke of bristles, cut out or dark on light paper, with an empty margin."""
    g = np.random.default_rng(seed)
    rows, columns = 90, 300
    v, u = np.mgrid[-1 : 1 : 1j * rows, -1 : 1 : 1j * columns]
    bristles = np.clip(1.2 - (1.3 * u) ** 4 - (1.5 * v) ** 2, 0, 1) * g.uniform(0.4, 1, (rows, 1))
    path = folder / f"{kind}.png"
    if kind == "cut_out":
        light = np.rint(255 * g.uniform(0, 1, (rows, columns, 1))) / 255
        write_image(path, np.concatenate([np.repeat(light, 3, axis=2), bristles[..., None]], axis=2))
    else:
        write_image(path, np.repeat(1 - 0.8 * bristles[..., None], 3, axis=2))
    return path


@for_each("kind", ["cut_out", "on_paper"])
@for_each("look", ["oil", "plain"])
def test_a_dropped_picture_is_the_brush_that_stroke_makes_of_it(painter, open_page, tmp_path, kind, look):
    drop_quince(painter, tmp_path)
    choose(painter, "#dropLook", look)
    path = picture_file(tmp_path, kind)
    before = painter.evaluate(PICTURE)
    painter.set_input_files("#dropFile", path)
    wait_until(painter, "window.brushgs.dropping._brush !== null")
    texture = bg.StrokeTexture.open(path)
    brush, coat = painter.evaluate("""() => {
      const { header, arrays } = window.brushgs.contents, [brush] = header.brushes;
      const [coverage, height] = [brush.coverage, brush.height].map((name) => name && [...arrays[name]]);
      return [{ ...brush, coverage, height }, header.coats.at(-1)];
    }""")
    assert (brush["name"], brush["rows"], brush["columns"]) == (kind, *texture.coverage.shape)
    found = np.reshape(brush["coverage"], texture.coverage.shape)
    assert np.abs(found - texture.coverage.astype(int)).max() <= 1
    assert (brush["height"] is None) == (texture.height is None)
    if texture.height is not None:  # pictures of browsers are premultiplied: light of thin paint is coarse
        height = np.reshape(brush["height"], texture.coverage.shape)
        assert np.abs(height / 255 - texture.height)[texture.coverage > 60].max() < 0.02
    options = RenderOptions.of(texture, underpaint=True)
    assert coat["numSigmas"][0] == pytest.approx(options.num_sigmas, rel=2e-3)
    assert coat["underpaint"]["reach"][0] == pytest.approx(options.underpaint.reach, rel=2e-3)
    assert painter.evaluate(PICTURE) != before
    assert painter.evaluate("window.brushgs.contents.header.command.options").count(f"./{kind}.png") == 1
    with painter.expect_download() as download:
        painter.evaluate("document.getElementById('dropSave').click()")
    download.value.save_as(tmp_path / "saved.html")
    page = open_page(tmp_path / "saved.html")
    wait_until(page, "window.brushgs.firstPictureMs !== null")
    assert page.evaluate("window.brushgs.contents.header.brushes[0].name") == kind
    painter.evaluate("window.brushgs.dropping._brush = null")
    choose(painter, "#dropLook", "oil")


def test_what_is_no_brush_is_refused_in_words(painter, tmp_path):
    drop_quince(painter, tmp_path)
    (tmp_path / "odd.png").write_bytes(b"no picture at all")
    write_image(tmp_path / "empty.png", np.zeros((8, 8, 4)))
    write_image(tmp_path / "large.png", np.zeros((5000, 4000, 1)))
    notice = "document.getElementById('notice').textContent"
    for name, words in {
        "odd": "is no picture",
        "empty": "is fully transparent",
        "large": "has 20 meg",
    }.items():
        painter.set_input_files("#dropFile", tmp_path / f"{name}.png")
        wait_until(painter, f"{notice}.startsWith('{name}.png: {words}')")
    assert painter.evaluate("window.brushgs.dropping._brush") is None


READ = """async (files) => {
    const dropping = window.brushgs.dropping, maker = dropping._maker, told = [];
    for (const [name, text] of files) {
      const file = new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name);
      maker.begin(0);
      try {
        const { count, dropped } = await dropping._read((task, given) => maker.run(0, task, given), file);
        await maker.run(0, "up", {});
        await maker.run(0, "stand", { level: [1, 0, 0, 0, 1, 0, 0, 0, 1] });
        await maker.run(0, "front", {});
        await maker.run(0, "frame", { axes: [1, 0, 0, 0, 1, 0, 0, 0, 1], tangents: [1, 1] });
        const { numbers, stage } = dropping._blank.header.painter.looks.oil;
        const { camera } = window.brushgs.contents.header;
        await maker.run(0, "paint", { strokes: 20, numbers });
        const level = [1, 0, 0, 0, 1, 0, 0, 0, 1];
        const { strokes } = await maker.run(0, "show", { camera, level, numbers: stage.numbers });
        told.push([count, dropped, strokes.count]);
      } catch (error) {
        told.push(error.message);
      }
    }
    return told;
}"""
LEFT_OUT = ("which this page does not read", "which this page reads", "cannot be decompressed")


def files_of_the_fuzzer(folder):
    """Whole and damaged files: name and bytes."""
    rng = random.Random(0)
    kinds = {
        ".ply": [*corpus.scenes(folder), *corpus.text_scenes(folder), *corpus.compressed_scenes(folder)],
        ".splat": corpus.splat_scenes(folder),
        ".spz": [data for data in corpus.spz_scenes(folder) if len(data) < 20_000],
    }
    for suffix, seeds in kinds.items():
        damaged = [mutate(rng, rng.choice(seeds), seeds, (b"property", b"float")) for _ in range(60)]
        yield from ((f"a{number}{suffix}", data) for number, data in enumerate([*seeds, *damaged]))


def num_loaded(path):
    """Gaussians of a file, 0 if it is refused."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return len(bg.load(path))
        except bg.SceneError:
            return 0


def test_files_of_the_fuzzer_are_read_as_by_load_or_refused_in_words(painter, tmp_path):
    drop_quince(painter, tmp_path)  # its view
    files = list(files_of_the_fuzzer(tmp_path))
    told = painter.evaluate(READ, [(name, base64.b64encode(data).decode()) for name, data in files])
    num_read = 0
    for (name, data), found in zip(files, told, strict=True):
        (tmp_path / name).write_bytes(data)
        count = num_loaded(tmp_path / name)
        if not isinstance(found, str):
            assert found[0] == count, name
            num_read += 1
        elif count:
            assert any(words in found for words in LEFT_OUT), (name, found)
    assert len(files) > 200
    assert num_read > 50


def test_a_file_that_is_too_large_is_refused_before_it_is_read(painter):
    script = "window.brushgs.dropping.open({name: 'city.ply', size: 312e6})"
    painter.evaluate(script)
    assert "city.ply: has 312 MB" in painter.evaluate(STATE)


def test_without_ziglang_one_sentence_says_how_to_get_it(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(build, "kept_module", lambda: tmp_path / "none.wasm")
    monkeypatch.setattr(build, "find_spec", lambda name: None)
    assert cli.main(["painter", "-o", str(tmp_path / "painter.html")]) == 2
    told = capsys.readouterr().err
    assert "pip install 'brushgs[browser]'" in told
    assert told.count("\n") == 1
    assert not (tmp_path / "painter.html").exists()
