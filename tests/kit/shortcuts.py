"""Shortcuts of a painting, each as the work with it and without it, to be compared."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any
from unittest.mock import patch

import numpy as np

import brushgs as bg
from brushgs.brushes import levels
from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.first_view import framed_camera
from brushgs.cameras.framing import plain_first_view
from brushgs.formats.pictures.oiio import quantise
from brushgs.options.painting import ViewConfig
from brushgs.passes.reduce import contribution, lloyd
from brushgs.passes.reduce.cluster import cluster_weights, group
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.passes.reduce.morton import morton_order
from brushgs.passes.reduce.prune import highest
from brushgs.rendering import rasterize as ops
from brushgs.rendering import texture_levels
from brushgs.rendering.constants import MAX_ALPHA, MIN_TRANSMITTANCE
from brushgs.rendering.track import track_directions
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Shortcut:
    """Work that is skipped.

    Attributes:
        name: what.
        on: the shortened work: its results, as arrays to compare.
        off: the whole work.
        bound: how much the outcomes may differ, of 1.
        of: "painting" or "frame": of what the seconds are a share.
        count: how many items are skipped, of how many; (0, 0) where they are not counted.
    """

    name: str
    on: Callable[[], list[Array]]
    off: Callable[[], list[Array]]
    bound: float = 0.0
    of: str = "painting"
    count: tuple[int, int] = (0, 0)

    @property
    def words(self) -> str:
        """The name, with the count."""
        return f"{self.name}: {self.count[0]:,} of {self.count[1]:,}" if self.count[1] else self.name


@dataclass(frozen=True, eq=False)
class Painting:
    """A scene on its way to a picture, for shortcuts to start from the step they belong to."""

    scene: Gaussians
    pruned: Gaussians
    strokes: Gaussians
    camera: Camera
    texture: StrokeTexture
    boxes: Boxes
    frame: Frame

    @classmethod
    def of(cls, scene: Gaussians, num_strokes: int, width: int, height: int, zoom: float = 1.0) -> "Painting":
        """All steps of a painting, with the default options."""
        texture = StrokeTexture.open("swirl")
        camera = framed_camera(plain_first_view(scene), ViewConfig(size=(width, height), zoom=zoom))
        pruned = bg.prune(scene)
        strokes = bg.cluster(pruned, num_strokes)
        boxes = project(strokes, camera, texture)
        return cls(scene, pruned, strokes, camera, texture, boxes, draw(boxes, camera, texture))


def project(strokes: Gaussians, camera: Camera, texture: StrokeTexture) -> Boxes:
    """As `render` does."""
    return bg.project(strokes, camera, num_sigmas=texture.fitted_sigmas, lock="anchor", fade=True)


def draw(boxes: Boxes, camera: Camera, texture: StrokeTexture, **options: Any) -> Frame:
    """A picture without depth."""
    options = {"depth": False, **options}
    return bg.rasterize(boxes, texture, height=camera.height, width=camera.width, **options)


def columns(gaussians: Gaussians) -> list[Array]:
    """The outcome of a pass."""
    return list(gaussians.columns().values())


def pixels(frame: Frame) -> list[Array]:
    """The outcome of drawing."""
    return [frame.rgb, frame.alpha]


def shortcuts(p: Painting) -> list[Shortcut]:
    """All of them, in the order of the stages."""
    return [*of_passes(p), *of_projection(p), *of_drawing(p), *of_sequences(p)]


def of_passes(p: Painting) -> list[Shortcut]:
    """What pruning, clustering and merging skip."""
    num = len(p.strokes)
    order = morton_order(p.pruned.means)
    points = cluster_features(p.pruned)[order]
    weights = cluster_weights(p.pruned)[order]
    labels = group(p.pruned, num).labels
    visible = contribution.visible_shares(p.pruned)
    own, rows = np.arange(len(p.strokes)), len(p.scene)

    def with_choice() -> list[Array]:
        return columns(p.scene.take(highest(contribution.contributions(p.scene), rows)))

    def first_step() -> list[Array]:
        return list(lloyd.start(points, weights, num, 0))

    def first_step_anew() -> list[Array]:
        centers = lloyd.start(points, weights, num, 0)[0]
        return [centers, *lloyd.assign(points, centers)]

    return [
        Shortcut("choosing, where all are kept", lambda: columns(bg.prune(p.scene, 1.0)), with_choice),
        Shortcut(
            "merging, where no Gaussian has company",
            lambda: columns(bg.cluster(p.strokes, num)),
            lambda: columns(merge_clusters(p.strokes, own)),
        ),
        Shortcut(
            "what is visible, known from clustering",
            lambda: columns(merge_clusters(p.pruned, labels, visible=visible)),
            lambda: columns(merge_clusters(p.pruned, labels)),
        ),
        Shortcut("assigning anew what the start assigned", first_step, first_step_anew),
    ]


def of_projection(p: Painting) -> list[Shortcut]:
    """What projecting the whole scene with the plain kernel skips, where it matters most."""
    kernel = StrokeTexture.open("gaussian")
    filled = np.zeros((len(p.scene), 16, 3), p.scene.sh.dtype)
    filled[:, 0] = p.scene.sh[:, 0]
    flat = replace(p.scene, sh=filled)
    boxes = bg.project(p.scene, p.camera, num_sigmas=kernel.num_sigmas)
    everywhere = with_outside(boxes, p.scene, p.camera, kernel.num_sigmas)
    fainter = with_faint(boxes, p.scene, p.camera, kernel.num_sigmas)

    def all_bands() -> list[Array]:
        with patch("brushgs.rendering.project.used_sh_degree", lambda scene: scene.sh_degree):
            return [bg.project(flat, p.camera).colors]

    return [
        Shortcut("SH bands that are zero", lambda: [bg.project(flat, p.camera).colors], all_bands),
        Shortcut(
            "strokes outside the picture",
            lambda: pixels(draw(boxes, p.camera, kernel)),
            lambda: pixels(draw(everywhere, p.camera, kernel)),
            count=(len(everywhere) - len(boxes), len(everywhere)),
        ),
        Shortcut(
            "strokes of opacity under 1/255",
            lambda: pixels(draw(boxes, p.camera, kernel)),
            lambda: pixels(draw(fainter, p.camera, kernel)),
            count=(len(fainter) - len(boxes), len(fainter)),
        ),
    ]


def with_outside(boxes: Boxes, scene: Gaussians, camera: Camera, num_sigmas: float) -> Boxes:
    """The boxes, and those that lie in the 24 windows of the picture's size around it."""
    parts, seen = [boxes], np.zeros(len(scene), dtype=bool)
    seen[boxes.ids] = True
    for row, column in np.ndindex(5, 5):
        shift = np.array([(column - 2) * camera.width, (row - 2) * camera.height])
        K = camera.K.copy()
        K[:2, 2] -= shift  # the window moves; the clamp of the Jacobian knows only its size
        found = bg.project(scene, replace(camera, K=K), num_sigmas=num_sigmas)
        fresh = found.take(~seen[found.ids])
        seen[fresh.ids] = True
        parts.append(replace(fresh, centers=(fresh.centers + shift).astype(fresh.centers.dtype)))
    return merged(parts)


def with_faint(boxes: Boxes, scene: Gaussians, camera: Camera, num_sigmas: float) -> Boxes:
    """The boxes, and those of opacity under 1/255."""
    least = np.maximum(scene.opacities, np.float32(1.001 / 255))
    found = bg.project(replace(scene, opacities=least), camera, num_sigmas=num_sigmas)
    faint = found.take(scene.opacities[found.ids] < 1 / 255)
    return merged([boxes, replace(faint, opacities=scene.opacities[faint.ids])])


def merged(parts: list[Boxes]) -> Boxes:
    """All boxes by depth, ties by row."""
    names = ("centers", "half_extents", "angles", "depths", "colors", "opacities", "ids")
    together = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    order = np.lexsort((together["ids"], together["depths"]))
    return Boxes(**{name: column[order] for name, column in together.items()})


def of_drawing(p: Painting) -> list[Shortcut]:
    """What drawing a picture skips."""
    sides = [len(levels.axis_levels(size)) for size in reversed(p.texture.coverage.shape)]
    every = list(np.ndindex(*sides))
    used = texture_levels.levels_for("of_drawing", p.boxes, BrushSet.of(p.texture), "mip").codes
    sorted_again = replace(p.boxes, softness=np.zeros_like(p.boxes.depths))
    small = replace(p.camera.resized(64, 64))
    few = project(p.strokes, small, p.texture)
    few = few.take(slice(0, 250))

    def made(codes: list[tuple[int, int]], together: bool) -> list[Array]:
        texture_levels._cache.pop(p.texture, None)
        if together:
            made_together = texture_levels.packed_levels(p.texture, codes)
            return [made_together[codes.index(code)].pairs[:-1] for code in used]
        alone = (levels.level_coverage(p.texture.coverage, *code) for code in used)
        return [texture_levels._paired(texels).ravel() for texels in alone]

    def threads(asked: int) -> list[Array]:
        with patch.object(ops, "num_threads_or_default", lambda _: asked):
            return pixels(draw(few, small, p.texture))

    found = [
        Shortcut(
            "mip levels of no stroke's size",
            lambda: made(used, True),
            lambda: made(every, True),
            count=(len(every) - len(used), len(every)),
        ),
        Shortcut("filtering along u again", lambda: made(used, True), lambda: made(used, False)),
        Shortcut(
            "depth",
            lambda: pixels(draw(p.boxes, p.camera, p.texture)),
            lambda: pixels(draw(p.boxes, p.camera, p.texture, depth=True)),
        ),
        Shortcut(
            "softness, where the order is by depth",
            lambda: pixels(draw(p.boxes, p.camera, p.texture)),
            lambda: pixels(draw(sorted_again, p.camera, p.texture)),
        ),
        Shortcut("the second thread, 64 x 64, 250 strokes", lambda: threads(2), lambda: threads(-2)),
        Shortcut("seven of eight threads, the same", lambda: threads(8), lambda: threads(-8)),
        Shortcut(
            "floats between picture and bytes",
            lambda: [p.frame.bytes_over((1, 1, 1))],
            lambda: [quantise(p.frame.over((1, 1, 1)), np.uint8).astype(np.uint8)],
        ),
    ]
    # A pixel is finished before the stroke that would leave less than 1e-4 of its light. The darkest stroke
    # leaves 0.01 of what reaches it, so at most 0.01 is still to come, times the brightest colour.
    bound = MIN_TRANSMITTANCE / (1 - MAX_ALPHA) * max(1.0, float(p.boxes.colors.max(initial=0)))
    found.append(
        Shortcut(
            "strokes behind a finished pixel",
            lambda: pixels(draw(p.boxes, p.camera, p.texture)),
            lambda: pixels(draw(p.boxes, p.camera, p.texture, min_transmittance=0.0)),
            bound,
        )
    )
    return found


def of_sequences(p: Painting) -> list[Shortcut]:
    """What a sequence skips."""
    kernel = StrokeTexture.open("gaussian")
    rest = [p.camera] * 24

    def followed(is_left_out: bool) -> list[Array]:
        if not is_left_out:
            track_directions(p.strokes, rest)
        frame = next(bg.render_sequence(p.strokes, rest, kernel, depth=False))
        return pixels(frame)

    def frames(num_painted: int) -> list[Array]:
        painted = [
            bg.render(p.strokes, p.camera, p.texture, order="soft", depth=False) for _ in range(num_painted)
        ]
        return pixels(painted[-1])

    return [
        Shortcut(
            "following directions of a kernel", lambda: followed(True), lambda: followed(False), of="frame"
        ),
        Shortcut("a frame while the camera rests", lambda: frames(1), lambda: frames(2), of="frame"),
    ]


def difference(one: list[Array], other: list[Array]) -> float:
    """The largest of any value; bytes count as what they show."""
    worst = 0.0
    for a, b in zip(one, other, strict=True):
        if a.shape != b.shape:
            return float("inf")
        unit = 255.0 if a.dtype == np.uint8 else 1.0
        if a.size:
            worst = max(worst, float(np.abs(a.astype(np.float64) - b.astype(np.float64)).max()) / unit)
    return worst
