"""Subject, up and front of a scene in NumPy, from pictures by the public renderer."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from brushgs.cameras.framing import AXES, camera_axes
from brushgs.first_view.sample import Painter, gradients, thin
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import C0, base_colors

TAIL, FAR, MOST_CUTS = 0.007, 50.0, 16
SIDE, DISTANCE, FILLED = 96, 4.0, 0.95
TIP, MAX_OBJECT_SPAN, SUBJECT_REACH, MAX_POINTS = 0.15, 3.5, 0.9, 20_000


def camera_around(center, radius, axes, side=SIDE):
    """A square picture of the sphere around a sample; `axes` [3, 3]: rows right, down, forward."""
    viewmat = np.eye(4)
    viewmat[:3, :3] = axes
    viewmat[:3, 3] = -axes @ (center - DISTANCE * radius * axes[2])
    focal = FILLED * 0.5 * side * DISTANCE
    K = np.array([[focal, 0, 0.5 * side], [0, focal, 0.5 * side], [0, 0, 1.0]])
    return Camera(viewmat, K, side, side, near=0.02 * radius)


def heaviest_clump(means, weights, sample=slice(None)):
    """Mask [N] of the heaviest clump; None if there is only one, apart from strays."""
    points, masses = means[sample].astype(np.float64), weights[sample].astype(np.float64)
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for _ in range(MOST_CUTS):
        inside = ((points >= low) & (points <= high)).all(axis=1)
        gaps = [_gap_of(points[inside, axis], masses[inside]) for axis in range(3)]
        axis = int(np.argmax([gap[0] for gap in gaps]))
        share, at, is_upper = gaps[axis]
        if share <= FAR:
            break
        (low if is_upper else high)[axis] = at
    if np.isinf(low).all() and np.isinf(high).all():
        return None
    return np.asarray(((means >= low) & (means <= high)).all(axis=1))


def _gap_of(places, weights):
    """The widest gap between points on a line, strays left out."""
    order = np.argsort(places, kind="stable")
    mass = np.cumsum(weights[order])
    if len(order) < 2 or not mass[-1] > 0:
        return 0.0, 0.0, False
    first, last = np.searchsorted(mass, mass[-1] * np.array([TAIL, 1 - TAIL]))
    sorted_places = places[order][first : last + 1]
    if len(sorted_places) < 2:
        return 0.0, 0.0, False
    widths = np.diff(sorted_places)
    widest = int(np.argmax(widths))
    rest = (sorted_places[-1] - sorted_places[0]) - widths[widest]
    middle = 0.5 * (sorted_places[widest] + sorted_places[widest + 1])
    share = float(np.divide(widths[widest], rest)) if rest > 0 else 0.0
    return share, float(middle), bool(mass[first + widest] < 0.5 * mass[-1])


def subject(gaussians, *, is_whole=False):
    """Find the subject of a scene, in its heaviest clump."""
    means, weights = _sample(gaussians)
    clump = heaviest_clump(means, weights)
    if clump is not None:
        means, weights = means[clump], weights[clump]
    at = (TAIL, 0.25, 0.5, 0.75, 1 - TAIL)
    low, q1, median, q3, high = np.transpose([weighted_quantiles(column, weights, at) for column in means.T])
    unit = (q3 - q1).max()
    has_surroundings = not is_whole and bool((high - low).max() > MAX_OBJECT_SPAN * unit > 0)
    if has_surroundings:
        low = np.maximum(low, median - SUBJECT_REACH * unit)
        high = np.minimum(high, median + SUBJECT_REACH * unit)
    else:
        low, high = low - TIP * unit, high + TIP * unit
    inside = ((means >= low) & (means <= high)).all(axis=1) & (weights > 0)
    return means[inside] if inside.any() else means, has_surroundings


def _sample(gaussians):
    """[n, 3] centers and [n] weights of at most `MAX_POINTS` Gaussians; the weights are not all 0."""
    every = slice(None, None, -(-len(gaussians) // MAX_POINTS))
    means = gaussians.means[every].astype(np.float64)
    weights = gaussians.opacities[every].astype(np.float64)
    return means, weights if weights.any() else np.ones(len(means))


def weighted_quantiles(values, weights, at: tuple[float, ...]):
    """Weighted quantiles of `values` at the given shares of the weight."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    rows = np.searchsorted(total, np.asarray(at) * total[-1])
    return [float(v) for v in values[order][np.minimum(rows, len(values) - 1)]]


MOST_ROWS, SIDE, FAINTEST = 30_000, 96, 0.02
FINEST, COARSEST, CLIPPED = 1e-4, 0.3, 0.999


@dataclass(frozen=True, eq=False)
class Sample:
    """The subject of a scene, thinned.

    Attributes:
        places: [n, 3] centers relative to the middle, in radii.
        weights: [n] painted area, opacity x area, without the extremes.
        shades_of_size: [n] 0 to 1: logarithm of the size of each Gaussian between `FINEST` and `COARSEST`.
    """

    gaussians: Gaussians
    num_rows: int
    center: np.ndarray
    radius: float
    places: np.ndarray
    weights: np.ndarray
    shades_of_size: np.ndarray

    def camera(self, axes, side=SIDE):
        """A picture of the whole sample, see `camera_around`."""
        return camera_around(self.center, self.radius, axes, side)


def take_sample(gaussians):
    """The sample of N >= 1 Gaussians; None if nothing with extent is visible."""
    points, _ = subject(gaussians)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = 0.5 * float(np.linalg.norm(high - low))
    seen = (gaussians.opacities > FAINTEST) & (gaussians.scales.max(axis=1) < radius)
    rows = np.flatnonzero(seen & ((gaussians.means >= low) & (gaussians.means <= high)).all(axis=1))
    if not radius > 0 or len(rows) == 0:
        return None
    kept, center = thin(gaussians, rows, MOST_ROWS), 0.5 * (low + high)
    growth = np.sqrt(len(rows) / len(kept))  # of scales, from thinning
    scales = np.sort(kept.scales.astype(np.float64), axis=1) / (radius * growth)
    areas, places = scales[:, 1] * scales[:, 2], (kept.means - center) / radius
    sizes = np.log(np.sqrt(np.maximum(areas, FINEST**2)) / FINEST) / np.log(COARSEST / FINEST)
    weights = clipped(kept.opacities * areas, CLIPPED)
    return Sample(kept, len(rows), center, radius, places, weights, np.clip(sizes, 0, 1))


def thinned(count, most):
    """At most `most` of `count` row numbers, ascending: one per equal part."""
    if count <= most:
        return np.arange(count)
    within = np.random.default_rng(0).random(most)
    return np.asarray(((np.arange(most) + within) * (count / most)).astype(np.intp))


def shaded(gaussians, *shades):
    """The same Gaussians with up to three shades [n], 0 to 1, in place of red, green and blue."""
    sh = np.zeros((len(gaussians), 1, 3), gaussians.means.dtype)
    for channel, shade in enumerate(shades):
        sh[:, 0, channel] = (shade - 0.5) / C0
    return replace(gaussians, sh=sh)


def flat_colors(gaussians):
    """[n, 3] view-independent colors of boxes of degree 0, rounded as by `project`."""
    return np.asarray(np.maximum(C0 * gaussians.sh[:, 0] + 0.5, 0))


def clipped(values, quantile):
    """The values with all above a quantile set to it."""
    return np.asarray(np.minimum(values, np.quantile(values, quantile)))


def unpremultiplied(frame):
    """[H, W, 3] colors with straight alpha, 0 to 1."""
    return np.asarray(np.clip(frame.rgb / np.maximum(frame.alpha, 1e-3)[..., None], 0, 1))


FOOT, LOWEST, FLAT, LEVEL = 0.1, 0.04, 2.0, np.cos(np.radians(20.0))
SEEN = 0.5
# Axes, edges and corners of a cube: 26.
DIRECTIONS = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], dtype=np.float64)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
KINDS = ("size", "size_at_pole", "edges", "edges_at_pole", "foot", "low_mass", "low_ground")


def measure_up(sample):
    """The [6] values of each kind of evidence, for each of `AXES`."""
    edges, sizes = _look_over(sample)
    places, weights = sample.places, sample.weights
    normals, flat = _normals(sample)
    values: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for up in np.eye(3):
        height = DIRECTIONS @ up
        above, below = height > 0.1, height < -0.1
        top, bottom = height > 0.99, height < -0.99
        values["size"].append(sizes[above].mean() - sizes[below].mean())
        values["size_at_pole"].append(sizes[top].mean() - sizes[bottom].mean())
        values["edges"].append(edges[above].mean() - edges[below].mean())
        values["edges_at_pole"].append(edges[top].mean() - edges[bottom].mean())
        level, heights = places[:, up == 0], places @ up
        low, high = weighted_quantiles(heights, weights, (0.01, 0.99))
        values["foot"].append(_foot(heights, level, low, high))
        shares = np.clip((heights - low) / ((high - low) or 1.0), 0, 1)
        values["low_mass"].append(0.5 - float(shares @ weights) / (weights.sum() or 1.0))
        is_level = np.abs(normals @ up) > LEVEL
        values["low_ground"].append(_lower_share(shares, flat * is_level, float(flat.sum())))
    # Opposite axes have negated values, except stability.
    evidence = {kind: np.array([*column, *np.negative(column)]) for kind, column in values.items()}
    ups = np.array(list(AXES.values()))
    stable = [_stability(places @ up, places[:, up == 0], weights) for up in ups]
    return evidence | {"stable": np.array(stable)}


def _look_over(sample):
    """Edges per pixel and mean shade of size of pictures from `DIRECTIONS`."""
    paint = Painter()
    shades = base_colors(sample.gaussians.sh) @ LUMINANCE
    gaussians = shaded(sample.gaussians, shades, sample.shades_of_size)

    def look(direction):
        frame = paint(gaussians, sample.camera(_axes_toward(-direction)))
        shown, mask = unpremultiplied(frame), frame.alpha > SEEN
        if not mask.any():
            return 0.0, 0.0
        edges = gradients(shown[..., 0], mask).sum(dtype=np.float64) / mask.sum()
        return float(edges), float(shown[..., 1][mask].mean(dtype=np.float64))

    edges, sizes = np.array([look(direction) for direction in DIRECTIONS]).T
    return edges, sizes


def _axes_toward(forward):
    """[3, 3] rows right, down, forward of a view in a direction, with arbitrary roll."""
    right = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def _stability(heights, level, weights):
    """Distance of the center of mass inside the box of the lowest points, in widths of the sample."""
    lowest = level[heights <= np.quantile(heights, LOWEST)]
    low, high = np.quantile(lowest, (0.05, 0.95), axis=0)
    center = (level * weights[:, None]).sum(axis=0) / (weights.sum() or 1.0)
    widths = np.ptp(level, axis=0)
    widths = np.maximum(widths, 1e-6 * widths.max() or 1.0)
    return float((np.minimum(center - low, high - center) / widths).min())


def _foot(heights, level, low, high):
    """Footprint of the lowest tenth minus that of the highest, over the whole footprint."""
    part = FOOT * (high - low)
    whole = _footprint(level) or 1.0
    lowest, highest = level[heights < low + part], level[heights > high - part]
    return (_footprint(lowest) - _footprint(highest)) / whole


def _normals(sample):
    """[n, 3] normals of either sign, and [n] painted area, 0 for Gaussians that are not flat."""
    gaussians = sample.gaussians
    scales = np.sort(gaussians.scales, axis=1)
    is_flat = scales[:, 1] > FLAT * scales[:, 0]
    return shortest_axes(gaussians.quats, gaussians.scales), np.asarray(sample.weights * is_flat)


def _lower_share(shares, weights, whole):
    """Weight of the lowest third of the height minus that of the highest, over the whole weight."""
    lower, higher = weights[shares < 1 / 3].sum(), weights[shares > 2 / 3].sum()
    return float(lower - higher) / (whole or 1.0)


def _footprint(level):
    """Area of the box with 90 % of the points along each axis; 0 for very few points."""
    if len(level) < 10:
        return 0.0
    low, high = np.quantile(level, (0.05, 0.95), axis=0)
    return float(np.prod(high - low))


NUM_VIEWS = 16  # around the subject
VIEW_SIDE = 112  # pixels
VIEW_ELEVATION = np.radians(12.0)
OPAQUE = 0.3  # alpha from which its depth is a surface; below, nothing is hidden
NEIGHBOUR = 3  # pixel distance for coarse contrast: shapes, not noise
COLORS = 8  # steps per channel, for entropy
SOLID = 0.2  # opacity from which a Gaussian should be visible
SKIN = 0.04  # radii behind the visible surface that still count as visible
WEIGHTS = np.array([1.0, 1.0, 1.0, 2.0])  # of fineness, colors, contrast and visible share
NARROW, WIDE = 8.0, 2.0  # concentrations of the smoothing over azimuths: 20 and 40 degrees
SYMMETRIC = 1.08  # best over median likeness; below, there is no mirror plane and detail decides alone
ONE_SIDED = np.log(2.0)  # log ratio of visible shares of opposite views: a capture from one side
MARGIN = 0.9  # of the scores of both ends; below, the end nearer to azimuth 0 is taken
LEAST_SHARE = 0.005  # added to visible shares before they are compared
ALONG = 0.7  # least visible share of the ends, over the best: else the capture is not along the axis
FINE = np.radians(np.arange(0.0, 360.0, 7.5))  # candidate azimuths without an axis
BESIDE = np.radians(30.0)  # from the front, for comparing the two sides
LEAN = np.radians(20.0)  # turn of first views from the front to the more detailed side


AZIMUTHS = 2 * np.pi * np.arange(NUM_VIEWS) / NUM_VIEWS


def _near(values, azimuth, concentration=NARROW):
    """The mean of values [NUM_VIEWS] of the views around, near an azimuth."""
    kernel = np.exp(concentration * (np.cos(AZIMUTHS - azimuth) - 1))
    return float(kernel / kernel.sum() @ values)


def find_front(sample, up):
    """The front of a subject that stands upright along `up` [3]."""
    scores, shares = _look_around(sample, up)
    level = camera_axes(up, 0.0, 0.0)
    likeness = mirror_likeness(sample.places @ level.T, sample.weights)
    axis = np.pi * int(likeness.argmax()) / NUM_PLANES
    strength = float(likeness.max() / max(np.median(likeness), 1e-9))
    azimuth, margin = _side(scores, shares, axis, strength)
    more, less = (_near(scores, azimuth + sign * BESIDE) for sign in (1, -1))
    return wrapped(azimuth), float(LEAN if more >= less else -LEAN), margin, strength


def _side(scores, shares, axis, strength):
    """The azimuth of the front and its margin, for the axis of a mirror plane of some strength."""
    difference = _near(scores, axis) - _near(scores, axis + np.pi)
    azimuth, margin = (axis if difference > 0 else axis + np.pi), abs(difference)
    if strength < SYMMETRIC:
        azimuth = float(FINE[np.argmax([_near(scores, fine, WIDE) for fine in FINE])])
    ends = np.array([_near(shares, axis), _near(shares, axis + np.pi)])
    one_sided = float(np.diff(np.log(ends[::-1] + LEAST_SHARE))[0])
    if abs(one_sided) >= ONE_SIDED:
        azimuth, margin = (axis if one_sided > 0 else axis + np.pi), max(margin, 1.0)
        smoothed = [_near(shares, view) for view in AZIMUTHS]
        if ends.max() < ALONG * max(smoothed):
            azimuth = float(AZIMUTHS[np.argmax(smoothed)])
    if margin < MARGIN and np.cos(azimuth) < -0.2:  # beyond 100 degrees from azimuth 0
        azimuth += np.pi
    return float(azimuth), float(margin)


def wrapped(angle):
    """The same angle in -pi to pi."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _look_around(sample, up):
    """Score views around the subject by fineness, color entropy, contrast and visible share."""
    paint_depth, paint = Painter(depth=True), Painter()
    sizes = flat_colors(shaded(sample.gaussians, sample.shades_of_size))

    def look(azimuth):
        camera = sample.camera(camera_axes(up, azimuth, VIEW_ELEVATION), VIEW_SIDE)
        boxes = paint.boxes(sample.gaussians, camera)
        frame = paint_depth.frame(boxes, camera)
        mask = frame.alpha > SEEN
        if not mask.any():
            return 0.0, 0.0, 0.0, 0.0
        colors = unpremultiplied(frame)
        shade = unpremultiplied(paint.frame(replace(boxes, colors=sizes[boxes.ids]), camera))[..., 0]
        fineness, contrast = -shade[mask].mean(dtype=np.float64), _coarse_contrast(colors @ LUMINANCE, mask)
        return fineness, _entropy(colors[mask]), contrast, _visible_share(sample, camera, frame)

    values = np.array([look(azimuth) for azimuth in AZIMUTHS])
    scores = (values - values.mean(axis=0)) / np.maximum(values.std(axis=0), 1e-9)
    return scores @ WEIGHTS / WEIGHTS.sum(), values[:, -1]


def _entropy(colors):
    """Entropy of colors [n, 3], bits."""
    red, green, blue = (np.clip(colors, 0, 0.999) * COLORS).astype(np.int64).T
    counts = np.bincount((red * COLORS + green) * COLORS + blue)
    shares = counts[counts > 0] / len(colors)
    return float(-(shares * np.log2(shares)).sum())


def _coarse_contrast(shades, mask):
    """Mean difference of pixels `NEIGHBOUR` apart, away from the outline."""
    within = mask.copy()
    for step in (-2, -1, 1, 2):
        within &= np.roll(mask, step, axis=0) & np.roll(mask, step, axis=1)
    difference = sum(np.abs(shades - np.roll(shades, NEIGHBOUR, axis=axis)) for axis in (0, 1))
    return float((difference * within).sum() / max(within.sum(), 1))


def _visible_share(sample, camera, frame):
    """Share of solid Gaussians that are not behind the visible surface."""
    assert frame.depth is not None
    places = sample.gaussians.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    depths = places[:, 2]  # all in front of the camera, which is outside the sample
    x = (camera.K[0, 0] * places[:, 0] / depths + camera.K[0, 2]).astype(np.int64)
    y = (camera.K[1, 1] * places[:, 1] / depths + camera.K[1, 2]).astype(np.int64)
    surface = np.where(frame.alpha > OPAQUE, frame.depth, np.inf)
    is_solid = sample.gaussians.opacities > SOLID
    inside = (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
    shown = surface[np.clip(y, 0, camera.height - 1), np.clip(x, 0, camera.width - 1)]
    is_visible = is_solid & inside & (depths <= shown + SKIN * sample.radius)
    return float(is_visible.sum() / max(is_solid.sum(), 1))


NUM_PLANES = 32  # over half a turn
BINS = 28  # voxels along a side of the cube of two radii
SHIFTS = (-0.06, -0.03, 0.0, 0.03, 0.06)  # of the plane from the center of mass, radii
MOST_POINTS = 30_000
LARGEST = 0.98  # quantile at which weights are clipped


def mirror_likeness(places, weights):
    """Overlap of the subject with its mirror image, for planes through the vertical axis."""
    rows = thinned(len(places), MOST_POINTS)
    places, weights = places[rows], clipped(weights[rows], LARGEST)
    if not weights.sum() > 0:
        return np.ones(NUM_PLANES)
    level = places[:, (0, 2)]
    level = level - (level * weights[:, None]).sum(axis=0) / weights.sum()
    heights = _bins(places[:, 1])
    likeness = np.zeros(NUM_PLANES)
    for plane in range(NUM_PLANES):
        angle = np.pi * plane / NUM_PLANES
        across = level @ np.array([np.cos(angle), np.sin(angle)])
        along = _bins(level @ np.array([np.sin(angle), -np.cos(angle)]))
        for shift in SHIFTS:
            cells = (_bins(across - shift) * BINS + along) * BINS + heights
            held = np.bincount(cells, weights=weights, minlength=BINS**3).reshape(BINS, -1)
            held = np.sqrt(held)
            likeness[plane] = max(likeness[plane], np.minimum(held, held[::-1]).sum() / held.sum())
    return likeness


def _bins(coordinates):
    """Voxel index of coordinates in -1 to 1."""
    return np.asarray(np.clip(((coordinates + 1) * BINS / 2).astype(np.int64), 0, BINS - 1))
