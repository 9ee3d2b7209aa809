"""Exported pages in Firefox against the exact renderer: 8 bits a channel leave at most 59 dB."""

import base64

import numpy as np

from brushgs.formats.pictures.images import read_image
from brushgs.outlets.page.view import PageView
from brushgs.outlets.page.write import write_page
from brushgs.still_life import still_life_camera
from tests.kit.for_each import for_each
from tests.outlets.page.looks import on_ground, painted_in, psnr
from tests.scenes import still_life_of

PAINT = """
  const { brushgs } = window;
  const sharp = async () => { // fine levels of many brushes come after the first picture
    await brushgs.ready;
    while (brushgs.painter._atlas._fillings.length) await new Promise((again) => setTimeout(again, 20));
  };
  sharp().then(() => {
    const { canvas, controls, painter, look, contents } = brushgs;
    const { width, height } = contents.header.camera;
    Object.assign(canvas, { width, height });
    painter.paint(controls.restingCamera(width, height), { ...look, ...OPTIONS });
    canvas.toBlob((blob) => {
      const reader = new FileReader();
      reader.onload = () => done(reader.result.split(",")[1]);
      reader.readAsDataURL(blob);
    });
  }).catch((error) => done(String(error)));
"""


@for_each(
    ("look", "least", "options"),
    [
        ("oil", 48, "{}"),
        ("ink", 48, "{}"),
        ("watercolour", 34, "{}"),
        ("watercolour", 34, "{ isWhole: false, wetStep: 1 }"),  # as it moves
        ("charcoal", 34, "{}"),
    ],
)
def test_a_page_shows_what_render_paints(firefox, tmp_path, look, least, options):
    camera = still_life_camera(width=240, height=180)
    painting, background = painted_in(look, still_life_of(2000), camera, lock="canonical")
    path = tmp_path / f"{look}.html"
    view = PageView(np.array((0.0, -1, 0)), np.zeros(3), 1.0, False)
    write_page(painting, camera, path, view=view, title="", command=("", ()), background=background)
    firefox.open(path)
    (tmp_path / "page.png").write_bytes(base64.b64decode(firefox.evaluate(PAINT.replace("OPTIONS", options))))
    page = read_image(tmp_path / "page.png")
    assert psnr(page, on_ground(painting, camera, background)) >= least
