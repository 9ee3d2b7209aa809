"""Parts of a scene that are painted otherwise: which Gaussians they hold, and what is done to strokes there.

Which part a Gaussian belongs to is decided once, before anything is made of it; strokes bear the part of
their Gaussians. A pass of a part is a pass like any other that sees the strokes of that part alone.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.options.direction import Direction
from brushgs.options.painting import PaletteConfig
from brushgs.options.rules import Rule, Rules
from brushgs.pipeline.color_changes import Changes, palette_pass
from brushgs.pipeline.make_strokes import ALREADY_STROKES, StrokePass
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import open_palette
from brushgs.pipeline.styling import Styles, directions_of, open_styles, style_brush_passes
from brushgs.values.arrays import Rows
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.color.recolor import Palette
    from brushgs.values.arrays import F64

STYLE_BRUSHES = "style brushes"  # the pass of these


@dataclass(eq=False)
class RegionPass(StrokePass):
    """A pass that sees the strokes of some parts alone.

    Attributes:
        labels: of these parts, 0 for what is in none.
    """

    labels: Collection[int] = ()

    def __call__(self, strokes: Gaussians) -> Gaussians:
        """All strokes, those of the parts after the pass."""
        rows = _rows_of(strokes, self.labels)
        self.num_before = self.num_after = len(rows)
        if self.skip is None and len(rows):
            with self.watch.running():
                before = strokes
                strokes = self.memory.of(
                    self.name, (before, *self.inputs), lambda: put(before, rows, self.run(before.take(rows)))
                )
        return strokes


@dataclass(frozen=True, eq=False)
class Region:
    """One part, with what it names opened.

    Attributes:
        label: its number, from 1.
        name: for reports.
        rule: of it.
        palette: None where it takes that of the painting.
        styles: None where it takes those of the painting, or its own have no share.
        kit: its brushes; None where it takes those of the painting.
    """

    label: int
    name: str
    rule: Rule
    palette: "Palette | None" = None
    styles: Styles | None = None
    kit: "BrushKit | None" = None

    @property
    def recolors(self) -> bool:
        """Whether it has other colours than the painting."""
        rule = self.rule
        return self.palette is not None or rule.style is not None or rule.adjust is not None

    @property
    def direction(self) -> Direction | None:
        """Which way its strokes run; None for that of the painting."""
        if self.rule.direction is None and self.styles is not None:
            has_marks = any(style.marks is not None for style, _ in self.styles.parts)
            return Direction("style") if has_marks else None
        return self.rule.direction


@dataclass(frozen=True, eq=False)
class Regions:
    """The parts of a painting.

    Attributes:
        regions: in the order of their rules.
        rules: of them.
    """

    regions: Sequence[Region]
    rules: Rules

    @property
    def names(self) -> list[str]:
        """Of the parts, for reports."""
        return [region.name for region in self.regions]

    @property
    def brushes(self) -> list[str]:
        """Names of all brushes that parts have of their own."""
        names = [name for region in self.regions for name in region.rule.brushes]
        styles = [region.styles for region in self.regions if region.styles is not None]
        return [*names, *(name for one in styles for of_style in one.brushes for name in of_style)]

    @property
    def needs_first_view(self) -> bool:
        """Whether it matters how the scene is seen."""
        styles = (region.styles for region in self.regions)
        return self.rules.needs_first_view or any(one is not None and one.needs_first_view for one in styles)

    @property
    def needs_camera(self) -> bool:
        """Whether strokes depend on how the first picture is seen."""
        directions = (region.direction for region in self.regions)
        return any(one is not None and one.needs_camera for one in directions)

    @property
    def recolors(self) -> bool:
        """Whether a part has other colours than the scene."""
        return any(region.recolors for region in self.regions)

    def place(
        self, gaussians: Gaussians, first_view: FirstView | None, report: Report, *, num_threads: int | None
    ) -> Gaussians:
        """The Gaussians with the label of the first part that each is in, see `Gaussians.regions`.

        Raises:
            ValueError: if nothing lies in any part.
            SceneError: if a part cannot be found.
        """
        with report.stage("regions") as stage:
            labels = np.zeros(len(gaussians), np.uint8)
            counts = []
            for region in self.regions:
                is_in = self._inside(region, gaussians, first_view, num_threads) & (labels == 0)
                labels[is_in] = region.label
                counts.append(int(np.count_nonzero(is_in)))
                if counts[-1] == 0:
                    stage.skipped.append(f"{region.name}: nothing of the scene is in it alone")
            rest = len(gaussians) - sum(counts)
            if len(gaussians) and rest == len(gaussians):
                raise ValueError(
                    f"rules: none of {rest:,} Gaussians lies in any of their regions; `brushgs info` prints "
                    "where the scene is"
                )
            named = list(zip(self.names, counts, strict=True))
            stage.did = ", ".join(f"{name} {count:,}" for name, count in named) + f", elsewhere {rest:,}"
            stage.counts = {"regions": [{"name": n, "gaussians": c} for n, c in named], "elsewhere": rest}
        return replace(gaussians, regions=labels)

    def _inside(
        self, region: Region, gaussians: Gaussians, first_view: FirstView | None, num_threads: int | None
    ) -> Any:
        from brushgs.passes.where import memberships, sides
        from brushgs.pipeline.where import context_of

        config = self.rules.where(region.rule)
        try:
            shares = memberships(config.expression, gaussians, context_of(config, first_view, num_threads))
        except SceneError:
            raise
        except ValueError as error:
            if self.rules.file is None:
                raise
            raise SceneError(self.rules.file, f"{self.rules.place(region.label)} {error}") from None
        return sides(shares, gaussians)

    def shares(self, gaussians: Gaussians, focus: "F64 | None") -> "F64 | None":
        """A focus [N], times how many times as many strokes per area each Gaussian gets by its part."""
        factors = np.array([1.0, *(region.rule.share for region in self.regions)])
        if gaussians.regions is None or (factors == 1).all():
            return focus
        found = factors[gaussians.regions]
        return found if focus is None else focus * found

    def stroke_passes(
        self,
        passes: Sequence[StrokePass],
        gaussians: Gaussians,
        camera: Camera | None,
        styles: Styles | None,
    ) -> list[StrokePass]:
        """The passes that make strokes, with those of the parts among them.

        Args:
            passes: of the painting.
            gaussians: that strokes are made of.
            camera: of the first picture.
            styles: of the painting.
        """
        found: list[StrokePass] = []
        for one in passes:
            if one.name == "direction":
                found += self._sized()
                one = self._directed(one, gaussians, camera, styles)
            found.append(one)
        return found

    def _sized(self) -> list[StrokePass]:
        """Other sizes and opacities, after strokes became solid."""
        passes: list[StrokePass] = []
        for region in self.regions:
            rule = region.rule
            if rule.size == 1 and rule.opacity == 1:
                continue

            def sized(strokes: Gaussians, rule: Rule = rule) -> Gaussians:
                dtype = strokes.scales.dtype.type
                scales, opacities = strokes.scales * dtype(rule.size), strokes.opacities * dtype(rule.opacity)
                return replace(strokes, scales=scales, opacities=opacities)

            what = f"of {rule.size:g} times the size, {rule.opacity:g} of the opacity"
            passes.append(
                RegionPass(f"size ({region.name})", what, sized, inputs=(rule,), labels=(region.label,))
            )
        return passes

    def _directed(
        self, one: StrokePass, gaussians: Gaussians, camera: Camera | None, styles: Styles | None
    ) -> StrokePass:
        """The pass of directions: each run sees all strokes, which agree with their neighbours."""
        own = [region for region in self.regions if region.direction is not None]
        if not own or one.skip == ALREADY_STROKES or len(gaussians) == 0:
            return one
        fields: dict[str, tuple[Any, list[int]]] = {}
        for region in own:
            direction = region.direction
            assert direction is not None
            key = str(direction) if direction.kind != "style" else f"style {region.label}"
            if key not in fields:
                fields[key] = _open_direction(region, camera, styles), []
            fields[key][1].append(region.label)
        base = one.run if one.skip is None else None

        def directed(strokes: Gaussians) -> Gaussians:
            from brushgs.passes.form.orient import orient

            turned = strokes if base is None else base(strokes)
            for opened, labels in fields.values():
                rows = _rows_of(strokes, labels)
                if len(rows):
                    turned = put(turned, rows, orient(strokes, gaussians, opened).take(rows))
            return turned

        names = ", ".join(fields)
        return replace(
            one,
            what=f"{one.what if base else 'run as clustered'}, in parts by {names}",
            run=directed,
            skip=None,
            counts={**one.counts, "directions": list(fields)},
            inputs=(gaussians, *one.inputs, self),
        )

    def palettes(self, passes: Sequence[StrokePass]) -> list[StrokePass]:
        """The pass of a palette, if any, and those of the parts with one of their own."""
        own = {}
        for region in self.regions:
            if region.palette is not None and region.rule.palette is not None:
                config = PaletteConfig(region.rule.palette, region.rule.palette_strength)
                own[region] = [palette_pass(region.palette, config)]
        return self._with_own(passes, own)

    def style_passes(self, passes: Sequence[StrokePass], changes: Changes) -> list[StrokePass]:
        """The pass of styles, which `changes` has, and those of the parts with some of their own."""
        own = {
            region: replace(changes, styles=region.styles).style_passes()
            for region in self.regions
            if region.rule.style is not None
        }
        return self._with_own(passes, own)

    def adjust_passes(self, passes: Sequence[StrokePass]) -> list[StrokePass]:
        """The pass of adjustments, and those of the parts with some of their own."""
        own = {
            region: Changes(None, region.rule.adjust).adjust_passes()
            for region in self.regions
            if region.rule.adjust is not None
        }
        return self._with_own(passes, own)

    def _with_own(
        self, passes: Sequence[StrokePass], own: Mapping[Region, Sequence[StrokePass]]
    ) -> list[StrokePass]:
        """Passes of the painting for what has none of its own, and those."""
        if not own:
            return list(passes)
        others = {*range(len(self.regions) + 1)} - {region.label for region in own}
        found: list[StrokePass] = [_limited(one, one.name, others) for one in passes]
        for region, of_region in own.items():
            found += [_limited(one, f"{one.name} ({region.name})", (region.label,)) for one in of_region]
        return found

    def brush_passes(self, passes: Sequence[StrokePass], kit: "BrushKit", *, seed: int) -> list[StrokePass]:
        """The passes that choose brushes, and those of the parts with brushes of their own.

        Args:
            passes: of the painting.
            kit: all brushes, those of parts among them.
            seed: of what is chosen by chance.

        Raises:
            ValueError: if the painting has a kernel in place of brushes.
        """
        row_of = {image: row for row, image in enumerate(kit.images)}
        own: dict[Region, list[StrokePass]] = {}
        styled: dict[Region, list[StrokePass]] = {}
        for region in self.regions:
            if region.kit is not None:
                own[region] = [_brush_pass(region.kit, row_of, seed)]
            if region.kit is not None or region.rule.style is not None:
                styled[region] = style_brush_passes(region.styles, kit, seed=seed)
        return [
            *self._with_own([one for one in passes if one.name != STYLE_BRUSHES], own),
            *self._with_own([one for one in passes if one.name == STYLE_BRUSHES], styled),
        ]


def open_regions(rules: Rules | None, report: Report) -> Regions | None:
    """Open the files that rules name, but for brushes; None where there are no rules.

    Args:
        rules: the options.
        report: gets the stages of palettes and styles.

    Raises:
        SceneError: if a file cannot be used.
    """
    if rules is None:
        return None
    from brushgs.brushes.kit import BrushKit

    regions = []
    for label, rule in enumerate(rules.rules, 1):
        palette = None
        if rule.palette is not None:
            palette = open_palette(PaletteConfig(rule.palette, rule.palette_strength), report)
        kit = None
        if rule.brushes:  # a single name stands for its variants too, as in a look
            kit = BrushKit.of(rule.brushes) if len(rule.brushes) > 1 else BrushKit(other=rule.brushes)
        styles = open_styles(rule.style, report)
        regions.append(Region(label, rules.label(label), rule, palette, styles, kit))
    return Regions(regions, rules)


def put(strokes: Gaussians, rows: Rows, part: Gaussians) -> Gaussians:
    """The strokes, with those of some rows as they are in a part [len(rows)]."""
    columns: dict[str, Any] = {}
    for name in (*strokes.columns(), "brushes"):
        ours, theirs = getattr(strokes, name), getattr(part, name)
        if theirs is None:
            continue
        changed = np.zeros(len(strokes), theirs.dtype) if ours is None else ours.copy()
        changed[rows] = theirs
        columns[name] = changed
    return replace(strokes, **columns)


def nearest_regions(strokes: Gaussians, others: Gaussians) -> Gaussians:
    """Other strokes, each with the label of the stroke that it lies nearest to."""
    if strokes.regions is None or len(others) == 0:
        return others
    return replace(others, regions=strokes.regions[nearest_rows(strokes, others)])


def nearest_rows(strokes: Gaussians, others: Gaussians) -> Rows:
    """[n] the row of the stroke that each of the others lies nearest to; 0 where there is none."""
    if len(strokes) == 0:
        return np.zeros(len(others), np.intp)
    from brushgs.passes.reduce.lloyd import assign

    points = np.ascontiguousarray(others.means, np.float32)
    return assign(points, strokes.means.astype(np.float64))[1].astype(np.intp)


def _open_direction(region: Region, camera: Camera | None, styles: Styles | None) -> Any:
    from brushgs.passes.form.open_field import open_field

    direction = region.direction
    assert direction is not None
    if direction.kind == "style":
        return directions_of(region.styles or styles, camera)
    return open_field(direction, camera)


def _brush_pass(kit: "BrushKit", row_of: Mapping[str, int], seed: int) -> StrokePass:
    """The pass that chooses among the brushes of a part, as rows of those of the painting."""
    if not set(kit.images) <= set(row_of):
        raise ValueError(
            f"rules: brushes ({', '.join(kit.images)}) cannot be mixed with a kernel, which is computed and "
            "not drawn; give --stroke a brush, or omit brushes from the rules"
        )
    rows = np.array([row_of[image] for image in kit.images], np.uint8)

    def chosen(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.choose_brushes import choose_brushes

        strokes = choose_brushes(strokes, kit, seed=seed)
        assert strokes.brushes is not None
        return replace(strokes, brushes=rows[strokes.brushes])

    return StrokePass("brushes", f"of {len(rows)} brushes", chosen)


def _limited(one: StrokePass, name: str, labels: Collection[int]) -> RegionPass:
    return RegionPass(
        name, one.what, one.run, one.skip, one.counts, one.inputs, one.memory, labels=tuple(labels)
    )


def _rows_of(strokes: Gaussians, labels: Collection[int]) -> Rows:
    if strokes.regions is None:
        return np.arange(len(strokes) if 0 in labels else 0)
    return np.flatnonzero(np.isin(strokes.regions, np.array(sorted(labels), np.uint8)))
