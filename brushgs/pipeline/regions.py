"""Parts of a scene with their own rules: the opened rules, and the Gaussians of each part.

The part of a Gaussian is decided once, before strokes are made; strokes keep the part of their Gaussians.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.options.direction import Direction
from brushgs.options.painting import PaletteConfig
from brushgs.options.rules import Rule, Rules
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import open_palette
from brushgs.pipeline.styling import Styles, open_styles
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.color.recolor import Palette


@dataclass(frozen=True, eq=False)
class Region:
    """One part, with its files opened.

    Attributes:
        label: its number, from 1.
        name: for reports.
        rule: the rule.
        palette: None for that of the painting.
        styles: None for those of the painting, or if its own have no share.
        kit: its brushes; None for those of the painting.
    """

    label: int
    name: str
    rule: Rule
    palette: "Palette | None" = None
    styles: Styles | None = None
    kit: "BrushKit | None" = None

    @property
    def palette_config(self) -> PaletteConfig | None:
        """The options of its own palette; None without one."""
        rule = self.rule
        return None if rule.palette is None else PaletteConfig(rule.palette, rule.palette_strength)

    @property
    def recolors(self) -> bool:
        """Whether its colors differ from those of the painting."""
        rule = self.rule
        return self.palette is not None or rule.style is not None or rule.adjust is not None

    @property
    def direction(self) -> Direction | None:
        """The direction of its strokes; None for that of the painting."""
        if self.rule.direction is None and self.styles is not None:
            turned = self.styles.taken("direction")
            has_marks = any(style.marks is not None and share > 0 for style, share in turned)
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
        """Names of the parts, for reports."""
        return [region.name for region in self.regions]

    @property
    def brushes(self) -> list[str]:
        """Names of all brushes of parts."""
        names = [name for region in self.regions for name in region.rule.brushes]
        styles = [region.styles for region in self.regions if region.styles is not None]
        return [*names, *(name for one in styles for of_style in one.brushes for name in of_style)]

    @property
    def needs_first_view(self) -> bool:
        """Whether a part depends on the first view."""
        styles = (region.styles for region in self.regions)
        return self.rules.needs_first_view or any(one is not None and one.needs_first_view for one in styles)

    @property
    def recolors(self) -> bool:
        """Whether the colors of a part differ from those of the scene."""
        return any(region.recolors for region in self.regions)

    def place(
        self, gaussians: Gaussians, first_view: FirstView | None, report: Report, *, num_threads: int | None
    ) -> Gaussians:
        """The Gaussians with the label of the first part that each is in, see `Gaussians.regions`.

        Raises:
            ValueError: if all parts are empty.
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


def open_regions(rules: Rules | None, report: Report) -> Regions | None:
    """Open the files of rules except brushes; None without rules.

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
        if rule.brushes:  # a single name includes its variants, as in a look
            kit = BrushKit.of(rule.brushes) if len(rule.brushes) > 1 else BrushKit(other=rule.brushes)
        styles = open_styles(rule.style, report)
        regions.append(Region(label, rules.label(label), rule, palette, styles, kit))
    return Regions(regions, rules)
