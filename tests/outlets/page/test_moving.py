"""Pages of moving scenes: strokes are where `render` has them, at any moment, and the page plays."""

import math

import numpy as np
import pytest

from brushgs.cli import main
from brushgs.options.painting import PaintConfig
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.export import view_of
from brushgs.outlets.page.motion import PageMotion
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from tests.clips import clip_of, save_clip
from tests.outlets.page.page_file import settle, violations, wait_until, write_page
from tests.outlets.page.read import read_page
from tests.outlets.page.studio import encoded

COPY = ["clipboard-read", "clipboard-write"]
CALM = {"reduced_motion": "reduce"}
CONFIG = {"cluster": {"strokes": 90}, "view": {"size": (160, 120)}}
CONFIG = PaintConfig.of(CONFIG | {"draw": {"lock": "canonical", "order": "depth"}})


@pytest.fixture(scope="module")
def moving(tmp_path_factory):
    """A painting of a clip, and the contents of its page."""
    clip = clip_of(save_clip(tmp_path_factory.mktemp("clip") / "frames"))
    ready = prepare(clip, CONFIG, Report(), asks=(*PICTURE, "first_view"))
    more = {"title": "a body", "command": ("frames", ()), "background": (1, 1, 1)}
    more |= {"view": view_of(ready, CONFIG), "motion": PageMotion.of(ready.moving)}
    return ready, page_contents(ready.painting, ready.camera, **more)


def test_strokes_are_where_render_has_them(studio, moving):
    ready, contents = moving
    data = encoded(write_container(contents))
    studio.page.evaluate("data => studio.load(data)", data)
    film, rows = ready.moving.film, contents.rows[0]
    moved, worst = 0.0, 0.0
    first = None
    for frame, time in enumerate(np.arange(len(film.times)) / film.fps):
        studio.page.evaluate("t => studio.painter.move(t)", float(time))
        found = studio.boxes(ready.camera)
        coat = ready.painting.coats[0].posed(ready.moving.pose(frame))
        expected, _ = coat.boxes(ready.camera)
        row_of = np.full(rows.max() + 1, -1)
        row_of[rows] = np.arange(len(rows))
        found = found[row_of[expected.ids]]
        worst = max(worst, float(np.abs(found[:, :2] - expected.centers).max()))
        np.testing.assert_allclose(found[:, 2:4], expected.half_extents, rtol=0.02, atol=0.05)
        np.testing.assert_allclose(found[:, 8:11], expected.colors, rtol=0, atol=0.01)
        np.testing.assert_allclose(found[:, 6], expected.opacities, rtol=0, atol=0.01)
        turns = 2 * np.arcsin(np.abs(np.sin((found[:, 4] - expected.angles) / 2)))
        assert np.degrees(turns).max() < 1  # 0.27, of poses between keys
        first = expected if first is None else first
        both = np.intersect1d(first.ids, expected.ids, return_indices=True)[1:]
        moved = max(moved, float(np.abs(first.centers[both[0]] - expected.centers[both[1]]).max()))
    assert moved > 20  # pixels
    assert worst < 1


def shot(page):
    settle(page)
    return page.locator("#painting").screenshot()


def test_it_is_scrubbed_stepped_and_played_and_its_link_keeps_the_moment(open_page, tmp_path, moving):
    page = open_page(write_page(tmp_path / "a.html", moving[1]), **CALM, permissions=COPY)
    page.evaluate("brushgs.ready")
    assert page.evaluate("brushgs.player.isPlaying") is False  # where motion is reduced
    start = shot(page)
    page.locator("#moment").evaluate("e => { e.value = e.max; e.dispatchEvent(new Event('input')); }")
    duration = page.evaluate("brushgs.player.duration")
    assert page.evaluate("brushgs.player.seconds") == pytest.approx(duration)
    assert shot(page) != start
    page.keyboard.press(",")
    assert page.evaluate("brushgs.player.seconds") == pytest.approx(duration - 1 / 24)
    page.locator("#link").press("Enter")
    assert f"&t={duration - 1 / 24:.2f}"[:6] in page.locator("#linkText").input_value()
    page.keyboard.press("Escape")
    page.evaluate("location.hash = '#t=0.05'")
    wait_until(page, "Math.abs(brushgs.player.seconds - 0.05) < 1e-9")
    page.evaluate("brushgs.contents.header.command.options.push('--time=0.4', '--keep', '1')")
    page.evaluate("brushgs.panel.copyCommand()")
    command = page.evaluate("navigator.clipboard.readText()")
    assert " --keep 1 --time 0.05 " in command  # in place of the moment of the options
    assert "0.4" not in command.split("--size")[0]
    assert violations(page) == []
    page.evaluate("brushgs.player.seek(0)")
    page.locator("#play").click()
    wait_until(page, "brushgs.player.seconds > 0.02")
    page.evaluate("brushgs.player.seek(brushgs.player.duration - 0.01)")
    wait_until(page, "brushgs.player.seconds < 0.12")  # it begins again
    page.keyboard.press("k")
    assert page.evaluate("brushgs.player.isPlaying") is False


# What a double tap on each stroke centers on at both ends of a clip; its mean and longest axis.
TAPPED = """() => {
  const { controls, painter, player } = brushgs;
  let point = null;
  controls.orbit = Object.create(controls.orbit, { lookAt: { value: (_, found) => { point = found; } } });
  return [0, player.duration].map((seconds) => {
    player.seek(seconds);
    const { means, scales } = painter.columns[0];
    return Array.from({ length: means.length / 3 }, (_, i) => {
      const mean = [...means.subarray(3 * i, 3 * i + 3)];
      const size = Math.max(...scales.subarray(3 * i, 3 * i + 3));
      const camera = controls.camera(controls._width, controls._height), V = camera.viewmat;
      const seen = (r) => mean.reduce((sum, value, k) => sum + V[r + k] * value, V[r + 3]);
      const [x, y, z] = [seen(0), seen(4), seen(8)];
      point = null;
      controls.centerOn((camera.fx * x) / z + camera.cx, (camera.fy * y) / z + camera.cy);
      return { mean, size, point };
    });
  });
}"""


def test_a_double_tap_centers_on_strokes_where_they_are_shown(open_page, tmp_path, moving):
    page = open_page(write_page(tmp_path / "a.html", moving[1]), **CALM)
    page.evaluate("brushgs.ready")
    shares = []
    for taps in zip(*page.evaluate(TAPPED), strict=True):
        far = np.linalg.norm(np.subtract(taps[0]["mean"], taps[1]["mean"])) > 6 * taps[0]["size"]
        hits = [t["point"] and math.dist(t["point"], t["mean"]) < 2 * t["size"] for t in taps]
        if far and hits[0]:  # a stroke in front, which moves by more than itself
            shares.append(bool(hits[1]))
    assert len(shares) > 5
    assert np.mean(shares) > 0.5  # others may have come before it


def test_the_command_exports_a_page_that_plays_and_one_moment_that_does_not(tmp_path, capsys):
    folder = save_clip(tmp_path / "frames")
    words = ["--strokes", "60", "--size", "96x72", "--quiet"]
    main(["export", str(folder), *words, "-o", str(tmp_path / "a.html")])
    main(["export", str(folder), *words, "--time", "0", "-o", str(tmp_path / "b.html")])
    headers = [read_page(tmp_path / name)[0] for name in ("a.html", "b.html")]
    assert headers[0]["motion"]["times"][-1] > 0.1
    assert "motion" not in headers[1]
