"""The passes of the options, for a whole painting and for parts of its scene."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.options.direction import Direction
from brushgs.options.look_parts import ColorConfig
from brushgs.options.painting import StrokesConfig
from brushgs.pipeline.color_changes import Changes
from brushgs.pipeline.regions import Region
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.stroke_pass import Finish, StrokePass, put, rows_of
from brushgs.pipeline.styling import Styles, directions_of
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.form.defocus import Lens
    from brushgs.rendering.plain import PlainViews

BUSY_OF_PRINT = 0.5  # share of the marks of a print that lie over edges, which no stroke takes


@dataclass(frozen=True, eq=False)
class StrokeChanges:
    """The passes of a painting.

    Attributes:
        making: passes that make strokes of clusters.
        finish: later passes; none if all run while strokes are made.
        colors: color changes that do not come from the scene, for backdrop and ground.
    """

    making: Sequence[StrokePass]
    finish: Finish
    colors: Changes

    def later(self) -> Finish:
        """The passes for strokes that are made later, which the views do not show."""
        return Finish([*(one for one in self.making if one.name != "repaint"), *self.finish.passes])


def in_parts(
    passes: Sequence[StrokePass],
    parts: Sequence[Region],
    has_own: Callable[[Region], object],
    of: Callable[[Region], Sequence[StrokePass]],
) -> list[StrokePass]:
    """The passes of a painting, for all without own passes, then those of parts with own passes.

    Args:
        passes: of the painting.
        parts: of its scene.
        has_own: whether a part has its own passes, perhaps an empty list.
        of: the passes of such a part.
    """
    own = [part for part in parts if has_own(part)]
    if not own:
        return list(passes)
    others = {0, *(part.label for part in parts)} - {part.label for part in own}
    found = [one.within(others) for one in passes]
    return found + [one.within([part.label], part.name) for part in own for one in of(part)]


def solid_pass(config: StrokesConfig, skip: str | None, memory: Memory) -> StrokePass:
    """The pass that makes strokes solid paint."""

    def solid(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.solid import solidify

        return solidify(strokes)

    off = None if config.solid else "--solid off"
    return StrokePass("solid", "of solid paint", solid, skip or off, memory=memory)


@dataclass(frozen=True, eq=False)
class Field:
    """A direction of strokes.

    Attributes:
        words: its name.
        opened: as `orient` takes it.
        labels: of the parts with this direction; None for the whole painting.
    """

    words: str
    opened: Any
    labels: tuple[int, ...] | None = None


def open_fields(
    direction: Direction, styles: Styles | None, parts: Sequence[Region], camera: Camera | None
) -> list[Field]:
    """The directions of a painting and of parts of its scene, each with all parts that have it.

    `camera` is that of the first picture; None if no direction depends on it.
    """
    fields: dict[str, Field] = {}
    if direction.kind != "own":
        fields[""] = Field(str(direction), _opened(direction, styles, camera))
    for part in parts:
        own = part.direction
        if own is None:
            continue
        words = str(own) if own.kind != "style" else f"style {part.label}"
        known = fields.get(words) or Field(words, _opened(own, part.styles or styles, camera), ())
        fields[words] = replace(known, labels=(*(known.labels or ()), part.label))
    return list(fields.values())


def _opened(direction: Direction, styles: Styles | None, camera: Camera | None) -> Any:
    from brushgs.passes.form.open_field import open_field

    return directions_of(styles, camera) if direction.kind == "style" else open_field(direction, camera)


def direction_pass(
    gaussians: Gaussians, direction: Direction, fields: Sequence[Field], skip: str | None, memory: Memory
) -> StrokePass:
    """The pass that turns strokes; each field sees all strokes, for agreement with neighbours."""

    def turned(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.orient import orient

        found = strokes
        for one in fields:
            if one.labels is None:
                found = orient(strokes, gaussians, one.opened)
            elif len(rows := rows_of(strokes, one.labels)):
                found = put(found, rows, orient(strokes, gaussians, one.opened).take(rows))
        return found

    counts: dict[str, Any] = {"direction": str(direction)}
    what = f"run by {direction}"
    if skip is None and (in_parts := [one.words for one in fields if one.labels is not None]):
        counts["directions"] = in_parts
        what = f"{what if direction.kind != 'own' else 'run as clustered'}, in parts by {', '.join(in_parts)}"
    skip = skip or (None if fields else "--direction own")
    return StrokePass("direction", what, turned, skip, counts, (gaussians, *fields), memory)


def repaint_pass(
    gaussians: Gaussians, views: "PlainViews | None", skip: str | None, memory: Memory
) -> StrokePass:
    """The pass that takes colors from views of the scene at the strokes."""

    def seen(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.color.repaint import repaint

        assert views is not None, "repainting needs views"
        return repaint(strokes, gaussians, views)

    off = "--see off" if views is None else None
    what = "in the colors that are seen there"
    return StrokePass("repaint", what, seen, skip or off, {}, (gaussians, views), memory)


def defocus_pass(lens: "Lens", config: StrokesConfig, skip: str | None, memory: Memory) -> StrokePass:
    """The pass that takes detail from strokes out of focus."""
    strength = config.depth_of_field

    def blurred(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.defocus import defocus

        return defocus(strokes, lens, strength)

    what = f"larger and softer away from the focus, by {strength:g}"
    return StrokePass("depth of field", what, blurred, skip, {"strength": strength}, (lens, strength), memory)


def broken_color_pass(config: StrokesConfig, *, seed: int, skip: str | None) -> StrokePass:
    """The pass that varies colors from stroke to stroke, after a palette."""

    def broken(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.color.broken_color import CHROMA, LIGHTNESS, break_colors

        share = config.broken_color / LIGHTNESS
        return break_colors(strokes, config.broken_color, share * CHROMA, follows=config.economy, seed=seed)

    is_off = "--broken-color 0" if config.broken_color == 0 else None
    what = f"differ by {config.broken_color:g} in lightness"
    return StrokePass("broken color", what, broken, skip or is_off, {"lightness": config.broken_color})


def grading_passes(config: ColorConfig, *, seed: int) -> list[StrokePass]:
    """The passes that grade colors; none if the look does not."""

    def graded(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.color.tone import grade

        return grade(
            strokes,
            chroma=config.chroma,
            contrast=config.contrast,
            pivot=config.pivot,
            shadows=config.shadows,
            lights=config.lights,
        )

    def mixed(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.color.pigments import use_pigments

        return use_pigments(strokes, config.pigments, share=config.pure, seed=seed)

    passes = []
    if config.grades:
        passes.append(StrokePass("color", f"graded, chroma x {config.chroma:g}", graded))
    if config.pigments:
        what = f"mixed of {config.pigments} pigments"
        passes.append(StrokePass("pigments", what, mixed, counts={"pigments": config.pigments}))
    return passes


def brush_passes(kit: "BrushKit", config: StrokesConfig, *, seed: int) -> list[StrokePass]:
    """The pass that chooses a brush for each stroke; none for a single brush."""
    if len(kit.images) == 1:
        return []

    def chosen(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.choose_brushes import choose_brushes

        return choose_brushes(strokes, kit, material=config.economy, seed=seed)

    images = list(kit.images)
    return [StrokePass("brushes", f"of {len(images)} brushes", chosen, counts={"brushes": images})]


def part_brush_passes(kit: "BrushKit", row_of: Mapping[str, int], *, seed: int) -> list[StrokePass]:
    """The pass that chooses among the brushes of a part.

    Args:
        kit: of the part.
        row_of: row of each name among the brushes of the painting.
        seed: of random choices.

    Raises:
        ValueError: if the painting has a kernel instead of brushes.
    """
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

    return [StrokePass("brushes", f"of {len(rows)} brushes", chosen)]


def brush_color_pass(brushes: "BrushSet") -> StrokePass:
    """Strokes take the mean colors of their brushes, where these have colors."""

    def colored(strokes: Gaussians) -> Gaussians:
        rows = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes
        rgb = base_colors(strokes.sh)
        for row, texture in enumerate(brushes.textures):
            if texture.tint is not None:
                rgb[rows == row] = texture.tint.mean
        return in_colors(strokes, rgb)

    return StrokePass("stroke color", "in the colors of their brushes", colored)


def style_brush_passes(
    styles: Styles | None, kit: "BrushKit", *, seed: int, is_stage: bool = False
) -> list[StrokePass]:
    """The passes that give strokes the brushes of styles and the marks of their dictionaries.

    On a subject marks of paint yield to its detail. A print has few kinds of marks, and a stage no detail.
    """
    if styles is None or not any(styles.brushes) or not kit.styled:
        return []
    from brushgs.passes.style.choose_marks import Choice

    row_of = {image: row for row, image in enumerate(kit.images)}
    plain, own = [], []
    for names, (style, share) in zip(styles.brushes, styles.taken("marks"), strict=True):
        rows = np.array([row_of[name] for name in names if name in row_of], np.uint8)
        if len(rows) == 0:
            continue
        if style.marks is not None and style.marks.dictionary is not None:
            marks = style.marks.dictionary.first(len(rows))
            flat = marks.calmest(1 - BUSY_OF_PRINT * style.flatness)
            yields = 0.0 if is_stage else 1 - style.flatness
            own.append(Choice(marks.at(flat), rows[flat], share, yields))
        else:
            plain.append((rows, share))

    def mixed(strokes: Gaussians) -> Gaussians:
        from brushgs.passes.form.choose_brushes import mix_brushes
        from brushgs.passes.style.choose_marks import choose_marks

        return choose_marks(mix_brushes(strokes, plain, seed=seed), own, first=by_chance, seed=seed)

    by_chance = sum(share for _, share in plain)
    total = by_chance + sum(one.share for one in own)
    num = sum(len(rows) for rows, _ in plain) + sum(len(one.rows) for one in own)
    how = "by color and contrast" if own else "by chance"
    return [StrokePass("style brushes", f"{how} of {num} brushes, {total:.0%}", mixed)]
