"""The painter page in Firefox."""

import base64
import json

import brushgs as bg
from tests.outlets.painter.test_painter import picture_file
from tests.passes.add.test_stage import crate, plaza

DROP = """
  const drop = async (files) => {
    while (!window.brushgs.dropping) await new Promise((again) => setTimeout(again, 50));
    window.brushgs.isPaused = true;
    const { dropping } = window.brushgs;
    document.getElementById("dropCount").value = Math.log(300);
    for (const [name, text] of files) {
      await dropping.open(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
    }
    const { header } = window.brushgs.contents;
    const state = document.getElementById("dropState").textContent;
    return [header.coats.map(({ name, count }) => [name, count]), header.brushes[0].name, state];
  };
  drop(FILES).then(done, (error) => done(String(error)));
"""


def test_firefox_paints_a_dropped_scene_on_a_stage_with_a_dropped_brush(firefox, painter_file, tmp_path):
    bg.save(crate() + plaza(), tmp_path / "crate.ply")
    files = [picture_file(tmp_path, "cut_out"), tmp_path / "crate.ply"]
    given = [(path.name, base64.b64encode(path.read_bytes()).decode()) for path in files]
    firefox.open(painter_file)
    coats, brush, state = firefox.evaluate(DROP.replace("FILES", json.dumps(given)))
    counts = dict(coats)
    assert list(counts) == ["backdrop", "strokes"], state
    assert counts["backdrop"] > 200
    assert 200 < counts["strokes"] <= 300
    assert brush == "cut_out"
