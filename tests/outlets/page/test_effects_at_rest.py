"""Effects of an open page are made beside it, by workers: the same as in the page itself."""

import numpy as np
import pytest

from brushgs.brushes.brush_set import BrushSet
from brushgs.outlets.page.html import page_script
from brushgs.rendering.tonal import Blacks
from brushgs.still_life import still_life_camera
from tests.kit.for_each import for_each
from tests.outlets.page.page_file import SIZE, scene, screen, seen, wait_until, write_page
from tests.outlets.page.studio import contents_of, painting_of

OPENED = {"reduced_motion": "reduce", **SIZE}
NO_WORKERS = {
    "refused": "window.Worker = class { constructor() { throw new Error('refused'); } };",
    "broken": "window.Worker = class { postMessage() { this.onerror(new Event('error')); } };",
}
BUSY = """() => {
  brushgs._makeEffects();
  const { _workers: workers } = brushgs, [worker] = workers._busy;
  window.answers = [];
  worker.addEventListener("message", () => window.answers.push("late"));
  brushgs.panel.chooseShare(50);
  return new Promise((resolve) => requestAnimationFrame(() => setTimeout(() => resolve(workers._busy.size))));
}"""


@pytest.fixture(scope="module")
def painting():
    blacks = Blacks(0.5, 1e-3, (0.1, 0.12, 0.2), (0.95, 0.9, 0.85))
    return painting_of(scene()[0], BrushSet.of("gaussian"), coat={"effect": blacks})


@pytest.fixture(scope="module")
def path(painting, tmp_path_factory):
    contents = contents_of(painting, still_life_camera(**SIZE), background=(1, 1, 1))
    return write_page(tmp_path_factory.mktemp("ink") / "ink.html", contents)


def at_rest(page):
    """What is shown with effects, [H, W, 4] uint8."""
    wait_until(page, "brushgs._made !== null")
    return screen(page)


def made_in_the_page(page):
    page.evaluate("brushgs._made = null")
    return screen(page)


def test_effects_at_rest_are_those_of_render_and_any_change_cancels_them(open_page, path, painting):
    page = open_page(path, **OPENED)
    shown = at_rest(page)
    assert page.evaluate("[brushgs._workers._idle.length, brushgs._workers._busy.size]") == [1, 0]
    camera = seen(page, contents_of(painting, still_life_camera(**SIZE)).header, **SIZE)
    exact = painting.frame(camera).over((1, 1, 1))
    off = shown[..., :3] / 255 - exact
    assert -10 * np.log10(np.mean(off**2)) > 48
    assert np.array_equal(made_in_the_page(page), shown)
    assert page.evaluate(BUSY) == 0
    fewer = at_rest(page)
    assert (fewer != shown).any(axis=2).mean() > 0.01
    assert np.array_equal(made_in_the_page(page), fewer)
    assert page.evaluate("window.answers") == []


@for_each("script", NO_WORKERS)
def test_a_browser_that_lets_a_page_have_no_workers_makes_effects_in_it(open_page, path, script):
    page = open_page(path, init_script=NO_WORKERS[script], **OPENED)
    shown = at_rest(page)
    assert page.evaluate("brushgs._workers._script") is None
    assert np.array_equal(made_in_the_page(page), shown)


SAVED = """() => {
  brushgs.invalidate();
  return new Promise((resolve) => requestAnimationFrame(() => setTimeout(async () => {
    const { painter, _workers: workers } = brushgs, { paint } = painter, madeHere = [];
    painter.paint = (camera, options) => {
      if (options.isWhole !== false && !options.made) madeHere.push(options);
      paint.call(painter, camera, options);
    };
    const picture = brushgs.picture(), numBusy = workers._busy.size;
    resolve([(await picture).size > 0, numBusy, madeHere.length, brushgs._made !== null]);
  })));
}"""
LEFT = """() => {
  const left = brushgs._makeEffects(), saved = brushgs.picture();
  brushgs.panel.chooseShare(50);
  return Promise.all([left, saved]).then(([, picture]) => picture.size > 0);
}"""


def test_a_picture_waits_for_effects_and_for_none_that_a_change_cancelled(open_page, path):
    page = open_page(path, **OPENED)
    at_rest(page)
    assert page.evaluate(SAVED) == [True, 1, 0, True]
    assert page.evaluate(LEFT)


ANSWER = """(script) => new Promise((resolve) => {
  const worker = new Worker(URL.createObjectURL(new Blob([script])));
  worker.onmessage = ({ data }) => resolve(data.layers.map((layer) => layer.length));
  worker.onerror = ({ message }) => resolve(message);
  const camera = { viewmat: Array(16).fill(0), fx: 1, fy: 1, cx: 1, cy: 1, width: 2, height: 3, near: 0 };
  const facts = { threshold: 0.5, leastArea: 0, ink: [0, 0, 0], paper: [1, 1, 1] };
  const nothing = { boxes: new Float32Array(0), count: 0 };
  worker.postMessage({ kind: "blacks", facts, ...nothing, camera, step: 1, middle: 0 });
})"""


@for_each("live", [False, True])
def test_a_worker_runs_the_script_of_a_page_and_that_of_the_studio(open_page, live):
    assert open_page("about:blank").evaluate(ANSWER, page_script(live=live)) == [4 * 6, 2 * 6]
