"""The families of the bench: the varied choice, the truth and the cost of each.

A family yields its points one by one, painted and verified; `measure` times them.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, get_args

import numpy as np

from brushgs.brushes.brush_set import Brushes
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.bench.figures import Verified
from brushgs.measure.bench.subject import Subject, with_size
from brushgs.measure.bench.timing import TimedRun
from brushgs.measure.bench.verify import (
    busiest_square,
    check_close,
    check_equal,
    check_square,
    expected_boxes,
)
from brushgs.measure.likeness import Likeness, compare, unpainted
from brushgs.options.choices import Features, Filter, Merge
from brushgs.passes.reduce.cluster import Grouping
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.rendering import reference
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.options import project_with, render_with
from brushgs.rendering.rasterize import RasterOptions, rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.stroke_count.view_model import KERNEL
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import used_sh_degree

# Just below round values, like the default: opaque strokes leave powers of 0.01, and rounding must not decide
# whether a pixel is finished.
STOPS = tuple(1e4 * stop * MIN_TRANSMITTANCE for stop in (0.1, 3e-2, 1e-2, 1e-3, 1e-4, 1e-5, 0.0))
SIZES = (0.125, 0.25, 0.5, 0.75, 1.0, 1.5)  # factors on the sides of the configured picture
TRUE_SIZE = 2.0  # factor of the truth of sizes
SOFT_SHRINK = 4  # the reference of the soft order is slow, so it is drawn this much smaller
TRUTH_SIDE = 6  # pixels, of the square in which the supersampled truth is verified


@dataclass(frozen=True)
class Trial:
    """A verified point before it is timed; fields as in `figures.Point`."""

    label: str
    series: str
    value: float | None
    error: Likeness
    verified: Verified
    strokes: int
    runs: dict[str, tuple[TimedRun, ...]]
    unpainted: float | None = None
    clustering: float | None = None
    held_out: float | None = None


@dataclass(frozen=True)
class FamilyPlan:
    """A family before it is measured.

    Attributes:
        title: the varied choice, in words.
        truth: the reference of pictures.
        cost: the timed work.
        num_points: number of trials.
        trials: yields them.
        num_runs: number of different runs that are timed.
        skip_reason: why the family does not apply to the scene, or None.
    """

    title: str
    truth: str
    cost: str
    num_points: int
    trials: Callable[[], Iterator[Trial]]
    num_runs: int
    skip_reason: str | None = None


def plan_families(subject: Subject) -> dict[str, FamilyPlan]:
    """The configured families by name, in the order of the report."""
    makers: dict[str, Callable[[Subject], FamilyPlan]] = {
        "strokes": _strokes,
        "merge": _merge,
        "filter": _filter,
        "precision": _precision,
        "sh": _sh,
        "size": _size,
    }
    asked = subject.config.families_of(has_look=False)
    return {name: make(subject) for name, make in makers.items() if name in asked}


def _strokes(subject: Subject) -> FamilyPlan:
    counts = subject.counts

    def trials() -> Iterator[Trial]:
        for count in counts:
            clusters, _ = subject.prepared.stroke_maker.clusters(count)
            strokes = subject.prepared.stroke_maker.finished(clusters)
            name = f"strokes {len(strokes):,}"
            frame = subject.draw(strokes)
            yield Trial(
                f"{len(strokes):,}",
                "strokes",
                float(len(strokes)),
                _against_plain(subject, frame),
                _checked(name, subject, frame, strokes),
                len(strokes),
                {
                    "frame": timed_run(name, partial(subject.draw, strokes), frame),
                    "painting": timed_run(name, partial(subject.painting, count), frame),
                },
                unpainted(frame.alpha, subject.plain.alpha),
                subject.clustering_error(clusters),
                subject.held_out_error(strokes),
            )

    truth = "the plain picture: the whole scene with its own kernel"
    cost = "a frame: project and rasterise"
    return FamilyPlan("number of strokes", truth, cost, len(counts), trials, 2 * len(counts))


def _merge(subject: Subject) -> FamilyPlan:
    groups = [(method, features) for method in subject.config.methods for features in get_args(Features)]
    ways = [(method, features, merge) for method, features in groups for merge in get_args(Merge)]

    def trials() -> Iterator[Trial]:
        grouped: dict[tuple[str, str], tuple[Grouping, tuple[TimedRun]]] = {}
        for method, features, merge in ways:
            name = f"merge {merge}, {method}, {features}"
            if (method, features) not in grouped:  # both ways of merging take the same groups
                work = partial(subject.group, method=method, features=features)
                grouping = work()
                grouped[method, features] = grouping, timed_run(name, work, grouping)
            grouping, run = grouped[method, features]
            merged = partial(merge_clusters, subject.kept, grouping.labels, merge=merge)
            strokes = merged()
            frame = subject.draw(strokes)
            yield Trial(
                f"{method} {features}, {merge}",
                f"{method} {features}",
                None,
                _against_plain(subject, frame),
                _checked(name, subject, frame, strokes),
                len(strokes),
                {"clustering": (*run, *timed_run(name, merged, strokes))},
                unpainted(frame.alpha, subject.plain.alpha),
            )

    skip_reason = (
        None if subject.count < len(subject.kept) else f"{len(subject.kept):,} Gaussians: nothing to merge"
    )
    title = f"merge, k-means and features, {subject.count:,} strokes"
    num_runs = len(groups) + len(ways)
    return FamilyPlan(
        title, "the plain picture", "clustering and merging", len(ways), trials, num_runs, skip_reason
    )


def _filter(subject: Subject) -> FamilyPlan:
    camera = subject.camera
    size = {"height": camera.height, "width": camera.width}

    def trials() -> Iterator[Trial]:
        boxes, _ = project_with(subject.strokes, camera, subject.options)
        threads = subject.paint.draw.threads
        true = supersampled(
            boxes,
            subject.texture,
            underpaint=subject.options.underpaint,
            streaks=subject.options.streaks,
            num_threads=threads,
            **size,
        )
        _check_supersampled(subject, true)
        for filter in get_args(Filter):
            frame = subject.draw(subject.strokes, filter=filter)
            name = f"filter {filter}"
            yield Trial(
                filter,
                "filter",
                None,
                compare(subject.picture(frame), subject.picture(true)),
                _checked(name, subject, frame, subject.strokes, filter=filter),
                len(subject.strokes),
                {"frame": timed_run(name, partial(subject.draw, subject.strokes, filter=filter), frame)},
            )

    skip_reason = None if subject.texture.kind == "image" else "a kernel is computed, not sampled"
    title = f"texture filter, {subject.count:,} strokes"
    truth = f"{FACTOR} x {FACTOR} bilinear samples per pixel"
    return FamilyPlan(
        title, truth, "a frame", len(get_args(Filter)), trials, len(get_args(Filter)), skip_reason
    )


def _precision(subject: Subject) -> FamilyPlan:
    camera, options = subject.camera, subject.options
    if options.order == "soft":
        small = (max(1, side // SOFT_SHRINK) for side in (camera.width, camera.height))
        camera = with_size(camera, *small)
    dtypes = (np.float32, np.float64)

    def trials() -> Iterator[Trial]:
        true = reference.rasterize(
            expected_boxes(subject.strokes, camera, options),
            subject.texture,
            RasterOptions(
                width=camera.width,
                height=camera.height,
                filter=options.filter,
                underpaint=options.underpaint,
                streaks=options.streaks,
                min_transmittance=0,
            ),
        )
        for dtype in dtypes:
            strokes = subject.strokes.astype(dtype)
            for stop in STOPS:
                stopped = replace(options, min_transmittance=stop)
                work = partial(render_with, strokes, camera, subject.texture, stopped)
                name, frame = f"precision {dtype.__name__}, stop at {stop:.0e}", work()
                yield Trial(
                    f"{dtype.__name__}, {stop:.0e}" if stop else f"{dtype.__name__}, none",
                    dtype.__name__,
                    stop,
                    compare(subject.picture(frame), subject.picture(true)),
                    check_square(name, frame, strokes, camera, subject.texture, stopped),
                    len(strokes),
                    {"frame": timed_run(name, work, frame)},
                )

    title = f"precision and early stop, {subject.count:,} strokes, {camera.width}x{camera.height}"
    truth = "the float64 reference without an early stop"
    num_points = len(STOPS) * len(dtypes)
    return FamilyPlan(title, truth, "a frame", num_points, trials, num_points)


def _sh(subject: Subject) -> FamilyPlan:
    used, gaussians = used_sh_degree(subject.gaussians), subject.gaussians
    kernel, options = StrokeTexture.open(KERNEL), subject.plain_options

    def trials() -> Iterator[Trial]:
        true = subject.picture(subject.plain)
        for degree in range(used + 1):
            less = replace(gaussians, sh=np.ascontiguousarray(gaussians.sh[:, : (degree + 1) ** 2]))
            work = partial(render_with, less, subject.camera, kernel, options)
            name, frame = f"SH degree {degree}", work()
            yield Trial(
                str(degree),
                "degree",
                float(degree),
                compare(subject.picture(frame), true),
                check_square(name, frame, less, subject.camera, kernel, options),
                len(less),
                {"frame": timed_run(name, work, frame)},
            )

    skip_reason = None if used > 0 else "the scene has degree 0 only"
    title = f"SH degree, plain picture of {len(gaussians):,} Gaussians"
    return FamilyPlan(title, f"degree {used}", "a plain frame", used + 1, trials, used + 1, skip_reason)


def _size(subject: Subject) -> FamilyPlan:
    def camera_of(share: float) -> Camera:
        sides = (max(1, round(share * side)) for side in (subject.camera.width, subject.camera.height))
        return with_size(subject.camera, *sides)

    def trials() -> Iterator[Trial]:
        large = subject.draw(subject.strokes, camera_of(TRUE_SIZE))
        true = resized(subject.picture(large), subject.camera)
        for share in SIZES:
            camera = camera_of(share)
            work = partial(subject.draw, subject.strokes, camera)
            label, frame = f"{camera.width}x{camera.height}", work()
            yield Trial(
                label,
                "size",
                share,
                compare(resized(subject.picture(frame), subject.camera), true),
                _checked(f"size {label}", subject, frame, subject.strokes, camera),
                len(subject.strokes),
                {"frame": timed_run(f"size {label}", work, frame)},
            )

    true_camera = camera_of(TRUE_SIZE)
    title = f"picture size, {subject.count:,} strokes"
    truth = f"{true_camera.width}x{true_camera.height}, all resized to {size_words(subject.camera)}"
    return FamilyPlan(title, truth, "a frame", len(SIZES), trials, len(SIZES))


def size_words(camera: Camera) -> str:
    """The size of the pictures of a camera: "640x360"."""
    return f"{camera.width}x{camera.height}"


def timed_run(name: str, work: Callable[[], Any], verified: Any) -> tuple[TimedRun]:
    """A cost of a single run."""
    return (TimedRun(work, lambda result: check_equal(name, result, verified)),)


def _against_plain(subject: Subject, frame: Frame) -> Likeness:
    return compare(subject.picture(frame), subject.picture(subject.plain), wants_all=True)


def _checked(
    name: str,
    subject: Subject,
    frame: Frame,
    strokes: Gaussians,
    camera: Camera | None = None,
    **changed: Any,
) -> Verified:
    options = replace(subject.options, **changed)
    return check_square(name, frame, strokes, camera or subject.camera, subject.texture, options)


def _check_supersampled(subject: Subject, true: Frame) -> None:
    """Verify a small square of the supersampled picture by the definition, drawn at eight times the size."""
    boxes = expected_boxes(subject.strokes, subject.camera, subject.options)
    x, y = busiest_square(boxes, subject.camera, TRUTH_SIDE)
    width, height = (min(TRUTH_SIDE, s) for s in (subject.camera.width - x, subject.camera.height - y))
    large = replace(
        boxes, centers=FACTOR * (boxes.centers - (x, y)), half_extents=FACTOR * boxes.half_extents
    )
    fine = reference.rasterize(
        large,
        subject.texture,
        RasterOptions(
            height=FACTOR * height,
            width=FACTOR * width,
            filter="bilinear",
            underpaint=subject.options.underpaint,
            streaks=subject.options.streaks,
        ),
    )
    blocks = height, FACTOR, width, FACTOR
    expected = Frame(
        fine.rgb.reshape(*blocks, 3).mean(axis=(1, 3)), fine.alpha.reshape(blocks).mean(axis=(1, 3))
    )
    square = Frame(true.rgb[y : y + height, x : x + width], true.alpha[y : y + height, x : x + width])
    check_close("filter, the supersampled truth", square, expected, "the reference")


def resized(picture: Array, camera: Camera) -> Array:
    """A picture resized to a camera: enlarged linearly, or reduced with a triangle filter."""
    if picture.shape[:2] == (camera.height, camera.width):
        return picture
    import OpenImageIO as oiio  # noqa: N813

    roi = oiio.ROI(0, camera.width, 0, camera.height, 0, 1, 0, 3)
    source = oiio.ImageBuf(np.ascontiguousarray(picture, dtype=np.float32))
    result = oiio.ImageBufAlgo.resize(source, "triangle", 0.0, roi)
    return np.asarray(result.get_pixels(oiio.FLOAT))


# The truth of the texture filters: the same boxes with many samples per pixel.


FACTOR = 8  # samples per pixel along each side
STRIP = 32  # rows of the picture at a time: 8 x 8 samples of a whole picture take gigabytes


def supersampled(
    boxes: Boxes,
    texture: Brushes,
    *,
    height: int,
    width: int,
    underpaint: Underpaint | None = None,
    streaks: float = 0.0,
    num_threads: int | None = None,
) -> Frame:
    """The mean of 8 x 8 bilinear samples per pixel, premultiplied, in the dtype of the boxes.

    The boxes are only enlarged: they keep the low-pass of the small picture.
    """
    rgb, alpha = [], []
    large = replace(boxes, centers=FACTOR * boxes.centers, half_extents=FACTOR * boxes.half_extents)
    reach = np.hypot(*large.half_extents.T) * (1.0 if underpaint is None else max(1.0, underpaint.reach))
    for top in range(0, height, STRIP):
        rows = min(STRIP, height - top)
        y = large.centers[:, 1] - FACTOR * top
        is_near = (y + reach > 0) & (y - reach < FACTOR * rows)
        strip = replace(large, centers=np.stack([large.centers[:, 0], y], axis=1)).take(is_near)
        frame = rasterize(
            strip,
            texture,
            height=FACTOR * rows,
            width=FACTOR * width,
            filter="bilinear",
            depth=False,
            underpaint=underpaint,
            streaks=streaks,
            num_threads=num_threads,
        )
        blocks = rows, FACTOR, width, FACTOR
        rgb.append(frame.rgb.reshape(*blocks, 3).mean(axis=(1, 3)))
        alpha.append(frame.alpha.reshape(blocks).mean(axis=(1, 3)))
    return Frame(np.concatenate(rgb), np.concatenate(alpha))
