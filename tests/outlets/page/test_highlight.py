"""A region highlighted: who is told of it, what it looks like, and that it leaves no trace."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.formats.pictures.images import read_image
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.view import PageView
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import paper
from tests.kit.for_each import for_each
from tests.outlets.page.page_file import SIZE, scene, screen, settle, wait_until, write_page
from tests.outlets.page.paintings import contents_of, some_coat, some_strokes
from tests.outlets.page.studio import painting_of

CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=120, height=80, fov_y=0.6)
LEFT, RIGHT = np.s_[:, :40], np.s_[:, 80:]  # of the picture: beyond the reach of what lies in the middle
VEIL, GREY = 0.76, 0.5
CALM = {"reduced_motion": "reduce"}
NAMES = ["pear", "<i>cloth</i>", "nobody's"]


def halves(count=400, *, seed=2):
    """Strokes all over the picture; those on its left are region 1, and none crosses from side to side."""
    draw = np.random.default_rng(seed)
    means = draw.uniform((-2, -1.5, -0.2), (2, 1.5, 0.2), (count, 3))
    means[:, 0] += 0.45 * np.sign(means[:, 0])
    return bg.Gaussians(
        means.astype(np.float32),
        draw.normal(size=(count, 4)).astype(np.float32),
        draw.uniform(0.05, 0.12, (count, 3)).astype(np.float32),
        draw.uniform(0.6, 1, count).astype(np.float32),
        draw.normal(0, 0.8, (count, 1, 3)).astype(np.float32),
        regions=(means[:, 0] < 0).astype(np.uint8),
    )


def paintings():
    """One of each way in which coats reach the picture."""
    strokes, flat = halves(), bg.StrokeTexture.open("flat")
    board = paper((0.9, 0.85, 0.8), width=120, height=80)
    plain = painting_of(strokes, bg.StrokeTexture.open("ellipse"))
    lit = painting_of(strokes, flat, surface=board, lamp=bg.Lamp(), relief=Relief(0.4, 1.2), underpaint=True)
    wash = Coat("wash", strokes, flat, RenderOptions.of(flat), blend="glaze")
    marks = Coat("marks", halves(seed=3), flat, RenderOptions.of(flat), dry=0.6, tolerance=2.0)
    covered = Coat("smudge", halves(seed=4), flat, RenderOptions.of(flat))
    glaze, dry = Painting((wash,), board, None), Painting((covered, marks), board, None)
    return {"plain": plain, "lit": lit, "glaze": glaze, "dry": dry}


def part(contents, region):
    """What `partOfRegion` makes of contents."""
    regions = [contents.arrays[coat["arrays"]["region"]] for coat in contents.header["coats"]]
    columns = [np.where(column == region, 255, 0).tolist() for column in regions]
    return {"columns": columns, "ground": int(region == 0), "region": region, "name": ""}


def test_the_column_and_the_names_of_regions_are_in_the_contents():
    strokes = some_strokes(200)
    regions = np.random.default_rng(0).integers(0, 4, 200).astype(np.uint8)
    coat, bare = some_coat(replace(strokes, regions=regions)), some_coat(some_strokes(9), name="backdrop")
    contents = contents_of(coat, bare, regions=["pear", "cloth"])
    assert contents.header["regions"] == ["pear", "cloth", "Region 3"]
    first, second = contents.header["coats"]
    column = contents.arrays[first["arrays"]["region"]]
    assert column.dtype == np.uint8
    np.testing.assert_array_equal(column, regions[contents.rows[0]])
    assert "region" not in second["arrays"]
    for without in (None, np.zeros(200, np.uint8)):  # as ever, byte for byte
        usual = contents_of(some_coat(strokes), title="a")
        found = contents_of(some_coat(replace(strokes, regions=without)), title="a", regions=["pear"])
        assert "regions" not in usual.header
        assert write_container(found) == write_container(usual)


@for_each("kind", ["plain", "lit", "glaze", "dry"])
def test_a_veil_lies_over_all_that_is_not_highlighted(studio, kind):
    painting = paintings()[kind]
    contents = studio.load(painting, CAMERA, background=(0.1, 0.3, 0.2))
    usual = studio.paint(CAMERA, ground=True)
    assert usual[..., :3].std() > 0.05
    for region, shown, other in ((1, LEFT, RIGHT), (0, RIGHT, LEFT)):
        found = studio.paint(CAMERA, ground=True, highlight=part(contents, region))
        is_shown = (found[shown] == usual[shown]).all(axis=2)
        below = (1 - VEIL) * usual[other][..., :3] + VEIL * GREY
        is_veiled = np.isclose(found[other][..., :3], below, atol=0.004).all(axis=2)
        # The bare ground between strokes lies elsewhere: on the left it is veiled for 1, and not for 0.
        assert is_shown.mean() > (0.6 if region == 1 else 0.999)
        assert is_veiled.mean() > (0.999 if region == 1 else 0.6)
        np.testing.assert_array_equal(found[..., 3], usual[..., 3])
    np.testing.assert_array_equal(studio.paint(CAMERA, ground=True), usual)


def test_regions_are_chosen_by_the_keyboard_and_let_go_without_a_trace(open_page, tmp_path):
    strokes, first = scene()
    regions = np.digitize(strokes.means[:, 1], np.quantile(strokes.means[:, 1], (0.3, 0.6)))  # by height
    camera = frame_scene(first, **SIZE)
    strokes = replace(strokes, regions=regions.astype(np.uint8))
    painting = painting_of(strokes, bg.StrokeTexture.open("impasto"))
    more = {"view": PageView.of(first, camera), "title": "pears", "command": ("a.ply", ())}
    contents = page_contents(painting, camera, **more, background=(1, 1, 1), regions=NAMES)
    page = open_page(write_page(tmp_path / "pears.html", contents), **CALM, width=1100, height=300)
    page.evaluate("brushgs.ready")
    settle(page)
    usual = screen(page)
    select = page.get_by_role("combobox", name="Highlight")
    missing = "nobody's (no strokes)"
    names = ["Nothing", "pear", "<i>cloth</i>", missing, "Elsewhere"]
    assert select.locator("option").all_inner_texts() == names
    assert select.locator("option:disabled").all_inner_texts() == [missing]
    assert select.bounding_box()["height"] >= 40
    page.locator("#ground").focus()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.id") == "region"
    page.keyboard.press("ArrowDown")
    wait_until(page, "brushgs.look.highlight !== null")
    assert page.evaluate("brushgs.look.highlight.name") == "pear"
    name = "pears: a painting of 1,131 strokes, pear highlighted"
    assert page.get_by_role("application", name=name).count() == 1
    settle(page)
    veiled = screen(page)
    changed = (veiled != usual).any(axis=2).mean()
    assert 0.3 < changed < 0.9985  # what is seen of the pear, 0.27 % of this wide strip, has no veil

    with page.expect_download() as saving:
        page.evaluate("brushgs.panel.savePicture()")
    assert saving.value.suggested_filename == "pears.png"
    saving.value.save_as(tmp_path / "a.png")
    saved = np.rint(255 * read_image(tmp_path / "a.png")[..., :3])
    np.testing.assert_array_equal(saved, usual[..., :3])
    np.testing.assert_array_equal(screen(page), veiled)

    select.select_option("Nothing")
    assert page.evaluate("brushgs.look.highlight") is None
    np.testing.assert_array_equal(screen(page), usual)
