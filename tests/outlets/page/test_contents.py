from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.cameras.first_view import plain_first_view
from brushgs.cameras.framing import frame_scene
from brushgs.outlets.page.columns import coarse_to_fine
from brushgs.outlets.page.view import PageView
from brushgs.rendering.border import thin_to_border
from brushgs.rendering.options import project_with
from brushgs.rendering.relief import Relief
from brushgs.rendering.streaks import streak_starts
from tests.kit.for_each import for_each
from tests.outlets.page.paintings import CAMERA, VIEW, contents_of, some_coat, some_strokes
from tests.scenes import still_life_of


def column(contents, name, coat=0):
    return contents.arrays[contents.header["coats"][coat]["arrays"][name]]


def test_columns_are_those_of_the_strokes_in_another_order_but_of_what_nobody_would_see():
    strokes = some_strokes(300, degree=2)
    faint, sh = np.array(strokes.opacities), np.array(strokes.sh)
    faint[[3, 7]] = 0.5 / 255
    sh[5] = 1e6
    strokes = replace(strokes, opacities=faint, sh=sh)
    contents = contents_of(some_coat(strokes))
    rows = contents.rows[0]
    assert sorted(rows) == [row for row in range(300) if row not in (3, 7)]
    assert contents.header["coats"][0]["count"] == contents.num_strokes == 298
    for name in ("means", "quats", "scales"):
        assert column(contents, name).dtype == np.float32
    relative = strokes.means.astype(np.float64) - VIEW.center
    np.testing.assert_array_equal(column(contents, "means"), relative[rows].astype(np.float32))
    np.testing.assert_array_equal(column(contents, "scales"), strokes.scales[rows])
    units = strokes.quats / np.linalg.norm(strokes.quats, axis=1, keepdims=True)
    np.testing.assert_allclose(column(contents, "quats"), units[rows], atol=1e-7)
    np.testing.assert_array_equal(column(contents, "opacities"), strokes.opacities[rows].astype(np.float16))
    largest = np.finfo(np.float16).max
    np.testing.assert_array_equal(
        column(contents, "sh"), np.clip(strokes.sh[rows], -largest, largest).astype(np.float16)
    )
    assert contents.header["origin"] == VIEW.center.tolist()


def test_a_share_of_the_strokes_carries_the_most_paint():
    strokes = some_strokes(500)
    order = coarse_to_fine(strokes)
    paint = np.sort(strokes.scales, axis=1)[:, 1:].prod(axis=1) * strokes.opacities
    assert (np.diff(paint[order]) <= 0).all()
    equal = bg.Gaussians(*(np.repeat(values[:1], 5, axis=0) for values in strokes.columns().values()))
    np.testing.assert_array_equal(coarse_to_fine(equal), np.arange(5))


def test_what_belongs_to_a_row_stays_with_it():
    strokes = some_strokes(400)
    options = {"streaks": 0.1, "relief": Relief(thickness=0.3, gain=1.1, by_light=0.5), "border": 0.2}
    coat = some_coat(strokes, normals=np.asarray(strokes.means), **options)
    contents = contents_of(coat)
    rows = contents.rows[0]
    square = replace(CAMERA, width=1000, height=750)  # where a pixel is that of the canvas
    boxes, _ = project_with(strokes, square, coat.options)
    place = np.argsort(rows)[boxes.ids]  # of each box among the rows of the page
    assert len(boxes) > 100
    np.testing.assert_array_equal(column(contents, "streakStart")[place], streak_starts(boxes))
    np.testing.assert_array_equal(column(contents, "relief")[place], boxes.reliefs.astype(np.float16))
    np.testing.assert_array_equal(column(contents, "normals"), strokes.means[rows].astype(np.float16))
    thin = thin_to_border(boxes, square, width=0.2)
    chance = column(contents, "chance")[place].astype(float)
    inside = np.minimum(boxes.centers, (1000, 750) - boxes.centers).min(axis=1) / 750
    left = np.clip((inside / 0.2 + 0.35 - 1.1 * chance) / 0.25, 0, 1)
    np.testing.assert_allclose(thin.opacities, boxes.opacities * left, atol=2e-3)


def test_brushes_that_no_stroke_uses_are_left_out_and_equal_ones_stored_once():
    names = ["flat", "dab", "impasto", "swirl"]
    strokes = some_strokes(90, brushes=4)
    chosen = np.where(strokes.brushes == 1, 2, strokes.brushes).astype(np.uint8)
    several = some_coat(replace(strokes, brushes=chosen), names, underpaint=True)
    single = some_coat(some_strokes(5), "swirl")
    contents = contents_of(several, single)
    header = contents.header
    assert [brush["name"] for brush in header["brushes"]] == ["flat", "impasto", "swirl"]
    first, second = header["coats"]
    assert (first["brushes"], second["brushes"]) == ([0, 1, 2], [2])
    assert "brush" not in second["arrays"]
    rows, options = contents.rows[0], several.options
    of_page = column(contents, "brush")
    for k, row in enumerate((0, 2, 3)):
        np.testing.assert_array_equal(of_page == k, chosen[rows] == row)
        assert first["numSigmas"][k] == options.num_sigmas[row]
        assert first["underpaint"]["reach"][k] == options.underpaint.reach[row]
        texture = bg.StrokeTexture.open(names[row])
        image = header["brushes"][k]
        coverage = contents.arrays[image["coverage"]]
        assert coverage.shape == (image["rows"], image["columns"])
        np.testing.assert_array_equal(coverage, texture.coverage)
        height = contents.arrays[image["height"]]
        np.testing.assert_array_equal(height, np.rint(texture.height * 255).astype(np.uint8))


def test_a_picture_behind_the_strokes_is_stored_smaller_and_that_is_told():
    picture = np.random.default_rng(0).uniform(0, 1, (30, 1280, 3)).astype(np.float32)
    contents = contents_of(some_coat(some_strokes(4)), background=picture)
    found = contents.header["surface"]
    assert (found["kind"], found["strength"], contents.header["background"]) == ("flat", 0.0, None)
    stored = contents.arrays[found["image"]]
    expected = picture.astype(float).reshape(15, 2, 640, 2, 3).mean(axis=(1, 3))
    assert np.abs(stored / 255 - expected).max() <= 0.5 / 255 + 1e-6
    assert any("1280 x 30 to 640 x 15" in sentence for sentence in contents.omitted)


NOT_SHOWN = {"blend": {"order": "soft"}, "tracked": {"lock": "track"}, "bilinear": {"filter": "bilinear"}}


@for_each("told, options", [("", {}), *NOT_SHOWN.items()])
def test_what_the_page_does_not_show_is_told(told, options):
    coat = some_coat(some_strokes(4), **options)
    omitted = contents_of(coat, coat).omitted
    assert (len(omitted), told in "".join(omitted)) == (bool(told), True)


def test_a_scene_that_is_seen_from_inside_says_so_unless_something_is_looked_at():
    first_view = replace(plain_first_view(still_life_of(2000)), eye=np.zeros(3))
    camera = frame_scene(first_view, width=64, height=48)
    assert PageView.of(first_view, camera).is_inside
    assert not PageView.of(first_view, camera, "subject").is_inside
