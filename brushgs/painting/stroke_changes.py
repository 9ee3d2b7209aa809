"""All that is done to strokes of a painting, in order: while they are made, and after."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from brushgs.options.painting import PaintConfig
from brushgs.painting.color_changes import Changes, palette_pass
from brushgs.painting.guidance import Guidance
from brushgs.painting.lamp import Key
from brushgs.painting.make_strokes import (
    StrokePass,
    broken_color_pass,
    brush_passes,
    color_passes,
    stroke_passes,
)
from brushgs.painting.memory import Memory
from brushgs.painting.named import Named
from brushgs.painting.report import Report
from brushgs.painting.styling import style_brush_passes
from brushgs.scene import FirstView, Gaussians


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


def changes_of(
    config: PaintConfig,
    named: Named,
    gaussians: Gaussians,
    guidance: Guidance,
    first_view: FirstView | None,
    key: Key | None,
    *,
    skip: str | None,
    keeps_brushes: bool,
    memory: Memory,
) -> StrokeChanges:
    """The passes that options ask for.

    Args:
        config: the options.
        named: what they name.
        gaussians: that strokes are made of.
        guidance: what strokes are made by.
        first_view: of the scene; None where nothing needs it.
        key: the light on the strokes; None for that of the scene.
        skip: why strokes stay as they are, see `stroke_passes`.
        keeps_brushes: whether strokes have their brushes already.
        memory: of what passes returned.
    """
    seed, regions = config.cluster.seed, named.regions
    making = stroke_passes(
        gaussians, config.strokes, views=guidance.views, field=guidance.field, skip=skip, memory=memory
    )
    choosing: list[StrokePass] = []
    if not keeps_brushes:
        choosing = [
            *brush_passes(named.kit, config.strokes, seed=seed),
            *style_brush_passes(named.styles, named.kit, seed=seed),
        ]
    palettes: list[StrokePass] = []
    if named.palette is not None and config.palette is not None:
        palettes = [palette_pass(named.palette, config.palette)]
    shown_by = () if guidance.views is None else guidance.views.cameras
    colors = Changes(named.styles, config.adjust, first_view, shown_by)
    restyling, adjusting = colors.style_passes(), colors.adjust_passes()
    if regions is not None:
        making = regions.stroke_passes(making, gaussians, guidance.camera, named.styles)
        choosing = regions.brush_passes(choosing, named.kit, seed=seed)
        palettes = regions.palettes(palettes)
        restyling = regions.style_passes(restyling, colors)
        adjusting = regions.adjust_passes(adjusting)
    lit = [] if key is None else [key.stroke_pass(skip=skip)]
    is_plain = named.palette is None and not colors.are_any and (regions is None or not regions.recolors)
    after = [
        *([] if is_plain else lit),  # first: light and shade have colours of the palette and the style
        *palettes,
        *color_passes(config.color, seed=seed),
        broken_color_pass(config.strokes, seed=seed, skip=skip),
        *restyling,  # after it: what differs from its neighbours is a colour of the style too
        *adjusting,
        *choosing,
    ]
    if is_plain:
        # So that a budget, which compares with the scene, is met with them; but the scene has another light.
        return StrokeChanges([*making, *after], Finish(lit), colors)
    return StrokeChanges(making, Finish(after), colors)
