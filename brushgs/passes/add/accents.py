"""Accents: a few small strokes of pure light and dark, laid last.

Merged strokes have the mean color of their members, so a painting loses the extreme lights and darks of its
scene, such as the highlight in an eye. Accents in these colors are laid where they are missing most.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.groups import add_rows
from brushgs.passes.neighbours import nearest
from brushgs.rendering.options import RenderOptions, draw_with, project_with
from brushgs.rendering.plain import PlainViews
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_sums
from brushgs.values.arrays import F32, F64, Array, Rows, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import shift_base_colors

# Number of accents in a painting of 4800 strokes and more; below that one per 80 strokes, below 400 none.
NUM_ACCENTS, STROKES_EACH, LEAST_STROKES = 60, 80, 400
EXTREMES = 0.05  # share of the pixels of views that is light, and the same for dark
LEAST_CONTRAST = 0.08  # OKLab L, minimum difference of lights and darks from the middle
OPAQUE = 0.8  # alpha of pixels that are compared
LACKS = (0.03, 0.12)  # OKLab L: a smaller lack counts 0, a larger one 1
PURER = 0.02  # OKLab L beyond the color of the scene
LENGTH = 0.014  # of an accent, over the diagonal of the first view: 7 pixels of 400x300
ASPECT, THICKNESS = 2.2, 0.15  # length over width, and thickness over width
APART = 3.0  # minimum distance of two accents, in lengths: side by side they look like a fence
OPACITY = 0.95
BEFORE = 8  # nearest strokes, all of which an accent lies in front of
LEAST = 0.05  # minimum lack at an accent, OKLab L times pixels over all views
MOST_PLACES = 20  # candidates per accent
SURE = 0.5  # alpha of a pixel that shows a color
MOST_LIFT = 1.5  # maximum shift toward the camera, in lengths


def num_accents(num_strokes: int, economy: float) -> int:
    """Maximum number of accents among `num_strokes` strokes."""
    most = min(NUM_ACCENTS, num_strokes // STROKES_EACH) if num_strokes >= LEAST_STROKES else 0
    return round(economy * most)


def accents(
    strokes: Gaussians,
    gaussians: Gaussians,
    views: PlainViews,
    *,
    count: int = NUM_ACCENTS,
    focus: F64 | None = None,
) -> Gaussians:
    """New strokes for the lights and darks that a painting lacks.

    Args:
        strokes: k strokes, as painted.
        gaussians: the N Gaussians of the strokes.
        views: plain pictures of the scene, the first in the view of the picture; a few are enough. Hidden
            Gaussians get no accent.
        count: maximum number, half of them lights if both are missing, >= 0.
        focus: [N] > 0, weight of an accent at each Gaussian; None for 1.

    Returns:
        At most `count` flat strokes with the columns of the others, each along the stroke below it and
        slightly in front of it in the first view, without view-dependent color. Fewer if less is missing.
    """
    if count <= 0 or len(strokes) == 0 or len(gaussians) == 0 or len(views) == 0:
        return strokes.take(slice(0, 0))
    plain = [oklab_planes(_on_grey(frame))[0] for frame in views.frames]
    ends = _ends(plain, views)
    lacks = _lacks(strokes, gaussians, views, plain, ends)
    if focus is not None:
        lacks *= np.asarray(focus, np.float64)[:, None]
    size = _length(gaussians, views.cameras[0])
    dark, light = (
        _pure(gaussians, views, one, end, size, count)
        for one, end in zip(lacks.T, ((-1.0, ends[0]), (1.0, ends[1])), strict=True)
    )
    num_lights = max(count // 2, count - len(dark.rows))
    light, dark = light.first(num_lights), dark.first(count - min(num_lights, len(light.rows)))
    rows = np.concatenate([light.rows, dark.rows])
    if not len(rows):
        return strokes.take(slice(0, 0))
    laid = _laid(strokes, gaussians.means[rows].astype(np.float64), size[rows], views.cameras[0])
    return shift_base_colors(laid, np.concatenate([light.colors, dark.colors]) - 0.5)


@dataclass(frozen=True, eq=False)
class _Chosen:
    """Gaussians for accents, best first.

    Attributes:
        rows: [n] of the Gaussians.
        colors: [n, 3] RGB, display-encoded.
    """

    rows: Rows
    colors: F64

    def first(self, count: int) -> "_Chosen":
        return _Chosen(self.rows[:count], self.colors[:count])


def _ends(plain: list[F32], views: PlainViews) -> tuple[float, float]:
    """OKLab L of views below which pixels are dark, and above which they are light."""
    shown = np.concatenate([one[frame.alpha > SURE] for one, frame in zip(plain, views.frames, strict=True)])
    dark, middle, light = np.quantile(shown, (EXTREMES, 0.5, 1 - EXTREMES)) if shown.size else (0.0, 0.5, 1.0)
    return min(float(dark), float(middle) - LEAST_CONTRAST), max(float(light), float(middle) + LEAST_CONTRAST)


def _pure(
    gaussians: Gaussians, views: PlainViews, lacks: F64, end: tuple[float, float], size: F64, count: int
) -> _Chosen:
    """Gaussians of light, or dark, color where most of it is missing, at most `count`.

    The end is a sign, 1 for lights and -1 for darks, and the limit of their lightness.
    """
    sign, lightness = end
    rows = np.flatnonzero(lacks > 0)
    # The Gaussians with the largest lack, ties by position; further ones would never be chosen.
    rows = rows[np.lexsort((*gaussians.means[rows].T, -lacks[rows]))[: MOST_PLACES * count]]
    lab = _extremes(gaussians.means[rows].astype(np.float64), views, sign)
    are_pure = sign * (lab[:, 0] - lightness) >= 0
    rows, lab = rows[are_pure], lab[are_pure]
    lab[:, 0] = np.clip(lab[:, 0] + PURER * sign, 0, 1)
    chosen = _apart(gaussians.means[rows].astype(np.float64), lacks[rows], size[rows], count)
    return _Chosen(rows[chosen], np.asarray(np.clip(rgb_of_oklab(lab[chosen]), 0, 1)))


def _lacks(
    strokes: Gaussians,
    gaussians: Gaussians,
    views: PlainViews,
    plain: list[F32],
    ends: tuple[float, float],
) -> F64:
    """[N, 2] lack of darks, and of lights, of the painting at Gaussians, OKLab L x pixels."""
    kernel, dab = StrokeTexture.open("gaussian"), StrokeTexture.open("ellipse")
    found, (dark, light) = np.zeros((len(gaussians), 2)), ends
    kernel_options, options = RenderOptions.of(kernel), RenderOptions.of(dab, depth=False)

    def look(index: int) -> tuple[NDArray[np.int32], Array]:
        camera, frame = views.cameras[index], views.frames[index]
        _, painted = draw_with(strokes, camera, dab, options)
        away = plain[index] - oklab_planes(_on_grey(painted))[0]
        covered = np.minimum(frame.alpha, painted.alpha) > OPAQUE  # no lack beside an outline
        missing = np.zeros((*away.shape, 3))
        missing[..., 0] = _missing(-away) * (plain[index] <= dark) * covered
        missing[..., 1] = _missing(away) * (plain[index] >= light) * covered
        boxes, _ = project_with(gaussians, camera, kernel_options)
        return boxes.ids, painted_sums(boxes, kernel, missing, np.zeros_like(frame.alpha))[0][:, :2]

    for ids, sums in view_by_view(look, range(len(views)), len(gaussians)):
        add_rows(found, ids, sums)
    return found


def _on_grey(frame: Frame) -> F32:
    return np.clip(frame.rgb + 0.5 * (1 - frame.alpha[..., None]), 0, 1).astype(np.float32)


def _missing(away: Array) -> F64:
    low, high = LACKS
    return np.asarray(smoothstep((away - low) / (high - low)) * np.maximum(away, 0))


def _length(gaussians: Gaussians, camera: Camera) -> F64:
    """[N] length of an accent at each Gaussian, world units."""
    depths = gaussians.means.astype(np.float64) @ camera.viewmat[2, :3] + camera.viewmat[2, 3]
    pixels = LENGTH * float(np.hypot(camera.width, camera.height))
    return np.asarray(np.maximum(np.abs(depths), camera.near) * pixels / float(camera.K[0, 0]))


def _apart(means: F64, lacks: F64, size: F64, count: int) -> Rows:
    """Positions of the largest lack, apart from each other, at most `count`, largest first."""
    away = np.zeros((len(means), len(means)))
    for column in means.T:
        away += (column[:, None] - column) ** 2
    sums = np.where(away <= size[:, None] ** 2, lacks, 0.0).sum(axis=1)
    free = sums >= LEAST
    chosen: list[int] = []
    for index in np.lexsort((*means.T, -np.round(sums, 5))):
        if free[index] and len(chosen) < count:
            chosen.append(index)
            free &= away[index] > (APART * size[index]) ** 2
    return np.asarray(chosen, np.intp)


def _laid(strokes: Gaussians, means: F64, size: F64, camera: Camera) -> Gaussians:
    """Accents at positions [n, 3], each along the stroke below and in front of all strokes around."""
    others = strokes.means.astype(np.float64)
    near = nearest(others, means, min(BEFORE, len(others)))[1]
    under = strokes.take(near[:, 0])
    half = 0.25 * size  # two standard deviations to each side
    sizes = np.stack([half, half / ASPECT, THICKNESS * half / ASPECT], axis=1)
    scales = np.empty_like(sizes)
    np.put_along_axis(scales, np.argsort(-under.scales, axis=1, kind="stable"), sizes, axis=1)
    to_eye = camera.position - means
    distances = np.maximum(np.linalg.norm(to_eye, axis=1), 1e-12)
    to_eye /= distances[:, None]
    before = np.einsum("nbi,ni->nb", others[near] - means[:, None], to_eye).max(axis=1)
    lift = np.clip(before + half, 0, np.minimum(MOST_LIFT * size, 0.5 * distances))
    dtype = strokes.means.dtype.type
    return replace(
        under,
        means=(means + lift[:, None] * to_eye).astype(dtype),
        scales=scales.astype(dtype),
        opacities=np.full(len(means), OPACITY, dtype),
        sh=np.zeros_like(under.sh),
    )


def _extremes(means: F64, views: PlainViews, sign: float) -> F64:
    """[n, 3] OKLab of the lightest (sign 1) or darkest (-1) pixel of views at positions [n, 3].

    A middle gray if no view shows the position.
    """
    found, best = np.tile([0.5, 0.0, 0.0], (len(means), 1)), np.full(len(means), -np.inf)
    for camera, frame in views.pairs():
        x, y, z = (means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
        depth = np.maximum(z, camera.near)
        columns = np.floor(camera.K[0, 0] * x / depth + camera.K[0, 2])
        lines = np.floor(camera.K[1, 1] * y / depth + camera.K[1, 2])
        inside = (z > camera.near) & (columns >= 0) & (columns < camera.width)
        at = np.flatnonzero(inside & (lines >= 0) & (lines < camera.height))
        alpha = frame.alpha[lines[at].astype(np.intp), columns[at].astype(np.intp)]
        at, alpha = at[alpha > SURE], alpha[alpha > SURE]
        rgb = frame.rgb[lines[at].astype(np.intp), columns[at].astype(np.intp)] / alpha[:, None]
        lab = oklab_of(np.clip(rgb, 0, 1).astype(np.float64))
        better = sign * lab[:, 0] > best[at]
        found[at[better]], best[at[better]] = lab[better], (sign * lab[:, 0])[better]
    return found
