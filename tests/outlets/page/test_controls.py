"""How the camera of a page is moved: by hand, by keys, and by itself."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from brushgs.cameras.framing import frame_scene
from brushgs.outlets.page.view import PageView
from tests.kit.for_each import for_each
from tests.outlets.page.kit import kit
from tests.outlets.page.page_file import (
    SIZE,
    camera_of,
    pixels,
    scene,
    seen,
    settle,
    shown,
    wait_until,
    write_page,
)

WIDTH, HEIGHT = 480, 360  # of the window, in which the bar covers the lower half
WINDOW = {"width": WIDTH, "height": HEIGHT}
CALM = {"reduced_motion": "reduce", "is_drawn": False, **WINDOW}  # nothing turns by itself or glides
_, FIRST = scene()
POINTS = FIRST.points[::5]
OFF = np.array([[330.0, 0, 150], [0, 300, 130], [0, 0, 1]])  # not as high as wide, and off the middle
PLAIN = frame_scene(FIRST, **SIZE)
CAMERAS = {
    "framed": PLAIN,
    "rolled": frame_scene(FIRST, **SIZE, roll=0.3, elevation=-0.4),
    "from the top": frame_scene(FIRST, **SIZE, elevation=pi / 2, azimuth=2.0),
    "panned": frame_scene(FIRST, **SIZE, pan=(0.3, -0.1), zoom=2.0),
    "of a file": replace(PLAIN, K=OFF, near=0.37),
    "narrow": frame_scene(FIRST, **SIZE, fov_y=radians(12)),
}


@pytest.fixture(scope="module")
def contents():
    return shown()


@pytest.fixture(scope="module")
def path(contents, tmp_path_factory):
    return write_page(tmp_path_factory.mktemp("page") / "pears.html", contents)


@pytest.fixture(scope="module")
def calm(open_shared_page, path):
    tab = open_shared_page(path, **CALM)
    tab.evaluate("brushgs.ready")
    return tab


@pytest.fixture(scope="module")
def tab(open_shared_page):
    return kit(open_shared_page)


@pytest.fixture
def page(calm):
    """A calm page that shows its first picture."""
    calm.bring_to_front()
    calm.mouse.move(0, 0)
    calm.evaluate(
        """() => {
          const { controls } = brushgs;
          controls.home();
          controls.state.set(controls.target);
          controls._tap = null;
          document.activeElement.blur();
        }"""
    )
    settle(calm)
    return calm


def shot(page):
    """The `Camera` of the window."""
    return seen(page, page.evaluate("brushgs.contents.header"), WIDTH, HEIGHT)


def state_of(page):
    """Place, logarithm of the distance, azimuth and elevation that are aimed at."""
    return np.array(page.evaluate("[...brushgs.controls.target]"))


def first_camera(tab, header, width, height):
    """The camera of the first picture in a window."""
    facts = tab.evaluate(
        """([header, width, height]) => {
          const orbit = new kit.Orbit(header);
          return kit.facts(orbit.aim(new kit.PageCamera({ ...orbit.lens, width, height }), orbit.first));
        }""",
        [header, width, height],
    )
    return camera_of(facts, header)


@for_each("name", CAMERAS)
@for_each("is_inside", [False, True])
def test_the_first_picture_is_that_of_render_in_a_window_of_any_shape(tab, name, is_inside):
    camera = CAMERAS[name]
    view = replace(PageView.of(FIRST, camera), is_inside=is_inside)
    header = dict(shown(camera, view=view).header)
    for width, height in ((320, 240), (640, 480), (500, 200), (390, 844)):
        shown_camera = first_camera(tab, header, width, height)
        scale = shown_camera.K[0, 0] / camera.K[0, 0]
        sides = (width / 320, height / 240)
        assert min(sides) - 1e-9 <= scale <= max(sides) + 1e-9  # the whole picture, or a filled window
        shift = 0.5 * np.array([width - 320 * scale, height - 240 * scale])
        expected = pixels(camera, POINTS) * scale + shift
        np.testing.assert_allclose(pixels(shown_camera, POINTS), expected, atol=1e-6)
        assert shown_camera.near == pytest.approx(camera.near, rel=1e-12)


@for_each("reach", [(0.2, 0.8), (0.45, 0.8), (0.8, 0.35), (0.8, 0.8)])
@for_each(("width", "height"), [(390, 844), (844, 390), (280, 653), (1280, 720), (2560, 1440)])
def test_the_subject_fills_the_side_that_binds(tab, contents, width, height, reach):
    subject = (reach[0] * 160, reach[1] * 120)
    header = contents.header | {"subject": list(subject)}
    scale = first_camera(tab, header, width, height).K[0, 0] / PLAIN.K[0, 0]
    share = scale * max(2 * subject[0] / width, 2 * subject[1] / height)
    assert 0.55 <= share <= 0.9 or scale == pytest.approx(max(width / 320, height / 240))


@for_each(("width", "height"), [(390, 844), (844, 390), (280, 653), (1280, 720), (2560, 1440)])
def test_inside_a_scene_no_window_shows_what_would_be_drawn_long(tab, contents, width, height):
    header = contents.header | {"subject": None, "isInside": True}
    K = first_camera(tab, header, width, height).K
    own = max(160 / PLAIN.K[0, 0], 120 / PLAIN.K[1, 1])
    assert max(width / (2 * K[0, 0]), height / (2 * K[1, 1])) <= max(0.85, own) + 1e-9


def test_a_drag_turns_the_scene_with_the_hand(page, contents):
    before, state = shot(page), state_of(page)
    page.mouse.move(240, 100)
    page.mouse.down()
    page.mouse.move(280, 110, steps=4)
    page.mouse.up()
    settle(page)
    after = shot(page)
    moved = state_of(page) - state
    np.testing.assert_allclose(moved[4:], (-40 * pi / HEIGHT, 10 * pi / HEIGHT), atol=1e-9)
    np.testing.assert_allclose(moved[:4], 0, atol=1e-12)
    # What lies before the middle went to the right and down, with the hand.
    center = np.array(contents.header["center"])
    front = center + 0.2 * (before.position - center)
    shift = pixels(after, [front])[0] - pixels(before, [front])[0]
    assert shift[0] > 5
    assert shift[1] > 1
    np.testing.assert_allclose(pixels(after, [center])[0], (240, 180), atol=1e-6)


def test_the_wheel_leaves_what_is_under_the_pointer_there(page, contents):
    before = shot(page)
    at = np.array([250.0, 60.0])
    distance = np.exp(state_of(page)[3])
    ray = np.array([*((at - before.K[:2, 2]) / before.K[0, 0]), 1]) * distance
    point = before.viewmat[:3, :3].T @ (ray - before.viewmat[:3, 3])
    page.mouse.move(*at)
    page.mouse.wheel(0, -240)
    settle(page)
    wait_until(page, "d => Math.exp(brushgs.controls.state[3]) < 0.9 * d", distance)
    after = shot(page)
    np.testing.assert_allclose(pixels(after, [point])[0], at, atol=1e-6)
    assert np.exp(state_of(page)[3]) / distance == pytest.approx(np.exp(-240 * 0.0015), rel=1e-9)
    assert after.near / before.near == pytest.approx(np.exp(-240 * 0.0015), rel=1e-9)


def test_limits_hold(page, contents):
    header = contents.header
    for _ in range(40):
        page.evaluate("brushgs.controls.press('+')")
    assert np.exp(state_of(page)[3]) == pytest.approx(0.02 * header["radius"])
    assert shot(page).near > 0
    for _ in range(80):
        page.evaluate("brushgs.controls.press('-')")
    assert np.exp(state_of(page)[3]) == pytest.approx(6 * header["radius"])
    for _ in range(40):
        page.evaluate("brushgs.controls.press('ArrowUp')")
        page.evaluate("brushgs.controls.press('ArrowLeft', true)")
    state = state_of(page)
    assert state[5] == pytest.approx(radians(89))
    first = np.array(page.evaluate("[...brushgs.controls.orbit.first]"))
    assert np.linalg.norm(state[:3] - first[:3]) == pytest.approx(3 * header["radius"])


def test_keys_move_the_view_and_home_brings_it_back_exactly(page, contents):
    first = state_of(page)
    page.locator("#painting").focus()
    page.wait_for_function("document.hasFocus() && document.activeElement.id === 'painting'")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    np.testing.assert_allclose((state_of(page) - first)[4:], radians(5), atol=1e-12)
    page.keyboard.press("Shift+ArrowRight")
    page.keyboard.press("+")
    settle(page)
    moved = state_of(page)
    assert moved[3] == pytest.approx(first[3] + np.log(0.85))
    assert np.linalg.norm(moved[:3] - first[:3]) > 0.01
    page.evaluate("brushgs.controls.orbit.turn(brushgs.controls.target, 40, 0)")  # six turns and more
    page.keyboard.press("Home")
    settle(page)
    np.testing.assert_array_equal(page.evaluate("[...brushgs.controls.state]"), first)
    np.testing.assert_allclose(pixels(shot(page), POINTS), 1.5 * pixels(PLAIN, POINTS), atol=1e-6)


def test_one_finger_turns_two_move_and_zoom(open_page, path, contents):
    page = open_page(path, has_touch=True, **CALM)
    page.evaluate("brushgs.ready")
    first, session = state_of(page), page.context.new_cdp_session(page)

    def touch(kind, *points):
        touches = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})

    touch("touchStart", (100, 100))
    touch("touchMove", (124, 100))
    touch("touchEnd")
    np.testing.assert_allclose((state_of(page) - first)[4:], (-24 * pi / HEIGHT, 0), atol=1e-9)
    outline = "getComputedStyle(brushgs.canvas).outlineStyle"
    assert page.evaluate(outline) == "none"
    page.keyboard.press("Tab")
    page.keyboard.press("Shift+Tab")
    assert page.evaluate(outline) == "solid"
    settle(page)
    before = shot(page)
    distance = np.exp(state_of(page)[3])
    tips = np.array([[100.0, 120], [180, 120]])
    touch("touchStart", *tips.tolist())
    touch("touchMove", (90, 100), (250, 100))
    touch("touchEnd")
    settle(page)
    after = shot(page)
    assert np.exp(state_of(page)[3]) / distance == pytest.approx(0.5, rel=1e-6)
    rays = np.concatenate([(tips - before.K[:2, 2]) / before.K[0, 0], np.ones((2, 1))], axis=1) * distance
    points = (rays - before.viewmat[:3, 3]) @ before.viewmat[:3, :3]
    np.testing.assert_allclose(pixels(after, points), [[90, 100], [250, 100]], atol=0.01)


def test_a_point_is_picked_where_half_of_the_light_is_lost(tab):
    half = int(np.array(0.45, np.float16).view(np.uint16))
    points = tab.evaluate(
        """half => {
          const pick = (z, direction = [0, 0, 1]) => kit.pointOnRay({
            header: {
              coats: [{ count: z.length, arrays: { means: "m", quats: "q", scales: "s", opacities: "o" } }],
            },
            arrays: {
              m: Float32Array.from(z.flatMap((value) => [0, 0, value])),
              q: Float32Array.from(z.flatMap(() => [1, 0, 0, 0])),
              s: Float32Array.from(z.flatMap(() => [1, 1, 0])),
              o: Uint16Array.from(z.map(() => half)),
            },
          }, [0, 0, 0], direction);
          return [pick([5, 3, 9]), pick([5]), pick([-5, -3]), pick([]), pick([4, 4, 4], [0.6, 0, 0.8])];
        }""",
        half,
    )
    assert points[0] == pytest.approx([0, 0, 5])  # 0.45 and 0.45 of the rest stop more than half
    assert points[1:4] == [None, None, None]
    assert points[4] is None  # three deviations off


def test_inside_a_scene_the_hand_looks_around_and_the_wheel_walks_a_little(open_page, tmp_path):
    view = replace(PageView.of(FIRST, PLAIN), is_inside=True)
    contents = shown(PLAIN, view=view)
    page = open_page(write_page(tmp_path / "inside.html", contents), **CALM)
    page.evaluate("brushgs.ready")
    before = shot(page)
    page.mouse.move(240, 100)
    page.mouse.down()
    page.mouse.move(260, 100)
    page.mouse.up()
    settle(page)
    looked = shot(page)
    np.testing.assert_allclose(looked.position, before.position, atol=1e-9)
    ahead = before.position + before.viewmat[2, :3]
    assert pixels(looked, [ahead])[0][0] == pytest.approx(260, abs=1)  # as a picture in the hand
    assert looked.near == before.near
    for _ in range(60):
        page.evaluate("brushgs.controls.press('+')")
    settle(page)
    walked = shot(page).position - looked.position
    distance = np.linalg.norm(np.array(contents.header["center"]) - before.position)
    np.testing.assert_allclose(walked / np.linalg.norm(walked), looked.viewmat[2, :3], atol=1e-9)
    assert np.linalg.norm(walked) == pytest.approx(0.5 * distance)


def test_nothing_is_drawn_when_nothing_moves_and_the_page_turns_until_it_is_touched(open_page, path):
    page = open_page(path, **WINDOW, is_drawn=False)
    page.evaluate("brushgs.ready")
    for stop in ("touch", "bar", "key"):
        assert page.evaluate("brushgs.controls.isTurning")
        assert page.locator("#turn").get_attribute("aria-pressed") == "true"
        first = page.evaluate("brushgs.controls.state[4]")
        wait_until(page, "first => brushgs.controls.state[4] > first + 1e-4", first)
        if stop == "touch":
            page.mouse.move(20, 20)
            page.mouse.down()
            page.mouse.up()
        elif stop == "bar":
            page.locator("#link").focus()
        else:
            page.keyboard.press("ArrowLeft")  # and begins a glide
        assert not page.evaluate("brushgs.controls.isTurning")
        assert page.locator("#turn").get_attribute("aria-pressed") == "false"
        if stop != "key":
            page.evaluate("document.activeElement.blur()")  # and turn again, as it opens
            page.evaluate("brushgs.controls.setTurning(true, { isAutomatic: true })")
    drawn = settle(page)
    np.testing.assert_array_equal(page.evaluate("[...brushgs.controls.state]"), state_of(page))
    page.mouse.move(60, 60)  # a pointer that touches nothing
    page.wait_for_timeout(300)
    assert page.evaluate("brushgs.framesDrawn") == drawn
    page.keyboard.press("ArrowLeft")
    wait_until(page, "drawn => brushgs.framesDrawn > drawn", drawn)


@for_each(
    ("has_underpaint", "paces"),
    [
        (True, [(1, False), (1, False), (1, False), (1, True), (0.5, True), (1, True), (1, False)]),
        (False, [(1, False), (1, False), (1, False), (0.75, True), (0.5, True), (1, True), (1, False)]),
    ],
)
def test_the_moving_picture_is_as_coarse_as_the_time_of_a_frame_asks_for(tab, has_underpaint, paces):
    """At 15 frames a second it is enough to make the underpaint a layer, where there is any."""
    found = tab.evaluate(
        """(hasUnderpaint) => {
          const pace = new kit.Pace();
          pace.hasUnderpaint = hasUnderpaint;
          const after = (count, seconds) => {
            for (let i = 0; i < count; i++) pace.tell(seconds);
            return [pace.now.share, pace.now.underpaintStep > 0];
          };
          const slow = [after(2, 0.07), after(1, 0.01), after(2, 0.07), after(1, 0.07), after(9, 0.5)];
          return [...slow, after(240, 0.016), after(120, 0.016)];
        }""",
        has_underpaint,
    )
    assert [tuple(one) for one in found] == paces
