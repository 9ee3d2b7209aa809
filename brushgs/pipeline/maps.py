"""Properties of strokes by their place: of `--map`, `--rules`, `--focus` and painted marks.

Each gives factors for the source Gaussians, and for the strokes made of them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from operator import mul
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_image
from brushgs.options.hand import MAX_HOLD
from brushgs.options.maps import Map
from brushgs.options.rules import Rules
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.where import Where, WhereConfig
from brushgs.pipeline.background import fill_picture
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.masks import SAME_SHAPE
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Later
from brushgs.pipeline.stroke_pass import StrokePass
from brushgs.pipeline.where import context_of
from brushgs.rendering.coat import Coat
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import LUMINANCE, flatten
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.arrays import F64, Array

TAILS = 0.02, 0.98  # shares of the numbers of a column below those at value 0 and at value 1
SOFT = 0.05  # of the subject's size: width of the edges of parts, so that no step shows


@dataclass(frozen=True, eq=False)
class Mapped:
    """The factors of one property.

    Attributes:
        name: of the property.
        factors: [N] of the Gaussians that strokes are made of.
    """

    name: str
    factors: "F64"

    def stroke_pass(self, gaussians: Gaussians, skip: str | None) -> StrokePass:
        """The pass that applies them to strokes made of the N Gaussians."""

        def mapped(strokes: Gaussians) -> Gaussians:
            from brushgs.passes.where.maps import apply_factors

            return apply_factors(strokes, self.name, self.at(strokes, gaussians))

        low, high = float(self.factors.min(initial=1)), float(self.factors.max(initial=1))
        what = f"of {low:.3g} to {high:.3g} times the {self.name}"
        return StrokePass(f"map of {self.name}", what, mapped, skip, inputs=(self, gaussians))

    def at(self, strokes: Gaussians, gaussians: Gaussians) -> "F64":
        """[k] factors of strokes made of the N Gaussians."""
        from brushgs.passes.where.maps import carried

        return carried(self.factors, gaussians, strokes)

    def on(self, gaussians: Gaussians) -> "F64":
        """[N] factors of these Gaussians."""
        return self.factors


@dataclass(frozen=True)
class OfParts:
    """The factors of one property by part: exact, since strokes keep the part of their Gaussians.

    Attributes:
        name: of the property.
        factors: outside all parts, then of the parts from label 1 on.
    """

    name: str
    factors: tuple[float, ...]

    def stroke_pass(self, gaussians: Gaussians, skip: str | None) -> StrokePass:
        """The pass that applies them, also to given strokes."""

        def changed(strokes: Gaussians) -> Gaussians:
            from brushgs.passes.where.maps import apply_factors

            return apply_factors(strokes, self.name, self.on(strokes))

        labels = [label for label, factor in enumerate(self.factors) if factor != 1]
        what = f"of {', '.join(f'{self.factors[label]:g}' for label in labels)} times the {self.name}"
        return StrokePass(f"{self.name} of parts", what, changed, inputs=(self,)).within(labels)

    def at(self, strokes: Gaussians, gaussians: Gaussians) -> "F64":
        """[k] factors of strokes."""
        return self.on(strokes)

    def on(self, gaussians: Gaussians) -> "F64":
        """[N] factors of Gaussians or strokes with labels of parts."""
        found = np.array(self.factors)
        return np.ones(len(gaussians)) if gaussians.regions is None else found[gaussians.regions]


Property: TypeAlias = Mapped | OfParts


def of_rules(rules: Rules | None) -> list[OfParts]:
    """The properties that rules change by a factor."""
    if rules is None:
        return []
    found = [
        OfParts(name, (1.0, *(getattr(rule, field) for rule in rules.rules)))
        for name, field in (("size", "size"), ("opacity", "opacity"), ("density", "share"))
    ]
    return [one for one in found if set(one.factors) != {1.0}]


def open_picture(path: Path, camera: Camera) -> "Array":
    """[H, W] lightness of a picture of a view, 0 to 1, in the size of the view; transparent is black.

    Raises:
        SceneError: if it cannot be read, or its sides differ from those of the view.
    """
    image = flatten(read_image(path), 0.0)
    height, width = image.shape[:2]
    if not abs((width / height) / (camera.width / camera.height) - 1) <= SAME_SHAPE:
        raise SceneError(
            path,
            f"must have the sides of the first view, {camera.width}x{camera.height}, got {width}x{height}; "
            "paint the map over that picture, or give --size",
        )
    return lightness(image, camera.width, camera.height)


def lightness(image: "Array", width: int, height: int) -> "Array":
    """[height, width] lightness of an RGB image, 0 to 1, scaled to fill a view."""
    filled = fill_picture(np.asarray(image, np.float32), width, height)
    return np.asarray(np.clip(filled @ np.array(LUMINANCE, np.float32), 0, 1))


def place_maps(
    gaussians: Gaussians,
    maps: Sequence[Map],
    source: SceneFiles | Gaussians | Clip,
    cameras: Later[Sequence[Camera]],
    first_view: FirstView | None,
    report: Report,
    *,
    num_threads: int | None = None,
) -> list[Mapped]:
    """The factors of each property that maps change; several maps of a property are multiplied.

    Gaussians hidden in the first view keep their property, whatever the picture.

    Args:
        gaussians: N Gaussians to make strokes of.
        maps: the options.
        source: of the scene, whose files have the columns.
        cameras: of the job; pictures lie over the first.
        first_view: of the scene, for its subject.
        report: gets the stage.
        num_threads: None takes the processors available to this process.

    Raises:
        SceneError: if a picture or column cannot be used.
        ValueError: if a part cannot be found, or a scene in memory has no columns.
    """
    from brushgs.passes.where.maps import factors_of, picture_values

    with report.stage("maps") as stage:
        found: dict[str, F64] = {}
        for one in maps:
            if isinstance(one.source, Where):
                factors = factors_of(
                    _inside(gaussians, one.source, first_view, num_threads), one.low, one.high
                )
            elif isinstance(one.source, str):
                factors = factors_of(_column(gaussians, one.source, source), one.low, one.high)
            else:
                from brushgs.cameras.around import small_view

                small = small_view(cameras()[0])
                picture = open_picture(one.source, small)
                values, is_seen = picture_values(gaussians, small, picture, num_threads=num_threads)
                factors = np.where(is_seen, factors_of(values, one.low, one.high), 1.0)
            found[one.name] = found.get(one.name, 1.0) * factors
            if (factors == 1).all():
                stage.skipped.append(f"{one}: changes nothing")
        changing = {name: factors for name, factors in found.items() if (factors != 1).any()}
        spans = {name: (float(f.min()), float(f.max()), float(f.mean())) for name, f in changing.items()}
        texts = (
            f"{name} x {low:.3g} to {high:.3g}, mean {mean:.3g}" for name, (low, high, mean) in spans.items()
        )
        stage.did = "; ".join(texts) or "nothing"
        stage.counts = {"maps": [str(one) for one in maps], "spans": spans}
    return [Mapped(name, factors) for name, factors in changing.items()]


def _inside(
    gaussians: Gaussians, source: Where, first_view: FirstView | None, num_threads: int | None
) -> "F64":
    from brushgs.passes.where import memberships

    return memberships(source, gaussians, context_of(WhereConfig(source, SOFT), first_view, num_threads))


def _column(gaussians: Gaussians, name: str, source: SceneFiles | Gaussians | Clip) -> "F64":
    """[N] values of a column: 0 and 1 for the lowest and highest 2 % of its numbers."""
    from brushgs.formats.scenes.ply import read_column
    from brushgs.passes.reduce.lloyd import assign

    if isinstance(source, Gaussians | Clip):
        raise ValueError(
            f"map has column:{name}, which belongs to a PLY file; name the file of a still scene"
        )
    files = SceneSource.of(source).files()
    columns = [read_column(path, name) for path in files]
    points, numbers = (np.concatenate(parts) for parts in zip(*columns, strict=True))
    is_used = np.isfinite(points).all(axis=1) & np.isfinite(numbers)
    if not is_used.any():
        raise SceneError(files[0], f"has no finite number in column {name!r}; name another column")
    points, numbers = points[is_used], numbers[is_used]
    low, high = np.quantile(numbers, TAILS)
    if not high > low:
        raise SceneError(files[0], f"has the number {low:g} all over column {name!r}; name another column")
    rows = assign(np.ascontiguousarray(gaussians.means, np.float32), points)[1]
    return np.asarray(np.clip((numbers[rows] - low) / (high - low), 0, 1))


def reader_of(
    mapped: Sequence[Property], name: str, gaussians: Gaussians
) -> "Callable[[Gaussians], F64] | None":
    """From strokes made of the N Gaussians to the [k] factors of one property; None without any."""
    return next((partial(one.at, gaussians=gaussians) for one in mapped if one.name == name), None)


def with_holds(
    coats: Sequence[Coat], mapped: Sequence[Property], gaussians: Callable[[], Gaussians]
) -> list[Coat]:
    """The coats of a film, except the backdrop, with the number of frames that maps hold their strokes."""
    if all(one.name != "hold" for one in mapped):
        return list(coats)
    holds = reader_of(mapped, "hold", gaussians())
    assert holds is not None
    return [
        coat
        if coat.name == BACKDROP
        else replace(coat, holds=np.clip(np.rint(holds(coat.strokes)), 1, MAX_HOLD).astype(np.intp))
        for coat in coats
    ]


def density_of(mapped: Sequence[Property], gaussians: Gaussians) -> "F64 | None":
    """[N] product of the factors on the strokes per area; None without any."""
    found = [one.on(gaussians) for one in mapped if one.name == "density"]
    return reduce(mul, found) if found else None
