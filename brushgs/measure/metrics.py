"""Measures of moving boxes and of pictures: what flips, spins, pops or flickers.

Everything here judges and nothing paints, so any renderer can be held to it. Where depth, alpha or a
picture is "plain" it is that of the whole scene drawn with the built-in `gaussian` kernel: the nearest
there is to the surface that was captured. Pictures are [H, W, 3], display-encoded, on their background.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array, check
from brushgs.rendering.areas import areas_inside, upright_rectangles
from brushgs.scene import Boxes, Camera

FLIP = np.pi / 2  # a step above this is a flip
SPIN = np.radians(15.0)  # a step above this and up to a flip is a spin
POP = 1.2  # factor of area in one step that is not the ellipse's own
KINK = 0.5  # pixels that a side moves against its ellipse in one step; rounding to whole pixels moves it by 1
INNER = 0.1  # of the smaller side: what reaches further in than this cannot leave by the border in one step
ROUNDING = 1e-5  # of a stroke's length, as float32 columns bring it into the sides
SLENDER = 0.6  # anisotropy from which on a stroke visibly points somewhere
OFF_AXIS = np.radians(10.0)
PLAIN_ALPHA = 0.5  # above this the plain picture shows a surface, and its depth means that surface
DEPTH_TOLERANCE = 0.01  # of the depth: further apart and two views see two surfaces
TINY = np.finfo(np.float64).tiny  # in place of a length of zero
WORST = 0.01  # share of the pixels that the eye goes to


@dataclass(frozen=True)
class Events:
    """What happened to the strokes of a sequence; see `orientation_events` for what each word means.

    Attributes:
        num_steps: pairs of consecutive frames.
        stroke_frames: strokes with a box in both frames of a step, summed over the steps.
        flips: steps of a direction by more than 90 degrees.
        spins: by more than 15 and up to 90 degrees.
        size_pops: changes of area by more than a factor 1.2 that are not the ellipse's own.
        kinks: sides that jumped by more than half a pixel against their ellipse, strokes counted once.
        vanished: strokes that came or went inside the picture, each counted as its opacity.
        flip_share: of the painted area of all stroke-frames that of the flips; so too the following.
        spin_share: see there.
        pop_share: see there.
        kink_share: see there.
        vanished_share: see there.
        largest_step: of a direction, radians, 0 to pi.
    """

    num_steps: int
    stroke_frames: int
    flips: int
    spins: int
    size_pops: int
    kinks: int
    vanished: float
    flip_share: float
    spin_share: float
    pop_share: float
    kink_share: float
    vanished_share: float
    largest_step: float


def orientation_events(
    boxes: Iterable[Boxes], *, width: int, height: int, ellipses: Iterable[Boxes] | None = None
) -> Events:
    """Count what the strokes of a sequence do that a painter's strokes would not.

    A stroke is followed by its id from each frame to the next; only strokes with a box in both count, but
    for `vanished`, and of them only those with an ellipse, if ellipses are given. With d the step of a
    box's direction, wrapped to (-pi, pi]: a *flip* is |d| > 90 degrees, a *spin* 15 < |d| <= 90 degrees.
    The stroke image has a head and a tail, so half a turn is a flip, not nothing.

    Sizes change with the view, and rightly. What is not the view's own is told by the ellipse behind the box
    (`project(..., lock="off")` of the same view and `num_sigmas`):
    - a *size pop*: with q = area of the box / area of the ellipse's own principal box, q changes by more
      than a factor 1.2. This is what a direction that turns against its ellipse does to a box that must
      cover it.
    - a *kink*: the half extent less the reach of the ellipse along the box's own axis changes by more than
      half a pixel (and 1e-5 of the stroke's length, the rounding of float32), on either axis, and by as much
      more or less than in the step before. That difference is 0 for a box that just covers its ellipse,
      whatever the view and the direction do, and grows evenly where a box is widened on purpose; a half
      extent rounded to whole pixels (`whole_pixels`) jumps by one each time that the size passes a whole
      number.

    *Vanished* are strokes with a box in one frame of a step and none in the other whose box reaches into
    the inner part of the picture (a tenth of the smaller side from the border, further than a stroke moves
    in one small step). They count by their opacity: what has faded before is no loss.

    Shares are weighted by painted area, for which stands: area of the box x share of its upright bounding
    rectangle inside the picture x opacity, at most the picture; the mean over the two frames of the step (the
    frame that has it, for `vanished`). They are of the sum of these weights over all stroke-frames.

    Args:
        boxes: the boxes of each frame, in the order of the frames.
        width: of the picture, pixels.
        height: of the picture, pixels.
        ellipses: the principal boxes of the same frames; None if `boxes` are those: nothing can pop then.

    Raises:
        ValueError: if the two sequences differ in length or the size is not positive.
    """
    if width < 1 or height < 1:
        raise ValueError(f"orientation_events: size must be at least 1x1, got {width}x{height}")
    tally = _Tally()
    before: _Sizes | None = None
    for strokes in _follow(boxes, ellipses):
        now = _Sizes(strokes, width, height)
        if before is not None:
            tally.add_step(before, now)
        before = now
    return tally.events()


def off_axis_share(boxes: Iterable[Boxes], ellipses: Iterable[Boxes]) -> float:
    """Share of slender strokes along neither axis of their ellipse: their directions merely stand still.

    Slender is an anisotropy (l1 - l2)/(l1 + l2) above 0.6, l1 and l2 the squared half extents of the
    principal box (so an aspect above 2); off axis is a direction more than 10 degrees from both axes,
    modulo half a turn.

    Args:
        boxes: the boxes of each frame.
        ellipses: `project(..., lock="off")` of the same frames, matched by id.

    Returns:
        Stroke-frames off both axes over slender stroke-frames, 0 if there are none.

    Raises:
        ValueError: as `orientation_events`.
    """
    num_slender = num_off = 0
    for strokes in _follow(boxes, ellipses):
        squares = strokes.principal_extents**2
        is_slender = np.abs(squares[:, 0] - squares[:, 1]) > SLENDER * squares.sum(axis=1)
        turn = np.remainder(strokes.angles - strokes.principal_angles, np.pi / 2)
        is_off = np.minimum(turn, np.pi / 2 - turn) > OFF_AXIS
        num_slender += int(np.count_nonzero(is_slender))
        num_off += int(np.count_nonzero(is_slender & is_off))
    return num_off / max(1, num_slender)


def covers_ellipse(boxes: Iterable[Boxes], ellipses: Iterable[Boxes]) -> float:
    """How far the worst box falls short of its ellipse, as a share of the reach it should have.

    0 or less: every box contains its ellipse (rounding of float32 columns leaves about 1e-6).

    Args:
        boxes: the boxes of each frame.
        ellipses: `project(..., lock="off")` of the same frames and `num_sigmas`, matched by id.

    Raises:
        ValueError: as `orientation_events`.
    """
    worst = -np.inf
    for strokes in _follow(boxes, ellipses):
        if len(strokes.ids):
            worst = max(worst, float((1 - strokes.extents / np.maximum(strokes.reach(), TINY)).max()))
    return worst if np.isfinite(worst) else 0.0


def whole_pixels(boxes: Boxes) -> Boxes:
    """The boxes with half extents rounded up to whole pixels, as the published method draws them."""
    return replace(boxes, half_extents=np.ceil(boxes.half_extents))


@dataclass(frozen=True, eq=False)
class View:
    """A picture, and what is known of the surface behind each of its pixels.

    Attributes:
        rgb: [H, W, 3] the picture to judge, on its background.
        depth: [H, W] camera z of the plain render, world units.
        alpha: [H, W] of the plain render, 0 to 1.
        camera: both were seen with.

    Raises:
        ValueError: if a shape does not fit the camera's size.
    """

    rgb: Array  # [H, W, 3]
    depth: Array  # [H, W]
    alpha: Array  # [H, W]
    camera: Camera

    def __post_init__(self) -> None:
        size = f"{self.camera.height} {self.camera.width}"
        check("View", rgb=(self.rgb, f"{size} 3"), depth=(self.depth, size), alpha=(self.alpha, size))


@dataclass(frozen=True, eq=False)
class WarpError:
    """How far a picture is from another one moved to its view by exact depth and pose.

    Attributes:
        rmse: root of the mean squared error over valid pixels and channels, 0 to 1.
        worst_1pct: the same over the 1 % of valid pixels (at least one) of largest error.
        valid_share: valid pixels over all pixels of the second view.
        squared_error: [H, W] float32 mean over the channels, NaN where not valid; None if not asked for.
    """

    rmse: float
    worst_1pct: float
    valid_share: float
    squared_error: NDArray[np.float32] | None = None


def warp_error(first: View, second: View, *, keep_map: bool = False) -> WarpError:
    """Flicker between two views: the second picture against the first one, moved to the second view.

    The centre of each pixel of the second view is taken into space by the second plain depth and seen by the
    first camera; there the first picture is read bilinearly. A pixel is valid if
    - the plain alpha is above 0.5 there and at all four pixels of the first view that are read,
    - these four lie inside the first picture,
    - the point is not hidden in the first view: the plain depth of each of the four differs from the
      point's own by at most 1 % of it.
    So outlines and what one view alone sees are left out, and paint that spills over an outline is not
    judged. Bilinear reading blurs, so also the plain render has an error above zero; what strokes add is
    their error less the plain render's own, the "excess flicker": `warp_error(...).rmse` of the painting
    less that of the plain render over the same pair of views (of each pair first, then the mean over a
    sequence). At gap g of a sequence the pairs are the frames (k, k + g). Source: Lai et al. 2018 (warping
    error), with exact depth and pose in place of estimated optical flow.

    Args:
        first: the earlier view.
        second: the later view, of any size.
        keep_map: whether the error of each pixel is handed back.

    Two paintings of one pair of views share all but the reading: see `match_views`.
    """
    match = match_views(first, second)
    return match.error(first.rgb, second.rgb, keep_map=keep_map)


@dataclass(frozen=True, eq=False)
class ViewMatch:
    """Where each valid pixel of a second view lies in a first one; made by `match_views`.

    Attributes:
        first_size: (height, width) of the first picture.
        second_size: (height, width) of the second picture.
        pixels: [n] valid pixels of the second view, flat.
        corners: [n] upper left of the four pixels of the first view, flat.
        shares: [n, 2] of the right and of the lower pixels, 0 to 1.
    """

    first_size: tuple[int, int]
    second_size: tuple[int, int]
    pixels: NDArray[np.int64]  # [n]
    corners: NDArray[np.int64]  # [n]
    shares: NDArray[np.float32]  # [n, 2]

    def moved(self, first: Array) -> Array:
        """[n, 3] the first picture as the valid pixels of the second view should see it."""
        check("moved", first=(first, f"{self.first_size[0]} {self.first_size[1]} 3"))
        colors, width = first.reshape(-1, 3), self.first_size[1]
        right, down = self.shares[:, :1], self.shares[:, 1:]
        above, above_right, below, below_right = (
            colors.take(self.corners + offset, axis=0) for offset in (0, 1, width, width + 1)
        )
        above += (above_right - above) * right
        below += (below_right - below) * right
        return np.asarray(above + (below - above) * down)

    def error(self, first: Array, second: Array, *, keep_map: bool = False) -> WarpError:
        """See `warp_error`: the same of any two pictures [H, W, 3] of these views."""
        height, width = self.second_size
        check("error", second=(second, f"{height} {width} 3"))
        difference = self.moved(first) - second.reshape(-1, 3).take(self.pixels, axis=0)
        squares = np.einsum("pc,pc->p", difference, difference) / 3
        num_worst = max(1, round(WORST * len(squares))) if len(squares) else 0
        worst = np.partition(squares, len(squares) - num_worst)[len(squares) - num_worst :]
        error_map = None
        if keep_map:
            error_map = np.full((height, width), np.nan, np.float32)
            error_map.reshape(-1)[self.pixels] = squares
        rmse, worst_rmse = (
            float(np.sqrt(s.mean(dtype=np.float64))) if len(s) else 0.0 for s in (squares, worst)
        )
        return WarpError(rmse, worst_rmse, len(squares) / (height * width), error_map)


def match_views(first: View, second: View) -> ViewMatch:
    """Find the valid pixels of a pair of views, by plain depth and alpha alone: see `warp_error`."""
    height, width = first.depth.shape
    pixels = np.flatnonzero((second.alpha > PLAIN_ALPHA) & (second.depth > 0))
    x, y, z = _points_in(first.camera, second.camera, pixels, second.depth.reshape(-1)[pixels])
    is_inside = (z > 0) & (x >= 0) & (x < width - 1) & (y >= 0) & (y < height - 1)
    pixels, x, y, z = pixels[is_inside], x[is_inside], y[is_inside], z[is_inside]
    left, top = x.astype(np.int64), y.astype(np.int64)
    corners = top * width + left
    # An unpainted pixel has a depth that agrees with none.
    depth = np.where(first.alpha > PLAIN_ALPHA, first.depth, -np.inf).reshape(-1)
    is_seen = np.ones(len(z), np.bool_)
    for offset in (0, 1, width, width + 1):
        is_seen &= np.abs(depth[corners + offset] - z) <= DEPTH_TOLERANCE * z
    shares = np.stack([x - left, y - top], axis=1)[is_seen].astype(np.float32)
    second_size = second.depth.shape[0], second.depth.shape[1]
    return ViewMatch((height, width), second_size, pixels[is_seen], corners[is_seen], shares)


def _points_in(
    first: Camera, second: Camera, pixels: NDArray[np.int64], depths: Array
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Pixels of the second camera at their depths as the first sees them.

    Returns:
        [n] x, [n] y in pixels with centres at whole numbers, and [n] camera z; x and y mean nothing where
        z <= 0.
    """
    move = first.viewmat @ np.linalg.inv(second.viewmat)
    per_pixel, shift = first.K @ move[:3, :3] @ np.linalg.inv(second.K), first.K @ move[:3, 3]
    rows, columns = np.divmod(pixels, second.width)
    x, y, z = (
        (a * (columns + 0.5) + b * (rows + 0.5) + c) * depths + d
        for (a, b, c), d in zip(per_pixel, shift, strict=True)
    )
    inverse = 1 / np.where(z > 0, z, 1.0)
    return x * inverse - 0.5, y * inverse - 0.5, z


class _Strokes(NamedTuple):
    """The boxes of one frame beside the ellipses they must cover, float64, by ascending id."""

    ids: NDArray[np.int32]  # [M]
    centers: NDArray[np.float64]  # [M, 2]
    extents: NDArray[np.float64]  # [M, 2]
    angles: NDArray[np.float64]  # [M]
    opacities: NDArray[np.float64]  # [M]
    principal_extents: NDArray[np.float64]  # [M, 2]
    principal_angles: NDArray[np.float64]  # [M]

    def reach(self) -> NDArray[np.float64]:
        """[M, 2] half extents of the smallest box around the ellipse along the box's own axes."""
        turn = self.angles - self.principal_angles
        along, across = np.cos(turn)[:, None], np.sin(turn)[:, None]
        a, b = self.principal_extents[:, :1], self.principal_extents[:, 1:]
        u, v = np.hypot(along * a, across * b), np.hypot(across * a, along * b)
        return np.concatenate([u, v], axis=1)


def _follow(boxes: Iterable[Boxes], ellipses: Iterable[Boxes] | None) -> Iterator[_Strokes]:
    """Each frame's boxes with the ellipses of the same ids.

    A box whose ellipse has no box of its own is left out: it reaches into the picture with a corner only.
    """
    pairs = ((b, b) for b in boxes) if ellipses is None else zip(boxes, ellipses, strict=True)
    for box, ellipse in pairs:
        ids, i, j = np.intersect1d(box.ids, ellipse.ids, assume_unique=True, return_indices=True)
        columns = box.centers[i], box.half_extents[i], box.angles[i], box.opacities[i]
        principal = ellipse.half_extents[j], ellipse.angles[j]
        yield _Strokes(ids, *(column.astype(np.float64) for column in (*columns, *principal)))


class _Sizes:
    """What `orientation_events` compares between two frames."""

    def __init__(self, strokes: _Strokes, width: int, height: int) -> None:
        self.ids, self.angles, self.opacities = strokes.ids, strokes.angles, strokes.opacities
        extents, principal = (
            np.maximum(sides, TINY) for sides in (strokes.extents, strokes.principal_extents)
        )
        self.log_excess = np.log(extents).sum(axis=1) - np.log(principal).sum(axis=1)
        self.lengths = principal.max(axis=1)
        self.spare_steps = np.zeros_like(extents)  # of `spare`, since the frame before
        self.spare = strokes.extents - strokes.reach()
        low, high = upright_rectangles(strokes.centers, extents, self.angles)
        self.weights = areas_inside(extents, low, high, width, height) * self.opacities
        inset, size = INNER * min(width, height), np.array([width, height], np.float64)
        self.is_inner: NDArray[np.bool_] = np.all((high > inset) & (low < size - inset), axis=1)


class _Tally:
    """Running sums of `Events`."""

    def __init__(self) -> None:
        self.num_steps = self.stroke_frames = 0
        self.counts = np.zeros(4, np.int64)  # flips, spins, size pops, kinks
        self.areas = np.zeros(4)
        self.area = self.vanished = self.vanished_area = self.largest = 0.0

    def add_step(self, before: _Sizes, now: _Sizes) -> None:
        _, i, j = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
        step = np.abs(np.remainder(now.angles[j] - before.angles[i] + np.pi, 2 * np.pi) - np.pi)
        spare_steps = now.spare[j] - before.spare[i]
        jumps = np.minimum(np.abs(spare_steps), np.abs(spare_steps - before.spare_steps[i])).max(axis=1)
        now.spare_steps[j] = spare_steps
        lengths = np.maximum(before.lengths[i], now.lengths[j])
        happened = np.stack(
            [
                step > FLIP,
                (step > SPIN) & (step <= FLIP),
                np.abs(now.log_excess[j] - before.log_excess[i]) > np.log(POP),
                jumps > KINK + ROUNDING * lengths,
            ]
        )
        weights = 0.5 * (before.weights[i] + now.weights[j])
        self.num_steps += 1
        self.stroke_frames += len(i)
        self.area += float(weights.sum())
        self.counts += np.count_nonzero(happened, axis=1)
        self.areas += happened @ weights
        self.largest = max(self.largest, float(step.max(initial=0)))
        for strokes, rows in ((before, i), (now, j)):
            is_alone = strokes.is_inner.copy()
            is_alone[rows] = False
            self.vanished += float(strokes.opacities[is_alone].sum())
            self.vanished_area += float(strokes.weights[is_alone].sum())

    def events(self) -> Events:
        area = self.area or 1.0
        flips, spins, size_pops, kinks = self.counts.tolist()
        flip_share, spin_share, pop_share, kink_share = (self.areas / area).tolist()
        return Events(
            num_steps=self.num_steps,
            stroke_frames=self.stroke_frames,
            flips=flips,
            spins=spins,
            size_pops=size_pops,
            kinks=kinks,
            vanished=self.vanished,
            flip_share=flip_share,
            spin_share=spin_share,
            pop_share=pop_share,
            kink_share=kink_share,
            vanished_share=self.vanished_area / area,
            largest_step=self.largest,
        )
