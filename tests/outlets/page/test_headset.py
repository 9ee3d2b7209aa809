"""Headsets, with a device of our own: `device.js` replaces WebXR, and each test says where the head is."""

import base64
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.html import web_text
from brushgs.outlets.page.view import PageView
from tests.outlets.page.page_file import settle, shown, wait_until, write_page
from tests.outlets.page.studio import Studio, painting_of

WIDTH, HEIGHT = 240, 200  # of an eye
IPD = 0.064  # meters between the eyes
OUTER, INNER = 1.2, 0.8  # tangents: the frusta of headsets are not symmetric
ABOVE = 0.7
BELOW = HEIGHT / WIDTH * (OUTER + INNER) - ABOVE  # pixels are square
FRONT = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=64, height=64)
TURNED = PageView(np.array([0.0, -1, 0]), np.zeros(3), 1.0, False)

DEVICE = (Path(__file__).parent / "device.js").read_text()
FRAME = "time => device.frame(time, [0, 1.5, 0], [0, 0, 0, 1])"
HOOK = """
Object.assign(gl.canvas, { width: 480, height: 200 });
document.body.append(gl.canvas);
const problems = [];
const options = { share: 1, brush: null, ground: true, highlight: null };
let isDrawn = false;
const headset = new Headset(gl, {
  getPainter: () => painter,
  getOptions: () => options,
  onStart() {},
  onEnd: () => { isDrawn = true; },
  onProblem: (sentence) => problems.push(sentence),
});
Object.assign(window.studio, {
  headset,
  options,
  problems,
  wasDrawn: () => isDrawn,
  eyeBoxes() {
    const { _eyes: eyes, _head: head } = headset;
    return eyes.map(({ camera }) => encoded(painter.boxes(0, camera, { head })));
  },
  instances: () => encoded(painter._coats[0]._order.ids.slice()),
});
"""


@dataclass(frozen=True)
class Head:
    """A pose: a place in meters, x right, y up, z backward, and turns in degrees, that around y first."""

    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    roll: float = 0.0

    @property
    def turn(self):
        """Room from head."""
        return Rotation.from_euler("YZ", (self.yaw, self.roll), degrees=True)


def projection_of(eye):
    """[4, 4] clip from view, of the left (0) or right eye."""
    left, right = (-OUTER, INNER) if eye == 0 else (-INNER, OUTER)
    near, far = 0.05, 1000.0
    clip = np.zeros((4, 4))
    clip[0, [0, 2]] = 2 / (right - left), (right + left) / (right - left)
    clip[1, [1, 2]] = 2 / (ABOVE + BELOW), (ABOVE - BELOW) / (ABOVE + BELOW)
    clip[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
    clip[3, 2] = -1
    return clip


def seen_at(point, head, eye):
    """[x, y] pixels of an eye from its upper left corner, of a point in the room: what WebXR says."""
    view = head.turn.inv().apply(np.asarray(point) - head.place) - [(eye - 0.5) * IPD, 0, 0]
    clip = projection_of(eye) @ [*view, 1]
    return (clip[:2] / clip[3] * [1, -1] + 1) / 2 * [WIDTH, HEIGHT]


def eyes_of_device():
    """For `device.eyes`."""
    columns = [projection_of(eye).T.ravel().tolist() for eye in (0, 1)]
    return [{"offset": (eye - 0.5) * IPD, "projection": columns[eye]} for eye in (0, 1)]


class Visit(Studio):
    """A tab with a painting and a device."""

    def __init__(self, page):
        super().__init__(page, more=web_text("xr.js") + HOOK)
        self.time = 0.0
        page.evaluate("eyes => { device.eyes = eyes; }", eyes_of_device())

    def hang(self, strokes, texture="gaussian", *, view=TURNED, camera=FRONT, **options):
        """Hand it strokes."""
        painting = painting_of(strokes, bg.StrokeTexture.open(texture), **options)
        contents = page_contents(painting, camera, view=view, title="", command=("", ()))
        data = base64.b64encode(write_container(contents)).decode()
        self.page.evaluate("data => studio.load(data)", data)

    def enter(self, mode="immersive-vr"):
        self.page.evaluate("mode => studio.headset.enter(mode)", mode)
        return self

    def look(self, head=None, *, after=20):
        """[2, H, W, 4] of the left and the right eye, in [0, 1], upper row first."""
        head = head or Head()
        self.time += after
        pose = [self.time, list(head.place), head.turn.as_quat().tolist()]  # x, y, z, w
        text = self.page.evaluate("([time, place, turn]) => device.frame(time, place, turn)", pose)
        flat = np.frombuffer(base64.b64decode(text), np.uint8).reshape(HEIGHT, 2, WIDTH, 4)
        return flat[::-1].swapaxes(0, 1) / 255

    def boxes_of_eyes(self):
        """[2, N, 12] of the last frame."""
        texts = self.page.evaluate("studio.eyeBoxes()")
        return np.stack([np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 12) for text in texts])

    def instances(self):
        """Strokes of the last frame, farthest first."""
        return np.frombuffer(base64.b64decode(self.page.evaluate("studio.instances()")), np.uint32)

    def hold(self, hand, axes):
        """Controllers: one, with a thumbstick at (x, y)."""
        source = {"handedness": hand, "gamepad": {"axes": [0, 0, *axes]}}
        self.page.evaluate("source => { device.session.inputSources = [source]; }", source)


@pytest.fixture
def visit(open_page, tmp_path):
    """A tab of a file, as WebXR is only in secure pages."""
    blank = tmp_path / "blank.html"
    blank.write_text("<!doctype html><title>Headset</title><body></body>")
    return Visit(open_page(blank, init_script=DEVICE))


def spot(place=(0.0, 0.0, 0.0), size=0.05):
    """One round white stroke."""
    return bg.Gaussians([place], [[1.0, 0, 0, 0]], [[size] * 3], [0.9], [[[1.7] * 3]])


def crowd(count=60, seed=3):
    """Strokes around the origin, longer than wide."""
    rng = np.random.default_rng(seed)
    return bg.Gaussians(
        rng.normal(size=(count, 3)) * 0.25,
        rng.normal(size=(count, 4)),
        rng.uniform([0.1, 0.02, 0.01], [0.2, 0.05, 0.02], (count, 3)),
        rng.uniform(0.5, 0.9, count),
        rng.normal(size=(count, 1, 3)),
    )


def centroid(alpha):
    """[x, y] in pixels."""
    rows, columns = np.indices(alpha.shape) + 0.5
    return np.array([(alpha * columns).sum(), (alpha * rows).sum()]) / alpha.sum()


@pytest.mark.parametrize("place", [(0.0, 0, 0), (0.4, 0.3, -0.5), (-0.5, -0.2, 0.8)])
def test_a_stroke_has_the_parallax_of_its_distance(visit, place):
    visit.hang(spot(place))
    visit.enter("immersive-ar")
    start = Head((0.1, 1.6, 0.2))
    visit.look(start)
    x, y, z = place  # of the page: y down, and z away from the first camera
    depth = max(0.0, y) * 0.75
    room = np.array([start.place[0] + 0.75 * x, depth - 0.75 * y, start.place[2] - 1.75 - 0.75 * z])
    head = Head((0.15, 0.2, 0.3))
    left, right = visit.look(head)
    found = [centroid(eye[..., 3]) for eye in (left, right)]
    for eye in (0, 1):
        np.testing.assert_allclose(found[eye], seen_at(room, head, eye), atol=0.5)
    focal = WIDTH / (OUTER + INNER)
    middles = WIDTH * OUTER / (OUTER + INNER), WIDTH * INNER / (OUTER + INNER)
    disparity = (found[0][0] - middles[0]) - (found[1][0] - middles[1])
    assert disparity == pytest.approx(focal * IPD / (head.place[2] - room[2]), abs=0.25)
    assert found[0][1] == pytest.approx(found[1][1], abs=0.02)


def test_both_eyes_see_one_direction_and_one_color_in_an_order_that_a_turn_of_the_head_leaves(visit):
    visit.hang(crowd(), "flat")
    visit.enter()
    orders = [(visit.look(Head((0, 0.5, 0), yaw)), visit.instances())[1] for yaw in (0, 20, -35, 90)]
    assert len(set(orders[0])) == len(orders[0])
    assert all((order == orders[0]).all() for order in orders)
    visit.look(Head((1.5, 0.5, -1.75), 90))
    assert (visit.instances() != orders[0]).any()
    visit.page.evaluate("""() => {
      window.sorts = 0;
      const { sort } = studio.painter._coats[0]._order.constructor.prototype;
      studio.painter._coats[0]._order.sort = function (...a) { window.sorts++; return sort.apply(this, a); };
    }""")
    visit.look(Head((0, 0.3, 0)))
    assert visit.page.evaluate("sorts") == 1
    left, right = visit.boxes_of_eyes()
    seen = (left[:, 7] == 1) & (right[:, 7] == 1)
    assert seen.sum() > 30
    np.testing.assert_array_equal(left[seen, 8:11], right[seen, 8:11])  # colors
    turns = np.remainder(left[seen, 4] - right[seen, 4] + np.pi, 2 * np.pi) - np.pi
    np.testing.assert_allclose(turns, 0, atol=np.radians(1e-3))
    assert np.abs(left[seen, 0] - right[seen, 0]).min() > 5  # centers are those of each eye


def test_thumbsticks_move_turn_and_resize(visit):
    visit.hang(spot())
    visit.enter("immersive-ar")
    head = Head((0, 0.2, 0))

    def middle(picture):
        return np.mean([centroid(eye[..., 3]) for eye in picture], axis=0)

    def size(picture):
        return picture[..., 3].sum()

    start = visit.look(head)
    visit.hold("left", (0, -1))
    near = [visit.look(head, after=50) for _ in range(10)][-1]  # half a second at 1.5 m a second
    assert size(near) > 1.5 * size(start)
    np.testing.assert_allclose(visit.boxes_of_eyes()[:, 0, 5] * 0.75, 1.0, atol=1e-4)
    visit.hold("left", (0, 1))
    for _ in range(10):
        visit.look(head, after=50)
    visit.hold("right", (1, 0))
    turned = [visit.look(head) for _ in range(3)][-1]  # once, until the stick was back
    ahead = 1.75 * np.array([-np.sin(np.pi / 6), 0, -np.cos(np.pi / 6)])
    np.testing.assert_allclose(centroid(turned[0][..., 3]), seen_at(ahead, head, 0), atol=0.6)
    visit.hold("right", (0, 0))
    visit.look(head)
    visit.hold("right", (-1, 0))
    np.testing.assert_allclose(middle(visit.look(head)), middle(start), atol=0.1)
    visit.hold("right", (0, -1))
    for _ in range(10):
        visit.look(head, after=100)  # a second
    assert visit.boxes_of_eyes()[0, 0, 5] * 1.5 == pytest.approx(2 * 1.75, rel=1e-4)


def test_a_long_squeeze_ends_the_session_and_what_cannot_start_is_told(visit):
    visit.hang(spot())
    visit.enter()
    visit.look()
    for after in (900, 1000):  # too short, and long enough
        visit.look(after=900)
        visit.page.evaluate("device.session.squeeze(device, true)")
        visit.look(after=20)
        visit.look(after=after)
        assert visit.page.evaluate("studio.headset.isOn") == (after == 900)
        visit.page.evaluate("device.session.squeeze(device, false)")
    assert visit.page.evaluate("studio.wasDrawn() && device.session.isEnded")
    visit.enter().look()  # and again
    assert visit.page.evaluate("studio.headset.isOn")
    visit.page.evaluate("studio.headset.leave()")
    for fault in ("refusal", "incompatible"):
        visit.page.evaluate("name => { device[name] = `No ${name}.`; }", fault)
        visit.enter()
        visit.page.evaluate("name => { device[name] = null; }", fault)
    sentence = "The headset did not start: No {}."
    assert visit.page.evaluate("studio.problems") == [sentence.format(x) for x in ("refusal", "incompatible")]
    assert visit.page.evaluate("[studio.headset.isOn, device.session.isEnded]") == [False, True]


def test_the_bar_leads_into_the_headset_and_a_squeeze_back(open_page, tmp_path):
    contents = shown()
    path = write_page(tmp_path / "pears.html", contents)
    page = open_page(path, init_script=DEVICE, reduced_motion="reduce")
    page.evaluate("() => brushgs.ready")
    wait_until(page, "!!document.getElementById('immersive-ar')")
    assert page.evaluate("document.getElementById('headsetHint').textContent") == ""
    page.evaluate("() => { device.refusal = 'The headset is asleep.'; }")
    page.get_by_role("button", name="Enter VR").press("Enter")
    wait_until(page, "document.getElementById('notice').textContent.includes('asleep')")
    assert not page.evaluate("brushgs.isPaused")
    page.evaluate("() => { device.refusal = null; }")
    settle(page)
    before = page.evaluate("() => [...brushgs.controls.camera(320, 240).viewmat]")
    page.evaluate("eyes => { device.eyes = eyes; }", eyes_of_device())
    page.get_by_role("button", name="Enter VR").press("Enter")
    wait_until(page, "brushgs.isPaused")
    pixels = np.frombuffer(base64.b64decode(page.evaluate(FRAME, 0)), np.uint8)
    drawn = page.evaluate("brushgs.framesDrawn")
    left, right = np.split(pixels.reshape(240, 320, 4), 2, axis=1)
    for eye in (left, right):
        assert (eye != 255).any(axis=-1).mean() > 0.05
    assert (left != right).any()
    page.evaluate("() => brushgs.invalidate()")
    page.evaluate("() => device.session.squeeze(device, true)")
    for time in (20, 500, 1100):
        page.evaluate(FRAME, time)
    wait_until(page, "!brushgs.isPaused")
    wait_until(page, f"brushgs.framesDrawn === {drawn + 1}")
    assert page.evaluate("() => [...brushgs.controls.camera(320, 240).viewmat]") == before
