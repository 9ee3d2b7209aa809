"""Cut images of single marks out of a painting.

Regions of about one color are grown from seed places. A region with a closed outline, about as long and wide
as the painting's marks, is a mark that lies on top of others. It is turned and straightened along its axis,
and its coverage follows its color: so bristles stay, and no rectangular edge shows.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.form.planes import ramp
from brushgs.passes.style.averages import averaged, shorter_side
from brushgs.passes.style.outlines import hull_area
from brushgs.passes.style.sizes import Sizes
from brushgs.values.arrays import F32, F64, Mask

MOST_BRUSHES, LEAST_BRUSHES = 8, 3
LONGEST, WIDEST = 128, 64  # texels of a brush image: eight of them take 87 kB as text in a file
NUM_SEEDS = 500  # seed places to try
MOST_WIDTH = 20  # pixels of a mark's width; larger pictures are block-averaged first
TOLERANCES = (0.5, 1.0)  # tolerances of color within one mark, in deviations between marks
LEAST_TOLERANCE, MOST_TOLERANCE = 0.02, 0.10  # OKLab
LENGTHS = (0.5, 1.6)  # accepted lengths, in typical marks: shorter are partly hidden, longer are several
WIDTHS = (0.6, 1.8)
LEAST_PIXELS = 24  # of a mark; smaller ones have no measurable outline
MARGIN = 5  # pixels around a mark, included in its window
LEAST_SCORE = 0.35
SOLID = (0.72, 0.95)  # share of its convex outline that a mark fills: with less it is two marks, or damaged
EDGE, SOFT_EDGE = 0.06, 0.12  # softness of the outline, share of a brush's width
FULL = 0.25  # share of a mark's coverage that does not depend on color: the least between bristles
# Soft marks, where no mark has an outline, as in washes: smoothing in mark widths; then a blob is what
# differs by this many deviations within this many mark lengths.
SOFT, SOFT_TOLERANCES, SOFT_REACH = 0.1, (0.6, 1.0, 1.5), 0.5


@dataclass(frozen=True, eq=False)
class _Mark:
    """One mark of a painting.

    Attributes:
        score: similarity to an ideal mark, 0 to 1.
        center: [2] (x, y), pixels.
        angle: of its axis, radians.
        bend: curvature of its axis, v = bend (u^2 - mean), pixels, u along.
        half: [2] half length and half width, pixels.
        tolerance: of its color.
        distance: [h, w] color distances in its window from the mark's color.
        inside: [h, w] mask of the mark in its window.
        corner: [2] (x, y) of the window's first pixel.
        reach: largest distance of its outline from the axis, pixels.
        edge: softness of its drawn outline, share of its width.
        full: share of its coverage that does not depend on its color.
    """

    score: float
    center: F64
    angle: float
    bend: float
    half: F64
    tolerance: float
    distance: F32
    inside: Mask
    corner: F64
    reach: float
    edge: float
    full: float


def cut_marks(rgb: F32, sizes: Sizes) -> tuple[NDArray[np.uint8], ...]:
    """Cut brush images out of a painting.

    Args:
        rgb: [H, W, 3] a painting, 0 to 1.
        sizes: of its marks.

    Returns:
        3 to 8 brushes [h, w], at most 128 x 64 texels, marks along the rows, best first; none if no marks
        stand out.
    """
    from scipy.ndimage import gaussian_filter

    step = max(1, int(sizes.width * min(rgb.shape[:2]) / MOST_WIDTH))
    lab = oklab_planes(averaged(rgb, -(-max(rgb.shape[:2]) // step)))
    short = shorter_side(lab.shape[1:])
    typical = np.array([sizes.length, sizes.width]) * short
    deviation = np.hypot(sizes.lightness, sizes.chroma)
    rng = np.random.default_rng(0)
    seeds = rng.integers(0, lab.shape[:0:-1], (NUM_SEEDS, 2))
    for is_soft in (False, True):
        found = []
        for share in SOFT_TOLERANCES if is_soft else TOLERANCES:
            tolerance = float(np.clip(share * deviation, LEAST_TOLERANCE, MOST_TOLERANCE))
            search = _Search(lab, typical, tolerance, is_soft, np.zeros(lab.shape[1:], bool))
            marks = (search.grown(x, y) for x, y in seeds.tolist())
            found += [mark for mark in marks if mark is not None and mark.score >= LEAST_SCORE]
        chosen = _most_different(_apart(found))
        if len(chosen) >= LEAST_BRUSHES:
            return tuple(chosen)
        lab = gaussian_filter(lab, (0, SOFT * typical[1], SOFT * typical[1]))
    return ()


@dataclass(frozen=True, eq=False)
class _Search:
    """A search for marks in a picture.

    Attributes:
        lab: [3, H, W] the picture, OKLab.
        typical: [2] length and width of its marks, pixels.
        tolerance: of colors within one mark, OKLab.
        is_soft: whether marks have no outline: a mark is then an area of about one color in an ellipse.
        is_taken: [H, W] mask of the regions already grown.
    """

    lab: F32
    typical: F64
    tolerance: float
    is_soft: bool
    is_taken: Mask

    def grown(self, x: int, y: int) -> _Mark | None:
        """The mark at a place, which is then taken; None if there is none, or the place was taken."""
        return None if self.is_taken[y, x] else _grown(self, x, y)


def _grown(search: _Search, x: int, y: int) -> _Mark | None:
    region = _region(search, x, y)
    if region is None:
        return None
    (inside, distance, corner), typical, tolerance = region, search.typical, search.tolerance
    rows, columns = np.nonzero(inside)
    places = np.stack([columns, rows]).astype(np.float64)
    center = places.mean(axis=1)
    _, axes = np.linalg.eigh(np.cov(places - center[:, None]))
    along = axes[:, 1]
    u = along @ (places - center[:, None])
    v = np.array([-along[1], along[0]]) @ (places - center[:, None])
    middle = 0.5 * (u.max() + u.min())
    center, u = center + middle * along, u - middle
    squares = u**2 - (u**2).mean()
    bend = float((squares * v).sum() / max((squares**2).sum(), 1e-9))
    straight = v - bend * squares
    half = np.array([0.5 * np.ptp(u), np.sqrt(3) * straight.std()])  # half width of an even bar
    half[1] = max(half[1], 0.5)
    ratios = 2 * half / typical
    if not (LENGTHS[0] <= ratios[0] <= LENGTHS[1] and WIDTHS[0] <= ratios[1] <= WIDTHS[1]):
        return None
    solid = float(ramp(np.array(len(u) / hull_area(u, straight)), *SOLID))
    ring = _ring(inside)
    contrast = float(np.mean(distance[ring] > 2 * tolerance)) if ring.any() else 0.0
    typicality = np.exp(-0.5 * (np.log(ratios) ** 2).sum() / 0.4**2)
    score = float(solid * (1.0 if search.is_soft else contrast) * (0.5 + 0.5 * typicality))
    return _Mark(
        score,
        center + corner,
        float(np.arctan2(along[1], along[0])),
        bend,
        half,
        tolerance,
        distance,
        inside,
        corner,
        float(np.abs(straight).max()),
        SOFT_EDGE if search.is_soft else EDGE,
        1.0 if search.is_soft else FULL,
    )


def _region(search: _Search, x: int, y: int) -> tuple[Mask, F32, F64] | None:
    """The region of one color around a place: its mask, color distances, and the corner (x, y) of its window.

    None if it is too small or too large for a mark.
    """
    from scipy.ndimage import binary_fill_holes, label

    typical = search.typical
    reach = int(np.ceil(LENGTHS[1] * typical[0])) + 2
    top, left = max(y - reach, 0), max(x - reach, 0)
    window = search.lab[:, top : y + reach + 1, left : x + reach + 1]
    i, j = y - top, x - left
    color = np.median(window[:, max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2], axis=(1, 2))
    distance = np.sqrt(((window - color[:, None, None]) ** 2).sum(axis=0))
    is_near = distance < search.tolerance
    if search.is_soft:
        across, down = np.arange(window.shape[2]) - j, np.arange(window.shape[1]) - i
        is_near &= across**2 + down[:, None] ** 2 < (SOFT_REACH * typical[0]) ** 2
    labels, _ = label(is_near)
    if labels[i, j] == 0:
        return None
    inside = labels == labels[i, j]
    search.is_taken[top : y + reach + 1, left : x + reach + 1] |= inside
    touches = inside[0].any() or inside[-1].any() or inside[:, 0].any() or inside[:, -1].any()
    count = int(inside.sum())
    if touches or count < max(LEAST_PIXELS, 0.15 * typical.prod()) or count > 2.5 * typical.prod():
        return None
    bounds = tuple(
        slice(max(ends[0] - MARGIN, 0), ends[-1] + MARGIN + 1)
        for ends in (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    )
    corner = np.array([left + bounds[1].start, top + bounds[0].start], np.float64)
    return np.asarray(binary_fill_holes(inside[bounds])), distance[bounds], corner


def _ring(inside: Mask) -> Mask:
    """A ring around a region, two pixels wide, one pixel away from it."""
    from scipy.ndimage import binary_dilation

    near = binary_dilation(inside, iterations=1)
    return np.asarray(binary_dilation(near, iterations=2) & ~near)


def _apart(marks: list[_Mark]) -> list[_Mark]:
    """Marks without overlap: of overlapping ones the best, best first."""
    kept: list[_Mark] = []
    for mark in sorted(marks, key=lambda one: -one.score):
        if all(np.hypot(*(mark.center - other.center)) > other.half[1] for other in kept):
            kept.append(mark)
    return kept[:40]


def _most_different(marks: list[_Mark]) -> list[NDArray[np.uint8]]:
    """The images of a few good marks: the best, then repeatedly the one least similar to those chosen."""
    images = [_straightened(mark) for mark in marks]
    if not images:
        return []
    prints = np.stack([_print(image) for image in images])
    chosen = [0]
    while len(chosen) < min(MOST_BRUSHES, len(images)):
        away = np.linalg.norm(prints[:, None] - prints[chosen], axis=2).min(axis=1)
        worth = away * np.array([mark.score for mark in marks])
        worth[chosen] = -1
        chosen.append(int(worth.argmax()))
    return [images[k] for k in chosen]


def _print(image: NDArray[np.uint8]) -> F64:
    """A thumbnail of a brush [8 x 16] for comparing brushes."""
    from scipy.ndimage import zoom

    small = zoom(image.astype(np.float64) / 255, (8 / image.shape[0], 16 / image.shape[1]), order=1)
    return np.asarray(small[:8, :16]).ravel()


def _straightened(mark: _Mark) -> NDArray[np.uint8]:
    """The coverage of a mark, straightened and turned so that it runs along the rows."""
    from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates

    soft = max(mark.edge * 2 * mark.half[1], 0.5)  # pixels
    half = np.array([mark.half[0], mark.reach]) + 1.5 * soft
    texel = max(half[0] / (LONGEST / 2), half[1] / (WIDEST / 2))  # pixels
    width, height = np.maximum(2, np.rint(2 * half / texel)).astype(int)
    u = (np.arange(width) + 0.5 - width / 2) * texel
    v = (np.arange(height) + 0.5 - height / 2) * texel
    u, v = np.meshgrid(u, v)
    bent = v + mark.bend * (u**2 - mark.half[0] ** 2 / 3)
    x = mark.center[0] + np.cos(mark.angle) * u - np.sin(mark.angle) * bent - mark.corner[0]
    y = mark.center[1] + np.sin(mark.angle) * u + np.cos(mark.angle) * bent - mark.corner[1]
    # Colors and distances are smooth and can be enlarged; an enlarged coverage would show steps.
    color = map_coordinates(mark.distance, [y, x], np.float64, order=3, mode="nearest")
    signed = distance_transform_edt(mark.inside) - distance_transform_edt(~mark.inside)
    outline = map_coordinates(gaussian_filter(signed, 0.7), [y, x], np.float64, order=3, mode="nearest")
    covered = np.clip(0.5 + (outline + 0.5) / (2 * soft), 0, 1)
    paint = np.clip((2.4 * mark.tolerance - color) / (1.4 * mark.tolerance), 0, 1)
    coverage = covered * (mark.full + (1 - mark.full) * paint)
    rows, columns = (np.flatnonzero((coverage > 2 / 255).any(axis=axis)) for axis in (1, 0))
    image = coverage[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return np.asarray(np.rint(255 * image).astype(np.uint8))
