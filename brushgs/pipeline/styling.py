"""The styles of a painting: opened, and what of their marks strokes take: numbers, directions and brushes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.options.choices import StepValues
from brushgs.options.direction import Direction
from brushgs.options.look import Look, config_of
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.styling import StyleConfig
from brushgs.options.table import values_of
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera

if TYPE_CHECKING:
    from brushgs.passes.form.mark_directions import Marks
    from brushgs.values.style import Style, StyleEdit


@dataclass(frozen=True, eq=False)
class Styles:
    """The styles of a painting, opened.

    Attributes:
        parts: with their shares, each above 0.
        names: of these and their shares, for reports.
        brushes: names of the brushes of each; none where a painting keeps its own.
    """

    parts: "Sequence[tuple[Style, float]]"
    names: Sequence[str]
    brushes: Sequence[tuple[str, ...]]

    @property
    def edits(self) -> "list[tuple[StyleEdit, float]]":
        """Those that were learnt from edits."""
        return [(style.edit, share) for style, share in self.parts if style.edit is not None]

    @property
    def needs_first_view(self) -> bool:
        """Whether an edit depends on how the scene stands."""
        from brushgs.passes.style.edit import needed_features

        return bool(needed_features(edit for edit, _ in self.edits))


def open_styles(config: StyleConfig | None, report: Report) -> Styles | None:
    """Read the styles of a painting; a stage only where there are any.

    Raises:
        SceneError: if a file is no style.
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
        brushes = [_brushes_of(style, one.file) if config.has_brushes else () for one, style in styles]
    names = [f"{style.name} {one.share:.0%}" for one, style in styles]
    return Styles([(style, one.share) for one, style in styles], names, brushes)


def _brushes_of(style: "Style", file: Path) -> tuple[str, ...]:
    count = 0 if style.marks is None else len(style.marks.brushes)
    return tuple(f"{file}:{number}" for number in range(1, count + 1))


def styled_values(values: StepValues, config: StyleConfig) -> StepValues:
    """The values of a look, by step and field, on the way to those that the marks of styles ask for.

    Raises:
        SceneError: if a file is no style.
    """
    styles = open_styles(config, Report())
    marked = [] if styles is None else [one for one in styles.parts if one[0].marks is not None]
    if not marked:
        return values
    from brushgs.pipeline.style_values import style_values

    values = style_values(marked, values)
    return {**values, "strokes": {**values.get("strokes", {}), "direction": Direction("style")}}


def styled(look: PaintConfig | Look | str | Path | None, style: StyleConfig | str) -> PaintConfig:
    """A look on the way to styles, for whatever takes a look, as `paint` does.

    Args:
        look: see `brushgs.paint`.
        style: styles with their shares, such as "monet.style:0.7,dusk.style:0.3".

    Raises:
        SceneError: if a file cannot be read, or is no style.
        ValueError: if the style is no such text.

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
    """How the marks of styles run, laid over the picture of a camera.

    Raises:
        ValueError: if no style has marks.
    """
    if styles is None or all(style.marks is None for style, _ in styles.parts):
        raise ValueError("direction style needs --style, a style of a painting with marks")
    from brushgs.passes.style.directions import direction_field

    assert camera is not None, "marks lie over a picture"
    return direction_field(styles.parts, camera)
