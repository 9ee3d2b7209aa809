"""Parts of ink, hatching and stippling: keyed tones, a ground that hides, marks, and lines by weight."""

from dataclasses import replace

import numpy as np

from brushgs.brushes.soft import dot_brush, pen_brush
from brushgs.options.media import TonalMedium
from brushgs.passes.add.tonal_marks import Manner, tonal_marks
from brushgs.passes.add.tonal_view import TonalView
from brushgs.passes.color.tone import tones as tones_of
from brushgs.passes.seen import shown_areas
from brushgs.pipeline.media.materials import LINE_TOLERANCE, Materials, numbers_of
from brushgs.pipeline.stroke_pass import nearest_regions, nearest_rows
from brushgs.rendering.coat import Coat
from brushgs.rendering.tonal import Blacks
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.colors import rgb_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

KEY_SPREAD = (0.12, 1.0)  # tones of the darkest and lightest stroke in the focus
FINER = 0.4  # strength that lines in focus gain: more of them are drawn
PRESS, LIGHT = 1.1, 0.92  # of lines: width by darkness, below a tone
THIN = 0.5  # the least of it that is drawn
SHORTEST_RUN = 24.0  # widths of a part of a line between lights: shorter ones are crumbs


def keyed_tones(materials: Materials) -> F64:
    """[n] tones of the strokes, those in focus spread from dark to light."""
    strokes, sight, color = materials.strokes, materials.sight, materials.color
    if sight is None:
        return materials.tones
    areas = shown_areas(strokes, sight.pictures, kernel="gaussian")
    tones = tones_of(materials.shown, local=color.local, equalized=color.equalize, areas=areas)
    return keyed(tones, materials, numbers_of(TonalMedium, materials).key)


def keyed(tones: F64, materials: Materials, key: float) -> F64:
    """[n] tones of the strokes, of which those in focus are lifted: spread by rank from dark to light.

    `key` is how far, 0 to 1.
    """
    if materials.sight is None:
        return tones
    shares = key * materials.sight.focus_of(materials.strokes)
    inside = np.flatnonzero(shares > 0)
    if len(inside) < 2:
        return tones
    order = np.argsort(tones[inside], kind="stable")
    weights = shares[inside][order]
    ranks = np.empty(len(inside))
    ranks[order] = np.cumsum(weights) / weights.sum()
    spread = KEY_SPREAD[0] + (KEY_SPREAD[1] - KEY_SPREAD[0]) * ranks
    keyed = tones.copy()
    keyed[inside] += shares[inside] * (np.maximum(spread, tones[inside]) - tones[inside])
    return keyed


def views_of(materials: Materials, tones: F64) -> list[TonalView]:
    """The maps of the strokes in the views of the job; none without views."""
    if materials.sight is None or len(materials.strokes) == 0:
        return []
    return materials.sight.views(materials.strokes, tones, materials.options.num_threads)


def ground_coat(materials: Materials, tones: F64, blacks: Blacks | None) -> Coat:
    """The coat of paper in front of what the strokes hide, with spot blacks."""
    gray = np.repeat(tones[:, None], 3, axis=1)
    coat = materials.smudge("ground", in_colors(materials.strokes, gray))
    black = rgb_of(numbers_of(TonalMedium, materials).color)
    return replace(coat, effect=blacks or Blacks(0.0, 1.0, black, materials.paper))


def marks_coat(
    name: str,
    materials: Materials,
    views: list[TonalView],
    manner: Manner,
    *,
    is_left_out: list[Mask] | None = None,
    dry: float = 0.0,
    seed: int = 0,
) -> list[Coat]:
    """A coat of marks on the surfaces that the views show; none where there are none."""
    if not views:
        return []
    brush = dot_brush() if manner.is_round else pen_brush()
    options = replace(materials.options.for_marks(brush), low_pass=0.0)  # marks have their width on paper
    sigmas = options.num_sigmas
    marks = tonal_marks(
        views,
        manner,
        materials.strokes,
        num_sigmas=float(sigmas[0] if isinstance(sigmas, tuple) else sigmas),
        is_left_out=is_left_out,
        seed=seed,
    )
    if len(marks.strokes) == 0:
        return []
    strokes = in_colors(marks.strokes, rgb_of(numbers_of(TonalMedium, materials).color))
    strokes = nearest_regions(materials.strokes, strokes)
    return [
        Coat(
            name,
            strokes,
            brush,
            options,
            dry=dry,
            tolerance=materials.media.behind * LINE_TOLERANCE,
            nested=marks.nested,
            chains=marks.chains,
        )
    ]


def weighed_lines(materials: Materials, tones: F64) -> list[Coat]:
    """The coat of lines along edges, wide in the dark and none in the light."""
    media = numbers_of(TonalMedium, materials)
    if materials.lines is not None and materials.sight is not None:
        lines = materials.lines
        strengths = lines.strengths.copy()
        focus = materials.sight.focus_of(lines.strokes)
        np.maximum.at(strengths, np.searchsorted(lines.chains, lines.chains), lines.strengths + FINER * focus)
        strengths = strengths[np.searchsorted(lines.chains, lines.chains)]  # of each line as a whole
        materials = replace(materials, lines=replace(lines, strengths=strengths))
    if materials.lines is not None:
        even = replace(materials.lines, strokes=replace(materials.lines.strokes, brushes=None))
        materials = replace(materials, lines=even, line_texture=pen_brush())
    coats = materials.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry)
    return [_weighed(coat, materials.strokes, tones) for coat in coats]


def _weighed(coat: Coat, strokes: Gaussians, tones: F64) -> Coat:
    assert coat.chains is not None, "lines have pieces"
    side = _along(tones[nearest_rows(strokes, coat.strokes)], coat.chains)
    press = np.clip((LIGHT - side) * PRESS, 0, 1)
    order = np.argsort(-coat.strokes.scales, axis=1)
    scales, rows = coat.strokes.scales.copy(), np.arange(len(order))
    lengths, widths = (scales[rows, order[:, axis]] for axis in (0, 1))
    runs = np.cumsum((np.diff(coat.chains, prepend=-1) != 0) | np.diff(press > 0, prepend=False))
    is_drawn = (press > 0) & (np.bincount(runs, lengths / widths)[runs] > SHORTEST_RUN)
    for axis in (1, 2):
        scales[rows, order[:, axis]] *= np.maximum(press, THIN)
    shown = replace(coat.strokes, scales=scales, opacities=coat.strokes.opacities * is_drawn)
    return replace(coat, strokes=shown)


def _along(values: F64, chains: Rows) -> F64:
    from brushgs.values.along import Along

    return Along.of(chains).mean(values, 4)
