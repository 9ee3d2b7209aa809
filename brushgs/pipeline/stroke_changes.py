"""All that is done to strokes of a painting, in order: while they are made, and after."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from brushgs.options.look_parts import ColorConfig
from brushgs.options.painting import PaletteConfig, StrokesConfig
from brushgs.pipeline.color_changes import Changes, palette_pass
from brushgs.pipeline.make_strokes import (
    ALREADY_STROKES,
    StrokePass,
    broken_color_pass,
    brush_passes,
    color_passes,
)
from brushgs.pipeline.regions import Regions
from brushgs.pipeline.report import Report
from brushgs.pipeline.styling import Styles, style_brush_passes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.color.recolor import Palette


@dataclass(frozen=True, eq=False)
class Finish:
    """What is done to strokes after they were made.

    Attributes:
        passes: in this order.
    """

    passes: Sequence[StrokePass] = ()

    def __call__(self, strokes: Gaussians, report: Report | None = None) -> Gaussians:
        """The strokes after it; with a report its stages are told."""
        for one in self.passes:
            strokes = one(strokes)
            if report is not None:
                one.report(report)
        return strokes

    def then(self, name: str, run: Callable[[Gaussians], Gaussians]) -> "Finish":
        """The same with one more thing that is done."""
        return Finish([*self.passes, StrokePass(name, name, run)])


@dataclass(frozen=True, eq=False)
class StrokeChanges:
    """The passes of a painting.

    Attributes:
        making: what makes strokes of clusters.
        finish: what is done after that: nothing, where all of it is done while they are made.
        colors: changes of colour that do not come from the scene, for what lies behind the strokes.
    """

    making: Sequence[StrokePass]
    finish: Finish
    colors: Changes

    def later(self) -> Finish:
        """What is done to strokes that are made after the views were drawn: they are not in these."""
        return Finish([*(one for one in self.making if one.name != "repaint"), *self.finish.passes])


@dataclass(frozen=True, eq=False)
class Named:
    """What options name, opened, as far as it changes strokes.

    Attributes:
        palette: None without one.
        palette_config: how far strokes take its colours.
        styles: None without any.
        regions: None without rules.
        kit: which strokes each of several brushes suits.
    """

    palette: "Palette | None"
    palette_config: PaletteConfig | None
    styles: Styles | None
    regions: Regions | None
    kit: "BrushKit"


def changes_of(
    making: Sequence[StrokePass],
    named: Named,
    strokes: StrokesConfig,
    color: ColorConfig,
    colors: Changes,
    lit: Sequence[StrokePass],
    *,
    gaussians: Gaussians,
    camera: Camera | None,
    seed: int,
    skip: str | None,
) -> StrokeChanges:
    """The passes that options ask for.

    Args:
        making: what makes strokes of clusters, see `stroke_passes`.
        named: what options name.
        strokes: the options of strokes.
        color: those of colour.
        colors: changes of colour that do not come from the scene.
        lit: the light on the strokes, if any.
        gaussians: that strokes are made of.
        camera: of the first picture; None where no part has strokes that depend on it.
        seed: of what is chosen by chance.
        skip: why strokes stay as they are, see `stroke_passes`.
    """
    regions, choosing = named.regions, list[StrokePass]()
    if not (skip == ALREADY_STROKES and gaussians.brushes is not None):  # else they have theirs
        choosing += brush_passes(named.kit, strokes, seed=seed)
        choosing += style_brush_passes(named.styles, named.kit, seed=seed)
    palettes: list[StrokePass] = []
    if named.palette is not None and named.palette_config is not None:
        palettes = [palette_pass(named.palette, named.palette_config)]
    restyling, adjusting = colors.style_passes(), colors.adjust_passes()
    if regions is not None:
        making = regions.stroke_passes(making, gaussians, camera, named.styles)
        choosing = regions.brush_passes(choosing, named.kit, seed=seed)
        palettes = regions.palettes(palettes)
        restyling = regions.style_passes(restyling, colors)
        adjusting = regions.adjust_passes(adjusting)
    is_plain = named.palette is None and not colors.are_any and (regions is None or not regions.recolors)
    after = [
        *([] if is_plain else lit),  # first: light and shade have colours of the palette and the style
        *palettes,
        *color_passes(color, seed=seed),
        broken_color_pass(strokes, seed=seed, skip=skip),
        *restyling,  # after it: what differs from its neighbours is a colour of the style too
        *adjusting,
        *choosing,
    ]
    if is_plain:
        # So that a budget, which compares with the scene, is met with them; but the scene has another light.
        return StrokeChanges([*making, *after], Finish(lit), colors)
    return StrokeChanges(making, Finish(after), colors)
