"""Drawings as SVG: what an independent renderer makes of them, their layers, and what is refused."""

import io
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.brushes.soft import dot_brush, pen_brush
from brushgs.formats.pictures.images import read_image
from brushgs.formats.pictures.metadata import read_metadata
from brushgs.formats.pictures.svg import write_svg
from brushgs.options.painting import ViewConfig
from brushgs.options.rules import Rule, Rules
from brushgs.options.where import Where
from brushgs.pipeline.still import paint_file
from brushgs.rendering.coat import Coat
from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.marks import LaidCoat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.paths import paths_of
from brushgs.values.paths import Path2D, PathGroup, Paths
from brushgs.values.shot import Origin
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SIZE = 320, 240
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("svg") / "pears.ply"
    bg.save(still_life_of(2500), path)
    return path


def config_of(look):
    config = bg.Look.open(look).config
    strokes, cluster = replace(config.strokes, see="off", focus=None), replace(config.cluster, strokes=600)
    return replace(config, strokes=strokes, cluster=cluster, view=ViewConfig(size=SIZE))


def rendered(path):
    resvg = pytest.importorskip("resvg_py")
    content = bytes(resvg.svg_to_bytes(svg_string=path.read_text()))
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")) / 255


@for_each("look, least", [("ink", 30), ("stippling", 30), ("oil", 23.5)])
def test_another_renderer_shows_the_picture(scene, tmp_path, look, least):
    """In small pictures, where edges are most of it."""
    config = config_of(look)
    if look == "oil":
        config = replace(config, light=replace(config.light, relief=0.0, canvas="none"))
    drawing, picture = tmp_path / "a.svg", tmp_path / "a.png"
    for path in (drawing, picture):
        paint_file(scene, path, config)
    assert -10 * np.log10(np.mean((rendered(drawing) - read_image(picture)[..., :3]) ** 2)) >= least


def test_layers_are_coats_in_painting_order_and_regions(scene, tmp_path):
    rules = Rules((Rule(Where.parse("half:-1,0,0,0"), name="left <&> side"),))
    config, origin = replace(config_of("ink"), rules=rules), Origin("brushgs render <pears & co>")
    paint_file(scene, tmp_path / "a.svg", config, origin=origin)
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    assert (root.get("width"), root.get("viewBox")) == ("320", "0 0 320 240")
    coats = [one.get(f"{INKSCAPE}label") for one in root.findall(f"{SVG}g")]
    assert [one for one in coats if one in ("ground", "hatching", "lines")] == ["ground", "hatching", "lines"]
    layers = list(root.iter(f"{SVG}g"))
    assert {one.get(f"{INKSCAPE}groupmode") for one in layers} == {"layer"}
    assert len({one.get("id") for one in layers}) == len(layers)
    assert "left <&> side" in {one.get(f"{INKSCAPE}label") for one in layers}
    assert root.find(f"{SVG}rect").get("fill").startswith("#f")
    assert read_metadata(tmp_path / "a.svg").command == "brushgs render <pears & co>"
    assert (tmp_path / "a.svg").stat().st_size < 5e6


def coat_of(brush, center, half_extent, opacity, **options):
    """One stroke of a brush: its coat, and its box."""
    columns = ([center], [half_extent], [0.0], [1.0], [[0.0, 0, 0]], [opacity])
    boxes = bg.Boxes(*map(np.array, columns), ids=np.zeros(1, np.int32))
    strokes = bg.Gaussians(np.zeros((1, 3)), np.eye(1, 4), np.ones((1, 3)), np.ones(1), np.zeros((1, 1, 3)))
    return Coat("one", strokes, brush, RenderOptions.of(brush), **options), boxes


def only_path(laid, camera, kind):
    ((path,),) = (group.paths for group in paths_of([laid], camera).groups)
    assert path.kind == kind
    return path


def test_a_dot_half_hidden_has_half_of_the_paint():
    camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=800, height=600, fov_y=0.8)
    coat, boxes = coat_of(dot_brush(), [400.0, 300.0], [1.2, 1.2], 0.8)

    def opacity(depth):
        limit = np.full((600, 800), 2.0)
        limit[:, :400] = depth
        laid = LaidCoat(coat, boxes, DepthTest(limit, np.full(1, 0.01)), np.zeros((600, 800)))
        return only_path(laid, camera, "dot").opacity

    assert opacity(0.5) == pytest.approx(0.5 * opacity(2.0), rel=0.07)  # of 17 samples, one lies on the edge


def test_a_line_of_which_paper_takes_paint_is_narrower_and_not_lighter_than_that_share():
    camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=80, height=60, fov_y=0.8)
    coat, boxes = coat_of(pen_brush(), [40.0, 30.0], [20.0, 0.8], 1.0, dry=0.3)

    def line(share):
        taken = None if share is None else np.full((60, 80), share)
        return only_path(LaidCoat(coat, boxes, None, np.full((60, 80), share or 1.0), taken), camera, "line")

    whole, pencil = line(None), line(0.6)
    assert pencil.width < 0.9 * whole.width
    assert 0.6 < pencil.opacity < whole.opacity <= 1
    assert pencil.width * pencil.opacity == pytest.approx(0.6 * whole.width * whole.opacity)


def test_kinds_of_paths_and_an_empty_drawing(tmp_path):
    line = Path2D("line", np.array([[1.04, 2.0], [3.26, 2.0], [5, 5]]), 0.5, (0, 0, 0), 1.0)
    corners = np.array([[0, 0], [4, 0], [4, 4], [np.nan] * 2, [5, 5], [6, 5], [6, 6.0]])
    area = Path2D("area", corners, 0, (1, 0, 0), 0.5)
    dot = Path2D("dot", np.array([[3.0, 3.0]]), 2.0, (0, 0, 1), 1.0)
    soft = Path2D("soft", np.array([[3.0, 3.0], [5.0, 3.0], [3.0, 4.0]]), 0, (0, 0.5, 0), 0.3)
    write_svg(Paths(8, 6, None, (PathGroup("c", "", True, (line, area, dot, soft)),)), tmp_path / "a.svg")
    text = (tmp_path / "a.svg").read_text()
    assert 'd="M1,2l2.3,0 1.7,3" fill="none"' in text
    assert 'd="M0,0l4,0 0,4zM5,5l1,0 0,1z" fill="#ff0000" fill-opacity="0.5"' in text
    assert '<circle cx="3.00" cy="3.00" r="1.00" fill="#0000ff"/>' in text
    assert "multiply" in text
    assert "<rect" not in text
    write_svg(Paths(8, 6, (1, 1, 1), ()), tmp_path / "b.svg")
    assert [one.tag for one in ElementTree.parse(tmp_path / "b.svg").getroot()] == [f"{SVG}rect"]
    assert read_metadata(tmp_path / "b.svg") is None
