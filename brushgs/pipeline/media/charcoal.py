"""Charcoal on toned paper: masses in four values, rubbed; marks of the stick; lights of a rubber and chalk.

Tones, not colors. Masses are decided for the strokes of a scene in space, once for a job: each belongs to
one of four values, which are corrected by squinting at drawing and motif. What is pressed, marks, accents and
lines, lies in the tooth of the paper, and only where the masses show the same surface. Shares are of what the
views of the job show. Constants were settled by eye on captured scenes.
"""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.cameras.framing import weighted_quantiles
from brushgs.options.media import Charcoal
from brushgs.passes.color.squint import Squint
from brushgs.passes.neighbours import nearest
from brushgs.passes.seen import some_small
from brushgs.pipeline.media.materials import (
    BACKDROP,
    MOST_VIEWS,
    SIDE,
    Color,
    Materials,
    mixed,
    numbers_of,
    scaled,
)
from brushgs.pipeline.media.squinting import value_errors
from brushgs.pipeline.media.tonal import keyed
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.values.arrays import F64, Mask
from brushgs.values.colors import oklab_of, rgb_of
from brushgs.values.frame import Frame
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

VALUES = (1.0, 0.58, 0.22, 0.0)  # of the four masses, the darkest first, in shares of the wash
SHARES = (0.18, 0.42, 0.70)  # of the picture that is darker than each border between two values
# Share of a border that is so by area; its tone else, and always where the masses spread less than this.
BY_AREA, USUAL, LEAST_SPREAD = 0.4, (0.2, 0.42, 0.66), 0.1
MASSED = 0.75  # share of the soft tone that is one of the values; the rest follows the tone
REACH = 0.9  # of a mass, relative to the strokes
WAVE = 0.25  # of the noise by which edges are rubbed, in the extent of the strokes
LEAST_MARK = 0.1  # opacity of the faintest mark, relative to the darkest
PRESSED = 1.3  # power of the darkness of marks
ACCENT = (0.05, 0.14)  # tones at which accents are pressed most, and from which there are none
LIGHTS, WHITES = 0.86, 0.965  # share of the picture that is darker than what rubber and chalk show
FADE = 0.10  # range of tones over which both become opaque
BARE = 0.55  # of the way from the paper to chalk that a rubber takes a rubbed paper
CHALK = (0.98, 0.97, 0.94)
WHITE_PAPER = 0.93  # OKLab lightness from which chalk would not show
CORRECTIONS, CORRECTED = 2, 0.8  # of values by squinting, and the share of an error that each takes away
# Range of values, L*, of strokes below which corrections open them, before a stage and without; and the most
# corrections without a stage, which would open them further.
OPENED, OPENED_ALONE, MOST_CORRECTIONS = 42.0, 52.0, 4
BESIDE_LINES = 8  # strokes near a line, of which one must be solid
COUNTERED = 0.75  # darkness that counterchange adds and takes
STAGE, STAGE_BORDER = 1.5, 0.1  # darkness of the masses around a subject, and their margin in the picture
LIGHTEST_STAGE, DARKEST_STAGE = 0.2, 0.8  # share of a stage that stays light, and its darkest share of black
# Of the differences in a stage, tried until the picture has this range of values, L*; at 240 pixels, without
# the tooth of the paper, up to 6 more than at 960.
GAINS, RANGE = (1.0, 1.35, 1.8, 2.4, 3.2, 4.4, 6.0), 48.0


def charcoal(materials: Materials) -> list[Coat]:
    """The coats of a drawing in charcoal."""
    from brushgs.passes.color.tone import masses

    tone, soft = (_tones(materials, local) for local in (materials.color.local, 0.0))
    borders = _borders(masses(materials.strokes, soft, materials.areas), materials.areas)
    coats = _coats(materials, tone, soft, borders)
    least = OPENED_ALONE if materials.is_bare else OPENED
    for number in range(MOST_CORRECTIONS if materials.is_bare else CORRECTIONS):
        missing, found = value_errors(materials, coats, least)
        if number >= CORRECTIONS and found >= least:
            break
        tone, soft = tone + CORRECTED * missing, soft + CORRECTED * missing
        coats = _coats(materials, tone, soft, borders)
    return coats


def _coats(materials: Materials, tone: F64, soft: F64, borders: F64) -> list[Coat]:
    """The coats for strokes of tones [N], which are softer [N] in the masses; borders [3] of those."""
    media, strokes, areas = numbers_of(Charcoal, materials), materials.strokes, materials.areas
    black, coats = rgb_of(media.color), [_masses(materials, soft, borders)]

    def marks(name: str, rows: Mask, weights: F64, dry: float, look: "_Marks") -> None:
        """A coat of marks on some of the strokes."""
        chosen = np.flatnonzero(rows & (weights > 0))
        if not len(chosen):
            return
        drawn = scaled(strokes, *look.sizes, opacities=weights * materials.solidity)
        coats.append(materials.marks(name, in_colors(drawn, look.color).take(chosen), dry=dry))

    pressed = np.clip((media.middle - tone) / max(media.middle, 1e-6), 0, 1)
    opacities = media.marks * (LEAST_MARK + (1 - LEAST_MARK) * pressed**PRESSED)
    marks("marks", pressed > 0, opacities, media.dry, _Marks((1.15, 0.75), black))
    most, least = ACCENT
    accents = media.accents * np.clip((least - tone) / (least - most), 0, 1)
    marks("pressed", accents > 0, accents, media.line_dry, _Marks((1.0, 0.55), black))
    lights, whites = _quantiles(tone, areas, (LIGHTS, WHITES))
    taken = media.rubber * np.clip((tone - lights) / FADE + 0.15, 0, 1)
    paper = oklab_of(np.array([materials.paper]))[0, 0]
    bare = tuple(mixed(materials.paper, CHALK, np.array([BARE]))[0].tolist())
    marks("rubber", tone > lights, taken, media.line_dry, _Marks((1.1, 0.7), bare))
    if paper < WHITE_PAPER:
        laid = media.chalk * np.clip((tone - whites) / FADE + 0.3, 0, 1)
        marks("chalk", tone > whites, laid, media.chalk_dry, _Marks((1.0, 0.6), CHALK))
    return coats + _lines(materials, tone)


class _Marks(NamedTuple):
    """How marks look: length and width relative to their strokes, and color."""

    sizes: tuple[float, float]
    color: tuple[float, float, float]


def _tones(materials: Materials, local: float) -> F64:
    """[N] tones of the strokes by what the views show; `local` as for `tones`."""
    from brushgs.passes.color.tone import ENDS_SEEN, tones

    equalized = materials.color.equalize
    found = tones(materials.shown, local=local, equalized=equalized, areas=materials.areas, ends=ENDS_SEEN)
    return keyed(found, materials, numbers_of(Charcoal, materials).key)


def _masses(materials: Materials, tone: F64, borders: F64) -> Coat:
    """The soft tone under the marks, in four values, rubbed."""
    from brushgs.passes.color.tone import masses
    from brushgs.passes.extent import robust_frame
    from brushgs.rendering.rub import Rub

    media, strokes, areas = numbers_of(Charcoal, materials), materials.strokes, materials.areas
    black = rgb_of(media.color)
    if len(strokes) == 0:
        return materials.smudge("masses", strokes)
    mass = masses(strokes, tone, areas)
    values = media.wash * np.array(VALUES)
    value = values[np.searchsorted(borders, mass, side="right")]
    shares = MASSED * value + (1 - MASSED) * values[0] * np.clip(1 - mass / max(borders[-1], 1e-6), 0, 1)
    soft = in_colors(strokes, mixed(materials.paper, black, shares))
    coat = materials.smudge("masses", scaled(soft, REACH, REACH, opacities=3 * strokes.opacities))
    _, radius = robust_frame(strokes.means)
    wave, ordered = max(WAVE * radius, 1e-12), tuple(sorted(values.tolist()))
    rub = Rub(materials.paper, black, ordered, media.rub, wave, materials.is_room)
    return replace(coat, effect=rub)


def _borders(mass: F64, areas: F64) -> F64:
    """[3] borders between the four values: by area and by tone; in a scene of one tone by tone alone."""
    found, ends = _quantiles(mass, areas, SHARES), _quantiles(mass, areas, (0.1, 0.9))
    spread = BY_AREA * min(float(ends[1] - ends[0]) / LEAST_SPREAD, 1.0)
    return spread * found + (1 - spread) * np.array(USUAL)


def _quantiles(tone: F64, areas: F64, shares: tuple[float, ...]) -> F64:
    """[n] tones below which these shares of the picture lie."""
    return np.asarray(weighted_quantiles(tone, areas, shares)) if len(tone) else np.asarray(shares)


def _lines(materials: Materials, tone: F64) -> list[Coat]:
    """The coat of lines, on the dark side only, and none around ground that fades into a stage."""
    from brushgs.passes.add.line_press import pressed

    media, strokes = numbers_of(Charcoal, materials), materials.strokes
    if materials.lines is None or len(strokes) == 0:
        return []
    lines = pressed(materials.lines, strokes, tone)
    _, near = nearest(strokes.means, lines.strokes.means, min(BESIDE_LINES, len(strokes)))
    opacities = lines.strokes.opacities * materials.solidity[near].max(axis=1, initial=0)
    faded = replace(lines.strokes, opacities=opacities.astype(strokes.opacities.dtype))
    drawn = replace(materials, lines=replace(lines, strokes=faded))
    return drawn.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry)


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A stage in smudged masses, darker in the shadow; tones as light as the paper stay paper.

    By counterchange it is rubbed darker beside light sides of the subject, and lighter beside dark ones.
    """
    from brushgs.passes.add.beside import beside

    media, strokes = numbers_of(Charcoal, materials), staging.painted()
    toned = in_colors(materials.strokes, np.repeat(_tones(materials, 0.0)[:, None], 3, axis=1))
    paper = oklab_of(np.array([materials.paper]))[0, 0]
    dark = np.clip(1 - oklab_of(base_colors(strokes.sh).astype(np.float64))[:, 0] / paper, 0, 1)
    shares = np.maximum(media.wash * (STAGE * dark + COUNTERED * beside(toned, strokes, staging.cameras)), 0)
    low, black = float(np.quantile(shares, LIGHTEST_STAGE)), rgb_of(media.color)
    views, subject = some_small(staging.cameras, MOST_VIEWS, SIDE), charcoal(materials)
    coat = replace(materials.smudge(BACKDROP, strokes), border=STAGE_BORDER)
    tried: list[tuple[float, Coat]] = []
    for gain in GAINS:
        opened = np.clip(low / gain + gain * (shares - low), 0, DARKEST_STAGE)
        coat = replace(coat, strokes=in_colors(strokes, mixed(materials.paper, black, opened)))
        painting = Painting.alone((coat, *subject))
        found = float(np.mean([_range_of(painting.frame(view), materials.paper) for view in views]))
        tried.append((found, coat))
        if found >= RANGE:
            break
    return max(tried, key=lambda one: one[0])[1]


def _range_of(frame: Frame, paper: Color) -> float:
    """The range of values of a picture of strokes on paper, L*, see `Squint`."""
    picture = frame.rgb + (1 - frame.alpha[..., None]) * np.asarray(paper, frame.rgb.dtype)
    return Squint.of(picture, frame.alpha).range
