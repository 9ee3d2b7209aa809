"""A small painting as a page on disk, for tests of what surrounds the picture."""

import base64
from functools import cache

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.html import page_html
from brushgs.outlets.page.view import PageView
from tests.outlets.page.studio import decoded, painting_of
from tests.scenes import still_life_of

SIZE = {"width": 320, "height": 240}
NUM_STROKES = 1000
# 1x1, grey: in place of the still picture of a real page.
STILL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGNoAAAAggCBd81ytgAAAABJRU5ErkJggg=="
)


@cache
def scene():
    """The strokes, and how they are seen."""
    strokes = still_life_of(NUM_STROKES)
    return strokes, plain_first_view(strokes)


def shown(
    camera=None, *, view=None, title="pears", command=("pears.ply", ("--look", "oil")), stops=(), **framing
):
    """The contents of a page with the still life.

    Args:
        camera: of its first view; None to frame the scene.
        view: `PageView`; None for that of the scene and the camera.
        title: of the page.
        command: of the page.
        stops: of the page.
        framing: more arguments of `frame_scene`.
    """
    strokes, first = scene()
    if camera is None:
        camera = frame_scene(first, **{**SIZE, **framing})
    view = view or PageView.of(first, camera, framing.get("look_at"))
    painting = painting_of(strokes, bg.StrokeTexture.open("impasto"))
    more = {"title": title, "command": command, "background": (1, 1, 1), "stops": stops}
    return page_contents(painting, camera, view=view, **more)


def write_page(path, contents=None, *, still=STILL, **options):
    """Write a page, with options of `page_html`; returns its path."""
    contents = contents or shown()
    text = page_html(write_container(contents), title=contents.header["title"], still=still, **options)
    path.write_text(text, encoding="utf-8")
    return path


def pixels(camera, points):
    """[n, 2] where points [n, 3] are seen by a `Camera`."""
    seen = np.asarray(points) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    seen = seen @ camera.K.T
    return seen[:, :2] / seen[:, 2:]


def camera_of(facts, header):
    """The `Camera`, in world axes, of the numbers of a `PageCamera`."""
    viewmat = np.array(facts["viewmat"]).reshape(4, 4)
    viewmat[:3, 3] -= viewmat[:3, :3] @ header["origin"]
    K = np.array([[facts["fx"], 0, facts["cx"]], [0, facts["fy"], facts["cy"]], [0, 0, 1]])
    return bg.Camera(viewmat, K, int(facts["width"]), int(facts["height"]), facts["near"])


def violations(page):
    """What axe-core finds wrong for people who use screen readers or keys: [(rule, elements)]."""
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(page).response["violations"]
    return [(one["id"], [node["html"] for node in one["nodes"]]) for one in found]


def are_apart(a, b):
    """Whether two bounding boxes of a page do not overlap, but for rounding."""
    sides = (("x", "width"), ("y", "height"))
    return any(one[at] + one[size] <= two[at] + 0.01 for at, size in sides for one, two in ((a, b), (b, a)))


def wait_until(page, condition, argument=None):
    """Wait until an expression of a page is true; its policy forbids what Playwright does for this."""
    for _ in range(500):
        if page.evaluate(condition, argument):
            return
        page.wait_for_timeout(20)
    raise AssertionError(f"never became true: {condition}")


def settle(page):
    """Wait until a page moves no more; returns the number of pictures that it drew until then."""
    wait_until(page, "!brushgs._request && brushgs._drawnAt === null")
    return page.evaluate("brushgs.framesDrawn")


def seen(page, header, width=320, height=240):
    """The `Camera` that an open page shows, for a picture of so many pixels."""
    script = "([w, h]) => { const c = brushgs.controls.camera(w, h); return {...c, viewmat: [...c.viewmat]} }"
    return camera_of(page.evaluate(script, [width, height]), header)


PIXELS = """() => {
  const { gl, canvas } = brushgs;
  brushgs._paint(1);
  const pixels = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return btoa(Array.from(pixels, (byte) => String.fromCharCode(byte)).join(""));
}"""


def screen(page):
    """[H, W, 4] uint8 of what an open page shows, painted anew, upper rows first."""
    width, height = page.evaluate("[brushgs.canvas.width, brushgs.canvas.height]")
    return decoded(page.evaluate(PIXELS), np.uint8).reshape(height, width, 4)[::-1]
