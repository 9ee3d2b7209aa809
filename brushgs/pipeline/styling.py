"""Styles of a painting: open them, and apply their numbers, directions and brushes to strokes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.choices import StepValues
from brushgs.options.direction import Direction
from brushgs.options.look import Look, config_of
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.styling import StyleConfig
from brushgs.options.table import values_of
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera

if TYPE_CHECKING:
    from brushgs.passes.add.stage_map import Manner
    from brushgs.passes.form.mark_directions import Marks
    from brushgs.values.style import Style, StyleEdit


CONTOUR_SHARES = (0.1, 0.16)  # share of a painting in contours: at 15 % of full opacity, and at full
CONTOUR_OPACITY = 0.9
LINE_SIDE = 600  # pixels of the shorter side of a picture in which lines have their width
LINE_WIDTH = 0.6  # of the contours of a painting, with which lines are seen as wide


@dataclass(frozen=True)
class Contour:
    """How the contours of styles look.

    Attributes:
        width: px of the strongest, in a picture of 800x600.
        color: RGB, display-encoded.
        opacity: 0 to 1.
    """

    width: float
    color: tuple[float, float, float]
    opacity: float


@dataclass(frozen=True, eq=False)
class Styles:
    """The styles of a painting, opened.

    Attributes:
        parts: with their shares, each above 0.
        names: their names and shares, for reports.
        brushes: names of the brushes of each; empty if a painting keeps its own.
        dials: for each style, factors on its share by name of a property; 1 if missing.
    """

    parts: "Sequence[tuple[Style, float]]"
    names: Sequence[str]
    brushes: Sequence[tuple[str, ...]]
    dials: "Sequence[Mapping[str, float]]" = ()

    def taken(self, name: str) -> "list[tuple[Style, float]]":
        """The styles with their shares for one property, see `StyleShare`."""
        dials = self.dials or [{}] * len(self.parts)
        return [
            (style, share * at.get(name, 1.0)) for (style, share), at in zip(self.parts, dials, strict=True)
        ]

    @property
    def edits(self) -> "list[tuple[StyleEdit, float]]":
        """Styles learned from edits, with shares."""
        return [(style.edit, share) for style, share in self.parts if style.edit is not None]

    @property
    def needs_first_view(self) -> bool:
        """Whether an edit depends on the first view of the scene."""
        from brushgs.passes.style.edit import needed_features

        return bool(needed_features(edit for edit, _ in self.edits))


def open_styles(config: StyleConfig | None, report: Report) -> Styles | None:
    """Read the styles of a painting; reports a stage only if there are any.

    Raises:
        SceneError: if a file is not a style.
    """
    if config is None:
        return None
    with report.stage("style") as stage:
        from brushgs.formats.styles import read_style

        styles = [(one, read_style(one.file)) for one in config.styles]
        stage.did = ", ".join(f"{style.name} {one.share:.0%}" for one, style in styles)
        stage.counts = {"styles": {str(one.file): one.share for one, _ in styles}}
        styles = [(one, style) for one, style in styles if one.share > 0]
        if not styles:
            stage.skipped.append("style: its share is 0")
            return None
        from brushgs.brushes.of_style import names_of_style

        has = config.has_brushes
        brushes = [names_of_style(one.file, style.marks) if has else () for one, style in styles]
    names = [f"{style.name} {one.share:.0%}" for one, style in styles]
    parts = [(style, one.share) for one, style in styles]
    return Styles(parts, names, brushes, [one.dials for one, _ in styles])


def styled_values(values: StepValues, config: StyleConfig) -> StepValues:
    """The values of a look, by step and field, blended with those of the styles' marks.

    Raises:
        SceneError: if a file is not a style.
    """
    styles = open_styles(config, Report())
    marked = [] if styles is None else [one for one in styles.taken("marks") if one[0].marks is not None]
    if styles is None or not marked:
        return values
    from brushgs.pipeline.style_values import style_values

    values = style_values(marked, values)
    if not any(share for style, share in styles.taken("direction") if style.marks is not None):
        return values
    return {**values, "strokes": {**values.get("strokes", {}), "direction": Direction("style")}}


def styled(look: PaintConfig | Look | str | Path | None, style: StyleConfig | str) -> PaintConfig:
    """A look blended with styles, for `paint` and other functions that take a look.

    Args:
        look: see `brushgs.paint`.
        style: styles with their shares, such as "monet.style:0.7,dusk.style:0.3".

    Raises:
        SceneError: if a file cannot be read, or is not a style.
        ValueError: if the text of the styles is invalid.

    Example:
        >>> from brushgs.values.style import StyleEdit
        >>> darker = StyleEdit(0.6 * np.eye(3, 4))
        >>> bg.save_style(bg.Style("dusk", edit=darker), "dusk.style")
        >>> options = bg.styled("oil", "dusk.style:0.7")
        >>> frame = bg.paint(gaussians, options, camera=camera)
    """
    config, style = config_of(look), StyleConfig.parse(style) if isinstance(style, str) else style
    steps = {step: getattr(config, step) for step in STEPS}
    values = {step: values_of(part) for step, part in steps.items() if part is not None}
    return replace(PaintConfig.of(styled_values(values, style)), style=style)


def directions_of(styles: Styles | None, camera: Camera | None) -> "Marks":
    """Directions of the styles' marks, in the picture of a camera.

    Raises:
        ValueError: if no style has marks.
    """
    if styles is None or all(style.marks is None for style, _ in styles.parts):
        raise ValueError("direction style needs --style, a style of a painting with marks")
    from brushgs.passes.style.directions import direction_field

    assert camera is not None, "marks lie over a picture"
    return direction_field(styles.taken("direction"), camera)


def manner_of(styles: Styles | None) -> "Manner | None":
    """How styles paint a stage; None if no style describes one."""
    if styles is None:
        return None
    staged = [(one, share) for one, share in styles.taken("stage") if one.stage is not None and share > 0]
    if not staged:
        return None
    from brushgs.passes.add.stage_map import Manner, Part
    from brushgs.passes.style.transport import flat_colors

    shares = {name: dict(_by_style(styles, name)) for name in ("color", "direction", "marks")}
    whole = dict(_by_style(styles, ""))
    parts, size, aspect, marked, jitter = [], 0.0, 0.0, 0.0, np.zeros(2)
    for style, share in staged:
        assert style.stage is not None
        of = {name: share * found[id(style)] / whole[id(style)] for name, found in shares.items()}
        dictionary = None if style.marks is None else style.marks.dictionary
        inks = None if style.palette is None or style.flatness == 0 else flat_colors(style)
        parts.append(Part(style.stage, of["color"], of["direction"], dictionary, inks))
        if (marks := style.marks) is not None:
            size += of["marks"] * np.log(marks.length / np.sqrt(marks.aspect))
            aspect += of["marks"] * np.log(marks.aspect)
            marked += of["marks"]
            jitter += of["marks"] * np.array(broken_of(style))
    total = max(marked, 1e-9)
    lightness, chroma = (jitter / total).tolist()
    return Manner(
        parts, float(np.exp(size / total)), float(np.exp(aspect / total)), marked, (lightness, chroma)
    )


def _by_style(styles: Styles, name: str) -> "list[tuple[int, float]]":
    return [(id(style), share) for style, share in styles.taken(name)]


def broken_of(style: "Style") -> tuple[float, float]:
    """Spread of a style's marks in lightness and chroma; the latter is 0 for a black and white painting."""
    assert style.marks is not None
    from brushgs.passes.style.transport import is_grey
    from brushgs.pipeline.style_values import MOST_BROKEN

    lightness, chroma = style.marks.broken_lightness, style.marks.broken_chroma
    if is_grey(style.palette):
        chroma = 0.0
    most = (1 - style.flatness) * 0.7 * MOST_BROKEN
    return min(lightness, most), min(chroma, 0.25 * MOST_BROKEN)


def contour_of(styles: Styles) -> Contour | None:
    """The most opaque contours of any style; None without any."""
    found: list[Contour] = []
    for style, share in styles.taken("line"):
        if style.lines is not None and share > 0:
            low, high = CONTOUR_SHARES
            full = min(0.15 + 0.85 * (style.lines.share - low) / (high - low), 1.0)
            red, green, blue = (float(channel) for channel in style.lines.rgb)
            opacity = CONTOUR_OPACITY * share * max(full, 0.0)
            found.append(Contour(LINE_WIDTH * style.lines.width * LINE_SIDE, (red, green, blue), opacity))
    return max(found, key=lambda one: one.opacity, default=None)
