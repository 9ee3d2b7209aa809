"""Fields of directions in the page against those of `Canonical`."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.outlets.page.fields import LARGEST, LEVELS, field_codes
from brushgs.rendering.canonical import Canonical, fit_canonical
from brushgs.values.quats import rotation_matrices
from tests.outlets.page.paintings import contents_of, some_coat, some_strokes
from tests.outlets.page.strokes import CAMERAS, hard_strokes
from tests.outlets.page.studio import painting_of
from tests.scenes import still_life_of

FLAT = bg.StrokeTexture.open("flat")
RADIANS = 1e-4


def in_fields(strokes, fields, **options):
    """A painting of strokes that point as their fields have them."""
    return painting_of(strokes, FLAT, coat={"fields": fields}, lock="canonical", **options)


def random_fields(count, seed=0):
    """Any fields; every fifth stroke follows its longest axis."""
    draw = np.random.default_rng(seed)
    frames = rotation_matrices(draw.normal(size=(count, 4)))
    return Canonical(frames[:, :, 0], frames[:, :, 1], np.arange(count) % 5 == 0)


def decoded(codes, strokes):
    """The fields that codes stand for."""
    omitted = codes[:, 0] // (LEVELS + 1)
    others = ((codes & LEVELS) / LEVELS * 2 - 1) * LARGEST
    quats = np.zeros((len(codes), 4))
    for k in range(3):
        quats[np.arange(len(codes)), k + (k >= omitted)] = others[:, k]
    quats[np.arange(len(codes)), omitted] = np.sqrt(np.maximum(1 - (others**2).sum(axis=1), 0))
    frames = rotation_matrices(strokes.quats) @ rotation_matrices(quats)
    return Canonical(frames[:, :, 0], frames[:, :, 1], ~codes.any(axis=1))


def turns(studio, painting, rows, camera, tolerance=1e-3):
    """Radians by which the strokes of the page differ in direction; in size and opacity they agree."""
    found = studio.boxes(camera)
    expected, _ = painting.coats[0].boxes(camera)
    row_of = np.full(rows.max() + 1, -1)
    row_of[rows] = np.arange(len(rows))
    found = found[row_of[expected.ids]]
    assert found[:, 7].all()
    np.testing.assert_allclose(found[:, 2:4], expected.half_extents, rtol=tolerance, atol=1e-3)
    np.testing.assert_allclose(found[:, 6], expected.opacities, rtol=tolerance, atol=1e-3)
    return 2 * np.arcsin(np.abs(np.sin((found[:, 4] - expected.angles) / 2)))


def test_strokes_of_any_shape_point_as_in_python(studio):
    strokes = hard_strokes(600, degree=0)
    painting = in_fields(strokes, random_fields(600))
    rows = studio.load(painting, CAMERAS[0]).rows[0]
    held = decoded(field_codes(painting.coats[0].fields, strokes), strokes)  # what the page has
    for camera in CAMERAS:
        turn = turns(studio, in_fields(strokes, held), rows, camera)
        assert len(turn) > 100
        assert turn.max() < RADIANS


def test_fitted_fields_turn_no_stroke_by_a_degree_and_both_eyes_take_one_direction(studio):
    scene = still_life_of(3000)
    strokes = bg.cluster(scene, 600)
    painting = in_fields(strokes, fit_canonical(strokes))
    cameras = bg.orbit(scene, 10, width=320, height=240)
    rows = studio.load(painting, cameras[0]).rows[0]
    worst = [np.degrees(turns(studio, painting, rows, camera, 0.01)).max() for camera in cameras]
    assert max(worst) < 1
    head = cameras[3]
    aside = np.eye(4)[0][:, None] * (0, 0, 0, 0.03)  # to the right
    eyes = [replace(head, viewmat=head.viewmat - side * aside) for side in (-1, 1)]
    between, one, other = (studio.boxes(camera, head=head) for camera in (head, *eyes))
    seen = (between[:, 7] == 1) & (one[:, 7] == 1) & (other[:, 7] == 1)
    assert seen.sum() > 100
    for eye in (one, other):
        assert not np.allclose(eye[seen, :2], between[seen, :2], atol=0.1)
        np.testing.assert_allclose(eye[seen, 4], between[seen, 4], rtol=0, atol=1e-6)
        np.testing.assert_allclose(eye[seen, 8:11], between[seen, 8:11], rtol=0, atol=1e-6)
    assert np.abs(np.sin(studio.boxes(eyes[0])[seen, 4] - one[seen, 4])).max() > 1e-3


def test_the_column_is_six_bytes_a_stroke_and_only_where_there_are_fields():
    strokes = some_strokes(50)
    fields = random_fields(50)
    coat = replace(some_coat(strokes, lock="canonical"), fields=fields)
    contents = contents_of(coat, some_coat(strokes))
    first, second = contents.header["coats"]
    assert (first["lock"], second["lock"]) == ("canonical", "anchor")
    assert "fields" not in second["arrays"]
    codes = contents.arrays[first["arrays"]["fields"]]
    assert (codes.shape, codes.dtype) == ((50, 3), np.uint16)
    rows = contents.rows[0]
    np.testing.assert_array_equal(~codes.any(axis=1), fields.is_anchored[rows])
    found, kept = decoded(codes, strokes.take(rows)), ~fields.is_anchored[rows]
    np.testing.assert_allclose(found.facing[kept], fields.facing[rows][kept], atol=2e-4)
    np.testing.assert_allclose(found.along[kept], fields.along[rows][kept], atol=2e-4)
    assert contents.omitted == ()
    without = contents_of(some_coat(some_strokes(5), lock="canonical"))
    assert without.header["coats"][0]["lock"] == "anchor"
    assert "each view has its directions" in without.omitted[0]
