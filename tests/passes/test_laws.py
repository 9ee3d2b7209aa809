"""Laws that bind the passes, each asserted once over a table of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import product
from typing import Any

import numpy as np

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.core.threads import at_most
from brushgs.passes.color.key_light import KeyLight
from brushgs.passes.color.pigments import use_pigments
from brushgs.passes.color.tone import grade, tones
from brushgs.passes.color.values import Values
from brushgs.passes.form.choose_brushes import mix_brushes
from brushgs.passes.form.defocus import defocus, focused
from brushgs.passes.form.edges import Around, find_edges, soften_edges
from brushgs.passes.form.material import Materials
from brushgs.passes.form.plane_axes import mark_axes
from brushgs.passes.form.saliency import saliency
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.contribution import visible_shares
from brushgs.passes.reduce.detail import color_detail
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.passes.style.choose_marks import Choice, choose_marks
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each
from tests.passes import scenes
from tests.passes.color.test_key import place_of
from tests.passes.color.test_recolor import painting
from tests.passes.form.planks import planks, turned_frame
from tests.passes.form.test_choose_brushes import KIT, SURFACES, wall
from tests.passes.form.test_saliency import framed
from tests.passes.reduce.test_floaters import is_apart
from tests.passes.scenes import covariances, gaussians_at, on_sphere, random_gaussians, replaced, rescaled
from tests.passes.style.test_dictionary import dictionary

MANY = 5000  # rows, enough for several threads
VIEWS = [bg.Camera.look_at((x, 0, -4), (0, 0, 0), width=160, height=120) for x in (-0.6, 0.0, 0.6)]
MARKS = Choice(dictionary(np.random.default_rng(0).random((40, 3))), np.arange(40, dtype=np.uint8), 1.0)
PALETTE = bg.Palette.of_image(painting())


@dataclass(frozen=True)
class Pass:
    """A pass and what it is tried on.

    Attributes:
        work: from Gaussians, and where all else is to go that it looks at, to Gaussians or columns of rows.
        scene: so many Gaussians, float64.
        laws: "order", "unit" (of the scene) and "place": what does not count.
        rtol, atol: of its outcome, which has no unit.
    """

    work: Callable[[bg.Gaussians, Callable[[bg.Gaussians], bg.Gaussians]], Any]
    scene: Callable[[int], bg.Gaussians] = random_gaussians
    laws: str = "order unit place"
    rtol: float = 1e-7
    atol: float = 1e-9


def kept(work: Callable[[bg.Gaussians], bg.Gaussians]) -> Callable:
    """Which rows a pass keeps that leaves some out."""

    def rows(gaussians: bg.Gaussians, _: object) -> np.ndarray:
        numbered = replace(gaussians, ids=np.arange(len(gaussians), dtype=np.int32))
        return np.isin(numbered.ids, work(numbered).ids)

    return rows


@cache
def floor() -> bg.Gaussians:
    return planks(4000, 1, frame=turned_frame())[1]


def oriented(field: str) -> Pass:
    def work(strokes: bg.Gaussians, moved: Callable[[bg.Gaussians], bg.Gaussians]) -> bg.Gaussians:
        return bg.orient(strokes, moved(floor()), field)

    return Pass(work, lambda num: planks(1, num, frame=turned_frame())[0], rtol=1e-6)


def faint(num: int) -> bg.Gaussians:
    strokes = random_gaussians(num, 5, size=0.15)
    return replaced(strokes, opacities=strokes.opacities**4)


def sparse(num: int) -> bg.Gaussians:
    """A ball, and a tenth of it far around."""
    scene = random_gaussians(num, size=0.05)
    away = np.where(np.arange(num) % 10, 0.3, 9.0)
    return replaced(scene, means=scene.means * away[:, None])


def layer(num: int) -> bg.Gaussians:
    """Discs beside each other."""
    rows = np.arange(num)
    means = np.stack([rows % 17, rows // 17, 0.1 * np.sin(rows)], axis=1)
    return gaussians_at(means, (0.34, 0.36, 0.03))


surfaces = partial(wall, colors=0.05, normals=0.4, sizes=0.2)


def gaps(strokes: bg.Gaussians, _: object) -> np.ndarray:
    order = np.argsort(strokes.scales, axis=1)
    axes = np.take_along_axis(rotation_matrices(strokes.quats.astype(float)), order[:, None], axis=2)
    sizes = np.take_along_axis(strokes.scales, order, axis=1)
    columns = strokes.means, sizes, axes, strokes.opacities
    return _core.growth(*(np.ascontiguousarray(column, float) for column in columns), 2)


def in_its_light(strokes: bg.Gaussians, moved: Callable[[bg.Gaussians], bg.Gaussians]) -> bg.Gaussians:
    lamp = np.array([0.6, -0.8, 0.0])
    return KeyLight.of(strokes, (), place_of(moved(random_gaussians(300)))).lit(lamp)


def body(num: int) -> bg.Gaussians:
    """Strokes all over a ball, light on one side."""
    means = on_sphere(max(num, 2))[:num]
    return gaussians_at(means, 3 / max(num, 1) ** 0.5, 0.5 + 0.4 * means[:, :1], quats=(1, 0.2, 0.5, 0.3))


def softened(strokes: bg.Gaussians, _: object) -> bg.Gaussians:
    edges = find_edges(strokes, VIEWS, Around(None, (0.5, 0.5, 0.5)), focus=strokes.means[:, 0])
    return soften_edges(strokes, edges)


def outstanding(strokes: bg.Gaussians, _: object) -> np.ndarray:
    return saliency(strokes, framed(strokes if len(strokes) else random_gaussians(2)))


PASSES = {
    "defocus": Pass(lambda s, _: defocus(s, focused(s, VIEWS, None), 0.7), body, "order"),
    "soften edges": Pass(softened, body, "order", atol=1e-6),
    "mix brushes": Pass(lambda s, _: mix_brushes(s, [(np.arange(3), 0.5)]).brushes, laws="order"),
    "values": Pass(lambda s, _: Values(warmth=8.0, middle=45.0).strokes(s)),
    "solidify": Pass(lambda s, _: bg.solidify(s), lambda num: random_gaussians(num, 3, size=0.3)),
    "orient by form": oriented("form"),
    "orient by color": oriented("color"),
    "choose brushes": Pass(lambda s, _: bg.choose_brushes(s, SURFACES, material=0.8), surfaces, "order"),
    "choose variants": Pass(lambda s, _: bg.choose_brushes(s, KIT), surfaces, "order"),
    "materials": Pass(lambda s, _: vars(Materials.of(s)), surfaces),
    "gaps": Pass(gaps, layer),
    "key light": Pass(in_its_light, rtol=1e-3, atol=1e-3),
    "saliency": Pass(outstanding, laws="order unit", atol=1e-3),
    "choose marks": Pass(lambda s, _: choose_marks(s, [MARKS]), laws="order"),
    "break colors": Pass(lambda s, _: bg.break_colors(s), laws="order", rtol=0, atol=1e-12),
    "break colors, followed": Pass(
        lambda s, _: bg.break_colors(s, follows=0.7), laws="order", rtol=0, atol=1e-12
    ),
    "tones": Pass(lambda s, _: tones(s), laws="order unit"),
    "directions of marks": Pass(lambda s, _: mark_axes(s, with_planes=False)[0] ** 2),
    "pigments": Pass(lambda s, _: use_pigments(s, 8), laws="unit place"),
    "grade": Pass(lambda s, _: grade(s, chroma=1.5, contrast=0.5)),
    "recolor": Pass(lambda s, _: bg.recolor(s, PALETTE, 0.7)),
    "prune": Pass(kept(lambda s: bg.prune(s, 0.3))),
    "prune as published": Pass(kept(lambda s: bg.prune(s, 0.3, weight="paper"))),
    "clean": Pass(kept(bg.clean), sparse),
    "floaters": Pass(lambda s, _: is_apart(s), sparse),
    "worth": Pass(lambda s, _: worth_keeping(s), faint),
    "detail": Pass(lambda s, _: color_detail(s), rtol=1e-12, atol=0),
    "visible": Pass(lambda s, _: visible_shares(s), rtol=1e-9, atol=0),
    "cluster": Pass(lambda s, _: group(s, max(1, len(s) // 15)).labels if len(s) else (), laws="unit"),
}


def found(one: Pass, gaussians: bg.Gaussians, moved: Callable = lambda x: x, unit: float = 1.0) -> dict:
    """Columns of the outcome, without a unit."""
    result = one.work(gaussians, moved)
    if not isinstance(result, bg.Gaussians):
        return result if isinstance(result, dict) else {"": np.asarray(result)}
    columns = {"moved": (result.means - gaussians.means) / unit, "shapes": covariances(result) / unit**2}
    columns |= {"opacities": result.opacities, "sh": result.sh}
    return columns if result.brushes is None else columns | {"brushes": result.brushes}


def binding(law: str) -> list[str]:
    return [name for name, one in PASSES.items() if law in one.laws.split()]


def assert_close(one: Pass, actual: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> None:
    assert actual.keys() == expected.keys()
    for name, column in expected.items():
        np.testing.assert_allclose(actual[name], column, one.rtol, one.atol, err_msg=name)


@for_each("name", PASSES)
def test_rows_differ_in_what_a_pass_makes_of_them(name):
    """What the laws below compare is no constant."""
    columns = found(PASSES[name], PASSES[name].scene(300))
    assert any((column != column[0]).any() for column in columns.values())


@for_each("name", binding("order"))
def test_the_order_of_rows_does_not_count(name):
    one = PASSES[name]
    scene, rows = one.scene(300), np.random.default_rng(1).permutation(300)
    expected = {column: values[rows] for column, values in found(one, scene).items()}
    assert_close(one, found(one, scene.take(rows)), expected)


@for_each("unit", [1e-12, 1e-4, 2.0**-13, 2.0**13, 1e4, 1e12])
@for_each("name", binding("unit"))
def test_the_unit_of_the_scene_does_not_count(name, unit):
    one, scene = PASSES[name], PASSES[name].scene(300)

    def moved(gaussians):
        return rescaled(gaussians, unit)

    assert_close(one, found(one, moved(scene), moved, unit), found(one, scene))


@for_each("name", binding("place"))
def test_the_place_of_the_scene_does_not_count(name):
    one, scene = PASSES[name], PASSES[name].scene(300)

    def moved(gaussians):
        return replaced(gaussians, means=gaussians.means + np.arange(1, 4))

    assert_close(one, found(one, moved(scene), moved), found(one, scene))


@for_each("name", PASSES)
def test_the_number_of_threads_changes_no_bit(name):
    one = PASSES[name]
    scene, outcomes = one.scene(MANY), []
    for threads in (1, 3):
        with at_most(threads):
            outcomes.append(found(one, scene))
    for column, values in outcomes[0].items():
        np.testing.assert_array_equal(outcomes[1][column], values, err_msg=column)


def test_blocks_of_rows_do_not_count(monkeypatch):
    one = PASSES["recolor"]
    expected = found(one, one.scene(300))
    monkeypatch.setattr("brushgs.passes.color.color_map.ROWS_AT_A_TIME", 7)
    assert_close(one, found(one, one.scene(300)), expected)


@for_each("dtype", [np.float32, np.float64])
@for_each("name", PASSES)
def test_dtype_and_what_a_pass_is_not_about_are_kept(name, dtype):
    given = PASSES[name].scene(300).astype(dtype)
    ids = np.random.default_rng(2).permutation(300).astype(np.int32)
    given = replace(given, ids=ids, finest=1e-6, antialiased=True)
    result = PASSES[name].work(given, lambda gaussians: gaussians.astype(dtype))
    if isinstance(result, bg.Gaussians):
        for column in ("means", "quats", "scales", "opacities", "sh"):
            assert getattr(result, column).dtype == dtype, column
        np.testing.assert_array_equal(result.ids, ids)
        assert (result.finest, result.antialiased) == (given.finest, True)


@for_each("num", [0, 1, 2])
@for_each("name", PASSES)
def test_none_one_and_two_gaussians_are_enough(name, num):
    one = PASSES[name]
    for column, values in found(one, one.scene(300).take(slice(num))).items():
        assert len(values) == num, column
        assert np.isfinite(values).all(), column


def strange_rows() -> list[tuple[str, str, type]]:
    """Every pass with every scene, in one dtype or the other by turns."""
    pairs = product(enumerate(PASSES), enumerate(scenes.strange_strokes()))
    return [(name, scene, (np.float32, np.float64)[(i + j) % 2]) for (i, name), (j, scene) in pairs]


@for_each(("name", "scene", "dtype"), strange_rows())
def test_strange_strokes_come_out_finite(name, scene, dtype):
    """`Gaussians` itself refuses what is not finite and opacities out of range."""
    strokes = scenes.strange_strokes()[scene].astype(dtype)
    result = PASSES[name].work(strokes, lambda gaussians: gaussians.astype(dtype))
    if isinstance(result, bg.Gaussians):
        assert len(result) == len(strokes)
        return
    for column, values in result.items() if isinstance(result, dict) else [("", np.asarray(result))]:
        assert values.shape[:1] == (len(strokes),), column
        assert np.isfinite(values).all(), column
