"""What the options of a painting name beside its scene, opened: brushes, palette, styles and parts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from brushgs.options.painting import PaintConfig
from brushgs.painting.drawing import open_brushes
from brushgs.painting.regions import Regions, open_regions
from brushgs.painting.report import Report
from brushgs.painting.strokes import open_palette
from brushgs.painting.styling import Styles, open_styles

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.recolor import Palette


@dataclass(frozen=True, eq=False)
class Named:
    """What options name, opened.

    Attributes:
        texture: the stroke images, or a kernel, those of styles and parts among them.
        kit: which strokes each of several suits.
        palette: None without one.
        styles: None without any.
        regions: None without rules.
        has_more: whether styles or parts have brushes of their own.
    """

    texture: "BrushSet"
    kit: "BrushKit"
    palette: "Palette | None"
    styles: Styles | None
    regions: Regions | None
    has_more: bool = False

    @property
    def needs_first_view(self) -> bool:
        """Whether it matters how the scene is seen."""
        return any(one is not None and one.needs_first_view for one in (self.styles, self.regions))

    @property
    def needs_camera(self) -> bool:
        """Whether strokes depend on how the first picture is seen."""
        return self.regions is not None and self.regions.needs_camera

    def painted_with(self, brushes: "tuple[BrushSet, BrushKit] | None") -> "Named":
        """The same with other brushes; the same itself where there are none."""
        return self if brushes is None else replace(self, texture=brushes[0], kit=brushes[1])


def open_named(config: PaintConfig, report: Report, recall: Callable[..., Any]) -> Named:
    """Open what options name.

    Args:
        config: the options.
        report: gets the stages.
        recall: see `Memory.of`.

    Raises:
        SceneError: if a file cannot be used.
    """
    styles = recall("style", (config.style,), lambda: open_styles(config.style, report))
    regions = recall("region files", (config.rules,), lambda: open_regions(config.rules, report))
    more = [] if styles is None else [name for names in styles.brushes for name in names]
    more += [] if regions is None else regions.brushes
    named = config.brushes, config.draw.stroke, config.view.fixed_size
    texture, kit = recall("stroke", (*named, *more), lambda: open_brushes(config, more, report))
    palette = recall("palette", (config.palette,), lambda: open_palette(config.palette, report))
    return Named(texture, kit, palette, styles, regions, has_more=bool(more))
