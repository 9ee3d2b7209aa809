"""What each shortcut saves, and the largest difference that it makes, measured with the shortcut on and off.

    python -m tests.bench.skipped_work [SCENE.ply ...] [--strokes 7000] [--size 1280x720] [--repeat 7]
                                       [--imports]

Without a scene: a million random Gaussians. Every shortcut runs on and off in turn. Milliseconds are medians;
"saved" is the median of the differences, of wall-clock and of processor time, which other work on the machine
disturbs less; "share" is that of the processor time of a whole painting (without imports and files), or of a
frame of a video where the shortcut serves only those. The difference is the largest of any value, of 1; if it
is above the bound the run ends with an error. --imports times the import of modules that painting does
without, in fresh processes. A table ends with work that could be skipped and is not, because that would
save too little.
"""

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
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
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.passes.reduce import contribution, lloyd
from brushgs.passes.reduce.cluster import cluster_weights, group
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.passes.reduce.morton import morton_order
from brushgs.passes.reduce.prune import highest
from brushgs.pipeline.still import paint
from brushgs.rendering import rasterize as ops
from brushgs.rendering import texture_levels
from brushgs.rendering.constants import MAX_ALPHA, MIN_TRANSMITTANCE
from brushgs.rendering.track import track_directions
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import sh_basis
from tests.bench import workloads
from tests.bench.machine import describe

MODULES = (
    "torch",
    "sklearn.cluster",
    "scipy.ndimage",
    "scipy.spatial",
    "scipy.linalg",
    "matplotlib.pyplot",
)
MODULES += ("av", "rich.table", "dask.distributed")
DIRECTIONS = 4096  # of the sphere, for the largest value of a basis function
EIGHT_BITS = 0.5 / 255  # half a step of a screen

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
            return [texture_levels._packed_levels(p.texture, codes)[codes.index(code)][0] for code in used]
        return [texture_levels._packed(levels.level_coverage(p.texture.coverage, *code))[0] for code in used]

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


@dataclass(frozen=True)
class Cost:
    """Median milliseconds of a shortcut, and the largest difference it made."""

    on: float
    off: float
    saved: float
    saved_cpu: float
    worst: float


def measure(shortcut: Shortcut, repeat: int) -> Cost:
    """What it saves, after one run of both sides that is compared and does not count."""
    worst = difference(shortcut.on(), shortcut.off())
    times = np.empty((repeat, 2, 2))  # turn, off or on, wall clock or processors
    for turn in range(repeat):
        for side, call in enumerate((shortcut.off, shortcut.on)):
            wall, cpu = time.perf_counter(), time.process_time()
            call()
            times[turn, side] = time.perf_counter() - wall, time.process_time() - cpu
    times *= 1e3
    saved, saved_cpu = np.median(times[:, 0] - times[:, 1], axis=0)
    off, on = np.median(times[..., 0], axis=0)
    return Cost(float(on), float(off), float(saved), float(saved_cpu), worst)


def cpu_of(call: Callable[[], object], repeat: int) -> float:
    """Median milliseconds of the processors, after one call that does not count."""
    call()
    times = []
    for _ in range(repeat):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return 1e3 * float(np.median(times))


def report(name: str, p: Painting, repeat: int) -> None:
    """The table of one scene."""
    num = len(p.strokes)
    view = ViewConfig(size=(p.camera.width, p.camera.height))
    config = replace(PaintConfig(), view=view, cluster=replace(PaintConfig().cluster, strokes=num))
    wholes = {
        "painting": cpu_of(lambda: paint(p.scene, config, camera=p.camera), max(repeat // 3, 1)),
        "frame": cpu_of(lambda: bg.render(p.strokes, p.camera, p.texture, order="soft", depth=False), repeat),
    }
    size = f"{p.camera.width}x{p.camera.height}"
    print(f"\n{name}: {len(p.scene):,} Gaussians, {num:,} strokes, {size}", end="")
    print(
        f"; processors: a painting {wholes['painting']:.0f} ms, a frame of a video {wholes['frame']:.1f} ms"
    )
    names = ("with, ms", "without", "saved", "cpu saved", "share", "differs", "bound")
    print(f"{'skipped':48}" + "".join(f"{name:>11}" for name in names))
    for shortcut in shortcuts(p):
        cost = measure(shortcut, repeat)
        share = cost.saved_cpu / wholes[shortcut.of]
        row = "".join(f"{value:11.2f}" for value in (cost.off, cost.on, cost.saved, cost.saved_cpu))
        print(f"{shortcut.words:48}{row}{share:11.1%}{cost.worst:11.2g}{shortcut.bound:11.2g}", flush=True)
        if cost.worst > shortcut.bound:
            sentence = f"{shortcut.name} changes a value by {cost.worst:g}, more than {shortcut.bound:g}"
            raise SystemExit(f"skipped_work: {sentence}")
    for line in not_built(p, repeat, wholes):
        print(f"not skipped: {line}")


def not_built(p: Painting, repeat: int, wholes: dict[str, float]) -> list[str]:
    """What could be skipped, and what that would save."""
    lines = []
    for degree in range(p.scene.sh_degree, 0, -1):
        seen = band_reach(p.scene, degree)
        under = np.mean(seen < EIGHT_BITS)
        lines.append(
            f"SH band {degree}: {under:.1%} of the Gaussians show it by less than half a step of 8 bits"
        )
    if p.scene.sh_degree:
        flat = replace(p.strokes, sh=np.ascontiguousarray(p.strokes.sh[:, :1]))
        args = (p.camera, p.texture)
        whole, less = (cpu_of(lambda s=s: project(s, *args), 3 * repeat) for s in (p.strokes, flat))
        share = (whole - less) / wholes["painting"]
        lines.append(f"all SH bands of the strokes: {whole - less:.2f} ms, {share:.2%} of the painting")
    plain, faded = (
        cpu_of(lambda fade=fade: bg.project(p.strokes, p.camera, fade=fade), 3 * repeat)
        for fade in (False, True)
    )
    lines.append(f"fading, where nothing fades: {faded - plain:.3f} ms a frame")
    tiles, visits = lone_tiles(p)
    lone = f"{tiles:.1%} of the tiles, {visits:.1%} of the work"
    lines.append(f"the soft order, in tiles where no two strokes are close: {lone}")
    spread = cluster_features(p.pruned).std(axis=0) == 0
    lines.append(f"feature columns that are constant: {np.count_nonzero(spread)} of {len(spread)}")
    return lines


def band_reach(scene: Gaussians, degree: int) -> Array:
    """By how much one SH band can change a channel of each Gaussian from any side, at most, [N]."""
    normals = np.random.default_rng(0).normal(size=(DIRECTIONS, 3))
    basis = sh_basis(normals / np.linalg.norm(normals, axis=1, keepdims=True), degree)
    terms = slice(degree**2, (degree + 1) ** 2)
    largest = np.abs(basis).max(axis=0)[terms]
    return np.asarray((np.abs(scene.sh[:, terms]) * largest[:, None]).sum(axis=1).max(axis=1))


def lone_tiles(p: Painting) -> tuple[float, float]:
    """Share of the painted tiles, and of the strokes in them, where none is close in depth to the next."""
    soft = bg.project(
        p.strokes, p.camera, num_sigmas=p.texture.fitted_sigmas, lock="anchor", fade=True, order="soft"
    )
    assert soft.softness is not None
    tile, size = np.array([32, 16]), np.array([p.camera.width, p.camera.height])
    axes = np.abs(np.stack([np.cos(soft.angles), np.sin(soft.angles)], axis=1))
    reach = axes * soft.half_extents[:, :1] + axes[:, ::-1] * soft.half_extents[:, 1:]
    low, high = ((np.clip(soft.centers + sign * reach, 0, size - 1) // tile).astype(int) for sign in (-1, 1))
    shape = tuple(-(-size // tile))
    last, count = np.full(shape, -1), np.zeros(shape, dtype=int)
    is_close = np.zeros(shape, dtype=bool)
    for row, (start, end) in enumerate(zip(low, high, strict=True)):
        here = np.s_[start[0] : end[0] + 1, start[1] : end[1] + 1]
        before = last[here]
        reach = np.hypot(soft.softness[row], soft.softness[before])
        is_close[here] |= (before >= 0) & (soft.depths[row] - soft.depths[before] < reach)
        last[here], count[here] = row, count[here] + 1
    lone = count[~is_close & (count > 0)]
    return len(lone) / max(np.count_nonzero(count), 1), lone.sum() / max(count.sum(), 1)


def imports(repeat: int) -> None:
    """What modules take to import that painting does not load, after NumPy, in fresh processes."""
    code = "import numpy, time; t = time.process_time(); import {}; print(time.process_time() - t)"
    print("\nnot imported: ms of the processors, median")
    for name in MODULES:
        command = [sys.executable, "-c", code.format(name)]
        runs = [subprocess.run(command, capture_output=True, text=True, check=False) for _ in range(repeat)]
        times = [1e3 * float(run.stdout) for run in runs if run.returncode == 0]
        print(f"{name:26} {np.median(times):6.0f}" if times else f"{name:26} not installed", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="*", type=Path)
    parser.add_argument("--strokes", type=int, default=7000)
    parser.add_argument("--size", default="1280x720", metavar="WxH")
    parser.add_argument("--repeat", type=int, default=7)
    parser.add_argument("--imports", action="store_true", help="time the modules that are not imported, too")
    arguments = parser.parse_args()
    print(describe())
    width, height = (int(part) for part in arguments.size.split("x"))
    scenes = {path.stem: bg.load(path) for path in arguments.scenes}
    for name, scene in scenes.items() or [("random", workloads.strokes(1_000_000))]:
        report(name, Painting.of(scene, arguments.strokes, width, height), arguments.repeat)
    if arguments.imports:
        imports(arguments.repeat)


if __name__ == "__main__":
    main()
