"""Places of the picture become settings: by clicks, lassos, lines and keys; and `render` paints the same."""

import numpy as np
import pytest

from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.options.where import Where
from brushgs.outlets.studio.settings import Settings, flags_of
from brushgs.passes.where import memberships
from brushgs.pipeline.report import Report
from tests.outlets.page.page_file import seen, violations
from tests.outlets.studio.conftest import FEW, until

SAID = Settings(focus=(0.1, -0.2, 0.0, 0.3), part="not half:1,0,0,0.5", up=(0.1, -1, 0), azimuth=70)


def test_render_with_the_command_or_the_saved_file_paints_the_same(scene, tmp_path):
    file = tmp_path / "said.toml"
    words = ["view", str(scene), *FEW, "--from", "left"]
    session = session_of(parse([*words, "--save", str(file)]))
    config = session.config(SAID)
    assert config.view.side is None
    session.save(SAID)
    saved = session_of(parse(["view", str(scene), "--config", str(file)]))
    told = session_of(parse(["view", str(scene), *FEW, *flags_of(SAID, {})]))
    assert saved.config(Settings()) == told.config(Settings()) == config
    painted = session.paint(SAID, Report())
    assert painted.prepared.plain is not None  # what is not painted
    assert all(word in painted.command for word in flags_of(SAID, {}))


def test_what_does_not_suit_the_command_line_is_refused(scene):
    given = [], ["--camera-file", "c.json"]
    session, cameras = (session_of(parse(["view", str(scene), *FEW, *more])) for more in given)
    for one, settings, sentence in (
        (session, Settings(part="mask:/etc/passwd"), "mask: reads files, which a page must not name"),
        (cameras, Settings(azimuth=20), "--azimuth cannot be combined with --camera-file"),
    ):
        with pytest.raises(ValueError, match=sentence):
            one.config(settings)


def settings_of(page, studio):
    """The settings of the server, once all changes are painted."""
    until(page, "window.brushgs.studio.isSettled")
    return studio.state()["settings"]


def middle_of(page):
    box = page.locator("#painting").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def draw(page, places):
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=8)
    page.mouse.up()


def test_keys_say_where_more_strokes_go_and_escape_says_nothing(viewed):
    page, studio = viewed
    more = page.get_by_role("button", name="More strokes here")
    more.press("Enter")
    assert more.get_attribute("aria-pressed") == "true"
    assert "Escape ends" in page.evaluate("document.activeElement.getAttribute('aria-label')")
    assert violations(page) == []
    page.keyboard.press("Escape")
    assert page.locator("#aim").is_hidden()
    assert page.evaluate("document.activeElement.textContent") == "More strokes here"
    before = page.evaluate("Array.from(brushgs.controls.target)")
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("+")
    page.keyboard.press("Enter")
    x, y, z, radius = settings_of(page, studio)["focus"]
    assert page.evaluate("Array.from(brushgs.controls.target)") == before  # arrows moved the circle alone
    strokes = studio._painted.prepared.strokes
    assert np.linalg.norm(strokes.means - (x, y, z), axis=1).min() < radius < 2
    options = page.evaluate("brushgs.contents.header.command.options")
    assert sum(word.startswith("--focus") for word in options) == 1
    page.get_by_role("button", name="Remove: More strokes in a ball").press("Enter")
    until(page, "document.querySelectorAll('[aria-label=\"What was said\"] li').length === 0")
    assert "focus" not in settings_of(page, studio)


def test_a_lasso_is_the_part_that_is_seen_in_it(viewed):
    page, studio = viewed
    prepared = studio._painted.prepared
    x, y = middle_of(page)
    corners = [(-120, -120), (120, -120), (120, 120), (50, 120), (50, -40), (-120, -40)]  # hollow
    page.get_by_role("button", name="This part only").click()
    draw(page, [(x + a, y + b) for a, b in [*corners, (-119, -118)]])
    part = settings_of(page, studio)["part"]
    canvas = page.locator("#painting").bounding_box()
    camera = seen(page, page.evaluate("brushgs.contents.header"), canvas["width"], canvas["height"])
    means = studio._painted.prepared.whole_scene.means.astype(float)
    at = means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    places = (at @ camera.K.T)[:, :2] / at[:, 2:] - (canvas["width"] / 2, canvas["height"] / 2)
    a, b = places.T
    is_in = ((abs(a) < 120) & (b > -120) & (b < -40)) | ((a > 50) & (a < 120) & (abs(b) < 120))
    edge = np.min([abs(abs(a) - 120), abs(abs(b) - 120), abs(a - 50), abs(b + 40)], axis=0)
    found = memberships(Where.parse(part), prepared.whole_scene) > 0.5
    is_far = ~found & (edge > 4) & is_in  # behind what is seen there
    assert not (found & ~is_in & (edge > 4)).any()
    assert (found & is_in).sum() > 5
    assert is_far.sum() < 0.5 * is_in.sum()
    assert not is_far.any() or at[is_far, 2].min() >= at[found, 2].max() - 0.01
    assert studio._painted.prepared.plain is not None


def test_a_line_is_up_and_the_view_is_the_front(viewed):
    page, studio = viewed
    x, y = middle_of(page)
    camera = seen(page, page.evaluate("brushgs.contents.header"))
    page.get_by_role("button", name="This is up").click()
    draw(page, [(x, y + 60), (x + 60, y)])
    up = settings_of(page, studio)["up"]
    right, down = camera.viewmat[:2, :3]
    np.testing.assert_allclose(up, (right - down) / np.sqrt(2), atol=0.02)
    np.testing.assert_allclose(page.evaluate("brushgs.contents.header.up"), up, atol=1e-4)
    page.focus("#painting")
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    looks = page.evaluate("Array.from(brushgs.controls.orbit.axes(brushgs.controls.target).slice(6))")
    page.get_by_role("button", name="This is the front").click()
    assert {"up", "azimuth"} <= set(settings_of(page, studio))
    first = np.array(page.evaluate("brushgs.contents.header.camera.viewmat")).reshape(4, 4)[2, :3]
    level = [one - np.dot(one, up) * np.array(up) for one in (np.array(looks), first)]
    level = [one / np.linalg.norm(one) for one in level]
    np.testing.assert_allclose(level[0], level[1], atol=0.02)


@pytest.mark.parametrize(
    "viewed", [{"width": 390, "height": 700, "has_touch": True, "is_mobile": True}], indirect=True
)
def test_a_tap_says_which_part_on_a_phone(viewed):
    page, studio = viewed
    page.get_by_role("button", name="Studio", exact=True).tap()
    page.get_by_role("button", name="This part only").tap()
    assert page.locator("#studio").is_hidden()  # the picture must be seen
    page.touchscreen.tap(*middle_of(page))
    assert settings_of(page, studio)["part"].startswith("sphere:")
    assert page.locator("#studio").is_visible()
    page.evaluate("for (let i = 0; i < 9; i++) brushgs.controls.press('-')")
    page.get_by_role("button", name="More strokes here").tap()
    page.touchscreen.tap(8, 100)
    assert "There is no paint" in page.locator("#pointWords").text_content()
    assert page.locator("#aim").is_visible()
