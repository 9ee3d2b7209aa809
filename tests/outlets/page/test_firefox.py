"""An exported page in Firefox against the picture of `brushgs render`: 59 dB and more, in Chromium 62."""

import base64

import numpy as np

from brushgs.cli import main
from brushgs.formats.pictures.images import read_image
from tests.scenes import save_upright, still_life_of

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
    painter.paint(controls.restingCamera(width, height), look);
    canvas.toBlob((blob) => {
      const reader = new FileReader();
      reader.onload = () => done(reader.result.split(",")[1]);
      reader.readAsDataURL(blob);
    });
  }).catch((error) => done(String(error)));
"""


def test_a_page_shows_what_render_paints(firefox, tmp_path):
    scene = tmp_path / "pears.ply"
    save_upright(still_life_of(2000), scene)
    words = [str(scene), "--look", "oil", "--strokes", "500", "--see", "off", "--size", "320x240", "--quiet"]
    assert main(["export", *words, "-o", str(tmp_path / "a.html")]) == 0
    assert main(["render", *words, "-o", str(tmp_path / "a.png")]) == 0
    firefox.open(tmp_path / "a.html")
    (tmp_path / "page.png").write_bytes(base64.b64decode(firefox.evaluate(PAINT)))
    page, exact = (read_image(tmp_path / name)[..., :3] for name in ("page.png", "a.png"))
    decibels = -10 * np.log10(np.mean((page - exact) ** 2))
    assert decibels >= 48
