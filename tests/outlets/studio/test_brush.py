"""The brush of the page: what is painted is in the file of marks, in the picture and in `render --marks`."""

import json

import numpy as np
import pytest

from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.formats.marks import read_marks
from brushgs.formats.pictures.images import read_image
from brushgs.outlets.page.columns import shown_by
from brushgs.outlets.studio.overpainting import HandStroke, changed_by, read_stroke
from brushgs.outlets.studio.settings import Settings, Shot
from brushgs.passes.marks.place import Below
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera
from brushgs.values.marks import Overpaint
from tests.kit.for_each import for_each
from tests.outlets.studio.conftest import DRAWN, FEW, PLAIN, until
from tests.outlets.studio.test_point import draw, middle_of

SIDE, FOCAL = 200, 200.0
CAMERA = Camera(np.eye(4), np.array([[FOCAL, 0, 100], [0, FOCAL, 100], [0, 0, 1.0]]), SIDE, SIDE, 0.1)
WALL = Below(CAMERA, np.full((SIDE, SIDE), np.log(4.0)), np.ones((SIDE, SIDE), bool))  # at z = 4
GREEN = [0.0, 1.0, 0.0]
SENT = {
    "tool": "paint",
    "camera": {"viewmat": np.eye(4).ravel().tolist(), "K": CAMERA.K.ravel().tolist(), "width": SIDE,
               "height": SIDE, "near": 0.1},
    "points": [[50, 100, 0.5], [150, 100, 0.5]],
    "size": 20,
    "brush": "flat",
    "colors": ["#00ff00"],
}  # fmt: skip


def stroke(tool, start, end, size=20.0):
    drawn = np.linspace([*start, 0.5], [*end, 0.5], 30)
    return HandStroke(tool, CAMERA, drawn, size, "flat", np.array([GREEN]), 1.0)


def in_pixels(points):
    return FOCAL * points[:, :2] / points[:, 2:] + 100


def test_a_stroke_lies_on_the_surface_along_the_line():
    marks = changed_by(stroke("paint", (50, 100), (150, 100)), Overpaint(), WALL).marks
    at = in_pixels(marks.means)
    assert np.allclose(marks.means[:, 2], 4, atol=1e-6)
    assert np.abs(at[:, 1] - 100).max() < 5
    assert at[:, 0].min() > 45
    assert at[:, 0].max() < 155
    assert np.allclose(marks.colors, GREEN, atol=0.02)


def test_an_eraser_takes_marks_only_where_it_passed():
    painted = changed_by(stroke("paint", (50, 100), (150, 100)), Overpaint(), WALL)
    paint = [sum(float(image[..., 3].sum()) for image in painted.marks.images)]
    half = changed_by(stroke("erase", (40, 100), (100, 100), 60), painted, WALL)
    paint += [sum(float(image[..., 3].sum()) for image in half.marks.images)]
    assert paint[1] / paint[0] == pytest.approx(0.35, abs=0.2)
    assert changed_by(stroke("erase", (40, 40), (100, 40)), painted, WALL) is None
    assert changed_by(stroke("erase", (40, 100), (160, 100), 60), painted, WALL).marks is None


def test_combs_run_along_the_drag_and_bare_patches_lie_below_it():
    combs = changed_by(stroke("comb", (50, 100), (150, 100), 40), Overpaint(), WALL).combs
    assert np.allclose(np.abs(combs.directions @ [1, 0, 0]), 1)
    assert np.allclose(combs.radii, 20 * 4 / FOCAL)
    erased = changed_by(stroke("bare", (50, 100), (150, 100)), Overpaint(), WALL).erased
    reach = np.abs(in_pixels(erased.means)[:, 1] - 100) + erased.radii * FOCAL / 4
    assert reach.max() < 13  # a line of 20 px
    assert np.allclose(np.abs(erased.normals[:, 2]), 1, atol=1e-3)


def test_painting_a_place_again_doubles_its_strokes_once_more_up_to_a_limit():
    drag = stroke("dense", (50, 100), (150, 100), 40)
    state, most = Overpaint(), []
    for _ in range(5):
        state = changed_by(drag, state, WALL)
        most.append(state.density.factors.max())
    assert most == [2, 4, 8, 16, 16]
    at = in_pixels(state.density.means)
    assert np.abs(at[:, 1] - 100).max() < 20
    other = changed_by(stroke("dense", (50, 20), (150, 20), 20), state, WALL).density
    assert (other.factors[len(state.density) :] == 2).all()
    nothing = Below(CAMERA, WALL.log_depth, np.zeros((SIDE, SIDE), bool))
    assert changed_by(drag, state, nothing) is None


@for_each(
    ("changes", "sentence"),
    [
        ({"tool": "spill"}, "tool"),
        ({"points": [[0, 0, 0.5]] * 2001}, "points"),
        ({"points": []}, "points"),
        ({"points": [[1e9, 0, 0.5]]}, "points must lie near the picture"),
        ({"points": [[0, 0, 3]]}, "points"),
        ({"size": 4000}, "size"),
        ({"brush": "/etc/passwd"}, "brush must be one that the page offers"),
        ({"colors": ["red"]}, "colors must be #rrggbb"),
        ({"colors": ["#ffffff"] * 3}, "colors must be one, or one for each of 2 points"),
        ({"camera": SENT["camera"] | {"width": 8000}}, "camera must be at most 4096 pixels a side"),
        ({"file": "x.marks"}, "file"),
    ],
)
def test_a_wrong_stroke_is_refused(changes, sentence):
    read_stroke(SENT, ("flat",))
    with pytest.raises(ValueError, match=sentence):
        read_stroke(json.loads(json.dumps(SENT | changes)), ("flat",))


def painted_by(page, count):
    """Wait until the page has so many strokes that can be undone, all of them painted."""
    until(page, f"window.brushgs.studio._hand._undo.disabled === {'true' if count == 0 else 'false'}")
    until(page, "!window.brushgs.studio._hand._waiting.length && window.brushgs.studio.isSettled")


@DRAWN
def test_paint_undo_erase_and_render(viewed, scene, tmp_path):
    page, studio = viewed
    x, y = middle_of(page)
    page.locator('input[name="brushColor"]').fill("#00ff00")
    page.keyboard.press("b")
    assert page.get_by_role("button", name="Brush", exact=True).get_attribute("aria-pressed") == "true"
    draw(page, [(x - 40, y), (x + 40, y)])
    painted_by(page, 1)
    file = tmp_path / "pears-1.marks"
    assert len(read_marks(file).marks) > 0
    view = page.evaluate(
        "(() => { const { app } = window.brushgs.studio, { clientWidth: w, clientHeight: h } = app.canvas;"
        " const picture = app.studio._hand._readPicture();"
        " return [app.studio._hand._colorsAt([[w / 2, h / 2]], picture)[0], w, h]; })()"
    )
    (red, green, blue), *_ = view
    assert green > red + 60
    assert green > blue + 60

    killed = session_of(parse(["view", str(scene), *FEW, *PLAIN, "--marks", str(file)]))
    again = killed.paint(Settings(), Report())
    assert killed.overpainting.path == file
    assert killed.overpainting.facts["marks"] == studio.state()["marks"]["marks"]
    camera = again.prepared.camera
    killed.folder = tmp_path
    shot = 255 * read_image(killed.shoot(again, Shot(camera.resized(960, 720)), Report()))
    around = shot[356:365, 476:485].mean(axis=(0, 1))
    assert around[1] - around[[0, 2]].mean() > 60

    page.keyboard.press("Control+z")
    painted_by(page, 0)
    assert not file.exists()
    page.keyboard.press("Control+Shift+Z")
    painted_by(page, 1)
    assert len(read_marks(file).marks) > 0
    page.keyboard.press("e")
    for _ in range(6):
        page.keyboard.press("]")
    draw(page, [(x - 60, y), (x + 60, y)])
    until(page, "window.brushgs.studio._hand._words.textContent.startsWith('Nothing')")
    page.keyboard.press("Escape")
    assert page.evaluate("window.brushgs.studio._hand._tool") is None


def test_combs_bare_patches_and_finer_strokes_change_strokes_and_no_file_of_others(viewed, scene, tmp_path):
    page, studio = viewed
    (tmp_path / "pears-1.marks").write_text("of somebody else")
    file = tmp_path / "pears-2.marks"
    x, y = middle_of(page)

    def coat():
        return studio._painted.prepared.painting.coats[0]

    before = coat().strokes
    page.get_by_role("button", name="Comb").click()
    for _ in range(9):
        page.keyboard.press("]")
    draw(page, [(x - 40, y - 40), (x + 40, y + 40)])
    painted_by(page, 1)
    assert (np.abs(coat().strokes.quats - before.quats).max(axis=1) > 0.01).any()
    page.get_by_role("button", name="No strokes here").click()
    draw(page, [(x - 40, y), (x + 40, y)])
    until(page, "window.brushgs.studio._hand._waiting.length === 0 && window.brushgs.studio.isSettled")
    assert coat().cut.inside.any()
    assert (shown_by(coat()).opacities[coat().cut.inside] == 0).all()
    assert (tmp_path / "pears-1.marks").read_text() == "of somebody else"
    assert {"combs", "erased"} <= set(json.loads(file.read_text()))
    for _ in range(2):
        page.keyboard.press("Control+z")
    painted_by(page, 0)
    page.get_by_role("button", name="Finer strokes").click()
    for count in (1, 2, 3):
        draw(page, [(x - 30, y), (x + 30, y)])
        painted_by(page, count)
    density = read_marks(file).density
    assert density.factors.max() == 8

    def inside(strokes):
        away = np.linalg.norm(strokes.means[:, None] - density.means, axis=2)
        return int((away < density.radii).any(axis=1).sum())

    assert inside(coat().strokes) > 1.5 * inside(before) > 0
    words = ["view", str(scene), *FEW, *PLAIN, "--marks", str(file)]
    again = session_of(parse(words)).paint(Settings(), Report()).prepared.painting.coats[0].strokes
    assert inside(again) == inside(coat().strokes)


SHOWN = """([x, y]) => {
  const { _hand: hand } = window.brushgs.studio, ratio = window.devicePixelRatio;
  const { data } = hand._surface.getContext("2d").getImageData(x * ratio, y * ratio, 1, 1);
  return [[...data], hand._waiting.length];
}"""

HEARD = """(() => {
  const { _server: server } = window.brushgs.studio._hand, stroke = server.stroke.bind(server);
  window.sent = [];
  server.stroke = (one) => { window.sent.push(one.points); return stroke(one); };
})()"""


def test_a_pen_and_a_finger_paint_and_the_stroke_is_seen_at_once(viewed, tmp_path):
    page, _ = viewed
    x, y = middle_of(page)
    left, top = page.evaluate(
        "(() => { const { left, top } = window.brushgs.studio.app.canvas.getBoundingClientRect();"
        " return [left, top]; })()"
    )
    page.locator('input[name="brushColor"]').fill("#00ff00")
    page.keyboard.press("b")
    page.evaluate(HEARD)
    client = page.context.new_cdp_session(page)
    for kind, at, force in [
        ("mousePressed", x - 40, 0.3),
        *[("mouseMoved", x - 40 + 8 * step, 0.3 + 0.06 * step) for step in range(1, 10)],
        ("mouseReleased", x + 40, 0.0),
    ]:
        event = {"type": kind, "x": at, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        client.send("Input.dispatchMouseEvent", event | {"pointerType": "pen", "force": force})
    (red, green, _, alpha), waiting = page.evaluate(SHOWN, [x - left, y - top])
    assert waiting == 1, "the server works on it"
    assert green > red + 100
    assert alpha > 100
    pressures = [pressure for *_, pressure in page.evaluate("window.sent[0]")]
    assert min(pressures) == pytest.approx(0.3, abs=0.02)
    assert max(pressures) == pytest.approx(0.84, abs=0.02)
    painted_by(page, 1)
    by_pen = len(read_marks(tmp_path / "pears-1.marks").marks)
    for kind, at in [("touchStart", -30), *[("touchMove", -30 + 6 * step) for step in range(10)]]:
        client.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x + at, "y": y + 30}]})
    client.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    until(page, "window.sent.length === 2")
    painted_by(page, 1)
    assert len(read_marks(tmp_path / "pears-1.marks").marks) > by_pen
