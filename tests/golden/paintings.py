"""Golden numbers of the steps to a painting, and golden pictures of whole paintings.

Clusters turn on the last bits of a sum, so each step starts from golden inputs: clusters as labels, strokes
as a file. `python -m tests.golden.paintings` makes all anew, in ten seconds: strokes.npz with the outcome of
each step, strokes.ply, and a picture for each of `LOOKS`; look at these before they are committed.
"""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs import cli
from brushgs.cameras.around import near_views, ring_views, subject_ahead
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.formats.styles import write_style
from brushgs.passes.reduce import cluster as clustering
from brushgs.passes.reduce.contribution import contributions
from brushgs.passes.reduce.features import cluster_features, spans_of
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.passes.reduce.split import cut, painted_errors
from brushgs.passes.reduce.worth import worth_keeping
from brushgs.passes.seen import seen_in
from brushgs.passes.style.features import COLOR_FEATURES, stroke_features
from brushgs.rendering.plain import PlainViews
from brushgs.values.gaussians import GAUSSIAN_COLUMNS
from brushgs.values.quats import rotation_matrices
from tests.golden.cases import FOLDER
from tests.io.styles import example
from tests.scenes import still_life_of

PAINTINGS = FOLDER / "paintings"
NUM_STROKES, SIZE = 250, (160, 120)
STAGE = ("--size", "96x72", "--backdrop", "stage", "--zoom", "0.7")
LOOKS = {  # name of the picture -> the words of its command
    "oil": ("--size", "640x480"),
    "charcoal": ("--look", "charcoal", "--size", "160x120"),
    "watercolour": ("--look", "watercolour", "--size", "160x120"),
    "impressionist": ("--look", "impressionist", "--size", "160x120"),
    "style": ("--style", "{style}:0.8", "--size", "120x90"),
    "stage_oil": STAGE,
    "stage_impressionist": ("--look", "impressionist", *STAGE),
    "stage_charcoal": ("--look", "charcoal", *STAGE),
    "stage_ink": ("--look", "ink", *STAGE),
    "stage_stippling": ("--look", "stippling", *STAGE),
    "stage_watercolour": ("--look", "watercolour", *STAGE),
    "stage_style": ("--style", "{style}:0.8", *STAGE),
}
SHOWN = slice(180, 320), slice(200, 390)  # of the large one, where lamp and linen are seen
VIEW = ("--up", "-y", "--azimuth", "5", "--elevation", "10", "--zoom", "1.3")
# Steps within a thousandth of the spread of their numbers; of rows where a choice hangs on rounding a few may
# differ. Pictures in steps of 8 bits, as those of `test_golden.py`.
NEAR, OFF_SHARE = 1e-3, 0.01
MEAN_LIMIT, FAR, FAR_SHARE = 0.05, 2, 0.005
# Of pictures in a style, whose colors are matched one by one: what rounds otherwise swaps some.
STYLE_MEAN_LIMIT, STYLE_FAR = 0.3, 4.5


@cache
def scene() -> bg.Gaussians:
    return still_life_of(2500)


@cache
def views() -> PlainViews:
    first = plain_first_view(scene())
    camera = frame_scene(first, width=SIZE[0], height=SIZE[1])
    around = [*near_views(camera, subject_ahead(camera, first), first.up), *ring_views(first, *SIZE)]
    return bg.plain_views(scene(), around)


def made_labels() -> np.ndarray:
    return clustering.group(scene(), NUM_STROKES, seed=1).labels.astype(np.int16)


def steps(golden: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """Each step, from the golden outcome of those before it; where that is not known yet, from its own."""
    done: dict[str, np.ndarray] = {}

    def put(name: str, values: np.ndarray) -> tuple[str, np.ndarray]:
        done[name] = golden.get(name, values)
        return name, values

    def strokes(step: str) -> bg.Gaussians:
        return bg.Gaussians(*(done[f"{step} {name}"] for name in GAUSSIAN_COLUMNS))

    labels = golden["labels"].astype(np.intp)
    points, weights = cluster_features(scene()), clustering.cluster_weights(scene())
    seen = seen_in(scene(), views())
    yield put("features", points)
    yield put("contributions", contributions(scene()))
    yield put("weights", weights)
    yield put("weights by views", seen.weights())
    yield put("seen colors", seen.gaussians.sh[:, 0])
    merged = merge_clusters(scene(), labels, visible=np.ones(len(labels)))
    yield from (put(f"merged {name}", getattr(merged, name)) for name in GAUSSIAN_COLUMNS)
    worst = np.arange(0, NUM_STROKES, 5)
    yield put("cut", cut(labels, worst, points, weights, spans_of(scene(), points)))
    yield put("errors", painted_errors(strokes("merged"), views()))
    yield put("kept", worth_keeping(strokes("merged")).astype(np.int8))
    for before, name, run in (
        ("merged", "solid", bg.solidify),
        ("solid", "turned", lambda one: bg.orient(one, scene(), "form")),
        ("turned", "repainted", lambda one: bg.repaint(one, scene(), views())),
        ("repainted", "broken", bg.break_colors),
    ):
        after = run(strokes(before))
        yield from (put(f"{name} {column}", getattr(after, column)) for column in GAUSSIAN_COLUMNS)
    nearly_grey = replace(strokes("broken"), sh=strokes("broken").sh * np.float32(0.02))
    two = bg.Palette.of_colors(np.array([[0.9, 0.1, 0.1], [0.1, 0.2, 0.9], [0.9, 0.8, 0.2]]))
    yield put("recolored sh", bg.recolor(nearly_grey, two).sh[::5, 0])
    shiny = replace(strokes("merged"), sh=strokes("merged").sh * np.float32(6))
    first = plain_first_view(scene())
    named = (*COLOR_FEATURES, "gloss", "height")
    yield put("stroke features", stroke_features(shiny, first, named).values[::5])
    kit = bg.BrushKit(("flat", "dry_brush"), ("dab",), ("impasto",), ("palette_knife",))
    small = frame_scene(plain_first_view(scene()), width=SIZE[0] // 3, height=SIZE[1] // 3)
    frame = bg.render(strokes("broken"), small, "dry_brush", underpaint=True, streaks=0.1, relief=True)
    yield put("small strokes", frame.rgb.reshape(-1, 3))
    y, x = np.mgrid[0:60, 0:80] / 6.0
    bumps = (2 * np.sin(x) * np.cos(0.7 * y)).astype(np.float32)
    yield put("lit", bg.light(np.full((60, 80, 3), 0.4, np.float32), bumps, bg.Lamp()).reshape(-1, 3))
    yield put("brushes", bg.choose_brushes(strokes("broken"), kit, seed=0).brushes)


def in_axes(name: str, values: np.ndarray) -> np.ndarray:
    """The numbers of a step; of quaternions axes without their signs, which LAPACK chooses."""
    return np.abs(rotation_matrices(values)) if name.endswith(" quats") else values


def is_same(found: np.ndarray, expected: np.ndarray) -> bool:
    """Whether the numbers of a step are the golden ones, up to rounding."""
    found, expected = (values.reshape(len(values), -1).astype(np.float64) for values in (found, expected))
    if found.shape != expected.shape:
        return False
    off = np.abs(found - expected).max(axis=1) > NEAR * max(float(expected.std()), 1e-12)
    return float(off.mean()) <= OFF_SHARE


def painted(name: str, folder: Path) -> np.ndarray:
    """The picture of a look, in steps of 8 bits."""
    write_style(example.painting(), folder / "evening.style")
    words = [word.format(style=folder / "evening.style") for word in LOOKS[name]]
    output = folder / f"{name}.png"
    words = ["render", str(PAINTINGS / "strokes.ply"), *VIEW, *words, "-o", str(output), "--quiet"]
    assert cli.main(words) == 0
    picture = read_image(output)
    if picture.shape[0] > 120:
        picture = picture[SHOWN]
        write_frame(bg.Frame(picture, np.ones(picture.shape[:2], picture.dtype)), output, (0, 0, 0))
    return 255 * read_image(output).astype(np.float64)


def differs(found: np.ndarray, expected: np.ndarray, name: str = "") -> bool:
    off = np.abs(found - expected)
    mean, far = (STYLE_MEAN_LIMIT, STYLE_FAR) if name.endswith("style") else (MEAN_LIMIT, FAR)
    return bool(off.mean() > mean or (off.max(axis=2) > far).mean() > FAR_SHARE)


def regenerate() -> None:
    PAINTINGS.mkdir(exist_ok=True)
    golden = {"labels": made_labels()}
    golden |= dict(steps(golden))
    single = {name: v.astype(np.float32) if v.dtype == np.float64 else v for name, v in golden.items()}
    np.savez_compressed(PAINTINGS / "strokes.npz", **single)
    strokes = bg.Gaussians(*(golden[f"broken {name}"] for name in GAUSSIAN_COLUMNS))
    from brushgs.formats.scenes.write import write_scene

    write_scene(strokes, PAINTINGS / "strokes.ply", is_strokes=True, scene="golden")
    for name in LOOKS:
        painted(name, PAINTINGS)
    (PAINTINGS / "evening.style").unlink()


if __name__ == "__main__":
    regenerate()
