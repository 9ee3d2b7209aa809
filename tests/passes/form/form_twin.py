"""Strokes turned along the form in NumPy: what `brushgs.passes.form.neighborhood` has from the core."""

from dataclasses import replace

import numpy as np

from brushgs.passes.color.color_space import Space
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.planes import Planes, ramp, unit_pairs
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.quats import quats_of
from brushgs.values.sh import base_colors

ASPECT = 2.2
OWN, SLENDER, OWN_COUNTS = (1.1, ASPECT), (4.0, 6.0), (1.1, 1.6)
SURE, UNSURE, ROUNDING = 0.3, 0.05, 1e-9
HEADING = np.array([0.61, 0.53, 0.59])
OWN_AXIS, COLOR, CURVATURE, LONG = 2.4, 1.0, 0.4, 0.4  # weights
NUM_AROUND, ROUNDS, COLOR_SPREAD, HALF_BEND = 10, 4, 0.03, 0.03
NUM_NEAR, SURFACE, FARTHEST, HALF_STEP, FLATNESS = 20, 0.6, 1e6, 0.03, 0.02
IS_LONG, LEAST_SPREAD = (0.5, 0.9), 1e-12


class Neighborhood:
    def __init__(self, strokes):
        self.strokes, self.planes = strokes, Planes.of(strokes)
        planes, count = self.planes, min(NUM_AROUND + 1, len(strokes))
        _, found = nearest(planes.means, planes.means, count)
        is_other = found != np.arange(len(found))[:, None]
        is_other[is_other.all(axis=1), -1] = False  # of many at one place
        self.rows = found[is_other].reshape(len(found), count - 1)
        normals, colors = planes.axes[:, 2], Space("lab").to(base_colors(strokes.sh))
        units = np.where(planes.sizes > 0, planes.sizes, 1.0)[:, None]
        away = colors[self.rows] - colors[:, None]
        with np.errstate(over="ignore"):
            shares = np.minimum(planes.sizes[self.rows] / units, 1) ** 2
        shares *= np.einsum("nki,ni->nk", normals[self.rows], normals) ** 2
        weights = shares * np.exp(-np.einsum("nki,nki->nk", away, away) / COLOR_SPREAD)
        totals = weights.sum(axis=1, keepdims=True)
        self.weights = weights / np.where(totals > 0, totals, 1.0)

    def mean(self, values):
        return np.einsum("nk,nkc->nc", self.weights, values[self.rows])

    def smoothed(self, values):
        for _ in range(ROUNDS):
            values = 0.5 * values + 0.5 * self.mean(values)
        return values

    def agreed(self, directions, headings=HEADING):
        headings = np.broadcast_to(headings, directions.shape)
        for _ in range(ROUNDS):
            is_against = np.einsum("ni,ni->n", directions, headings) < 0
            directions = np.where(is_against[:, None], -directions, directions)
            headings = directions + self.mean(directions)
        return directions

    def field(self, gaussians, *, by_color_alone):
        color, long = surface(self.planes, gaussians)
        parts = [(COLOR, color)]
        if not by_color_alone:
            own = np.zeros_like(color)
            own[:, 0] = ramp(self.planes.aspects, *OWN_COUNTS)
            parts += [(OWN_AXIS, own), (LONG, long), (CURVATURE, self.least_curvature())]
        weights = sum(weight * np.hypot(part[:, 0], part[:, 1]) for weight, part in parts)
        return sum(weight * part for weight, part in parts), weights

    def least_curvature(self):
        planes = self.planes
        normals = planes.axes[:, 2]
        others = normals[self.rows]
        facing = np.sign(np.einsum("nki,ni->nk", others, normals))
        bends = np.einsum("nki,nji->nkj", facing[:, :, None] * others, planes.axes[:, :2])
        bends -= np.einsum("nk,nkj->nj", self.weights, bends)[:, None]
        moments = np.einsum("nk,nki,nkj->nij", self.weights, bends, bends)
        most, bend = _main_axes(moments)
        return -most * (bend / (bend + HALF_BEND))[:, None]

    def turned(self, pairs, weights, say=0.0, aspects=ASPECT, marked=0.0, headings=HEADING):
        planes = self.planes
        turnable = np.maximum(1 - ramp(planes.aspects, *OWN), say * (1 - ramp(planes.aspects, *SLENDER)))
        headings = np.broadcast_to(headings, planes.means.shape)
        headings = np.where(headings.any(axis=1, keepdims=True), headings, HEADING)
        smooth = planes.lower(self.smoothed(planes.lift(pairs, weights)))
        shapes = shapes_of(planes, *smooth, turnable, aspects * np.ones(len(planes)), marked)
        return shaped(self.strokes, planes, shapes, turnable > 0, self, headings)


def shapes_of(planes, pairs, weights, turnable, aspects, marked):
    """[n, 2] pairs whose weight is the logarithm of the aspect."""
    directions, agreement = unit_pairs(pairs)
    confidence = 2 * agreement / (weights + agreement + UNSURE)  # 1 - smaller / larger eigenvalue, damped
    wanted = np.log1p((aspects - 1) * confidence)[:, None] * directions
    own = np.zeros_like(wanted)
    own[:, 0] = np.log(np.minimum(planes.aspects, np.finfo(np.float64).max))
    shapes = (1 - turnable * ramp(confidence, 0.0, SURE))[:, None] * own + turnable[:, None] * wanted
    directions, logs = unit_pairs(shapes)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        thinnest = 2 * np.log(planes.sizes / planes.scales[:, 2])  # where the middle axis is as thin
    limit = np.maximum(own[:, 0], np.where(planes.scales[:, 2] > 0, thinnest, np.inf))
    limit = np.maximum(limit, marked * np.log(aspects))
    return directions * np.minimum(logs, limit)[:, None]


def shaped(strokes, planes, shapes, is_free, around, headings):
    angles = 0.5 * np.arctan2(shapes[:, 1], shapes[:, 0])
    logs = np.hypot(shapes[:, 0], shapes[:, 1])
    along, across, normals = (planes.axes[:, i] for i in range(3))
    turned = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across
    directions = around.agreed(np.where(is_free[:, None], turned, along), headings)
    is_same = ~is_free & (directions == along).all(axis=1)
    # Columns of a rotation are right-handed; so are longest, middle and shortest, unless their order is an
    # odd permutation.
    is_even = (planes.order[:, 1] - planes.order[:, 0]) % 3 == 1
    beside = np.cross(normals, directions) * np.where(is_even, 1.0, -1.0)[:, None]
    rotations = np.empty((len(planes), 3, 3))
    _put(rotations.transpose(0, 2, 1), planes.order[:, :, None], [directions, beside, normals])
    scales = np.empty_like(strokes.scales)
    sizes, stretch = planes.sizes, np.exp(0.5 * logs)
    longest = np.where(is_free, sizes * stretch, planes.scales[:, 0])
    middle = np.where(is_free, sizes / stretch, planes.scales[:, 1])
    # Undo rounding below the thickness; marks may become thinner.
    thick = planes.scales[:, 2]
    middle = np.where(middle > (1 - ROUNDING) * thick, np.maximum(middle, thick), middle)
    largest = np.finfo(scales.dtype).max
    _put(scales, planes.order, [np.minimum(longest, largest), middle, np.minimum(thick, middle)])
    quats = np.where(is_same[:, None], strokes.quats, quats_of(rotations).astype(scales.dtype))
    return replace(strokes, quats=quats, scales=scales)


def _put(target, order, columns):
    np.put_along_axis(target, order, np.stack(columns, axis=1).astype(target.dtype), axis=1)


def _main_axes(matrices):
    xx, xy, yy = matrices[:, 0, 0], matrices[:, 0, 1], matrices[:, 1, 1]
    return unit_pairs(np.stack([xx - yy, 2 * xy], axis=1))


def surface(planes, gaussians):
    """Pairs [n, 2] along lines of equal color, and along the extent of the surface."""
    weights, offsets, reach, colors = near(gaussians, planes.means)
    offsets -= np.einsum("nk,nki->ni", weights, offsets)[:, None]
    colors -= np.einsum("nk,nkc->nc", weights, colors)[:, None]
    flat = offsets @ planes.axes.transpose(0, 2, 1)  # along, across, off the plane
    weighted = weights[:, :, None] * flat
    moments = weighted.transpose(0, 2, 1) @ flat
    xx, yy, zz = (moments[:, i, i] for i in range(3))
    xy = moments[:, 0, 1]
    slopes = _solved(xx, xy, yy, weighted[:, :, :2].transpose(0, 2, 1) @ colors)
    products = slopes @ slopes.transpose(0, 2, 1)
    across, contrast = _main_axes(products)
    with np.errstate(over="ignore"):
        sizes = np.minimum(planes.sizes / reach, FARTHEST)
    steps = np.sqrt(contrast) * sizes  # of color, across the stroke
    long, difference = _main_axes(moments)
    widest, narrow = 0.5 * (xx + yy + difference), 0.5 * (xx + yy - difference)
    is_long = ramp(difference / np.maximum(widest, LEAST_SPREAD), *IS_LONG)
    is_flat = 1 - np.minimum(zz / np.maximum(narrow, LEAST_SPREAD), 1)
    return -across * (steps / (steps + HALF_STEP))[:, None], long * (is_long * is_flat)[:, None]


def near(gaussians, means):
    """Of the nearest Gaussians that have paint: weights, offsets in reaches, reaches and colors."""
    paint = paint_of(gaussians)
    rank = int((1 - SURFACE) * len(paint))
    rows = np.flatnonzero(paint >= np.partition(paint, rank)[rank])
    center, radius = robust_frame(gaussians.means)
    both = gaussians.means[rows], means
    points, places = (np.clip((x - center) / radius, -FARTHEST, FARTHEST) for x in both)
    distances, found = nearest(points, places, min(NUM_NEAR, len(rows)))
    shares = np.sqrt(paint[rows] / max(float(paint.max()), np.finfo(np.float64).tiny))
    reach = np.where(distances[:, -1] > 0, distances[:, -1], 1.0)
    weights = (1 - (distances / reach[:, None]) ** 2) ** 2 * shares[found]
    totals = weights.sum(axis=1, keepdims=True)
    weights /= np.where(totals > 0, totals, 1.0)
    offsets = (points[found] - places[:, None]) / reach[:, None, None]
    return weights, offsets, reach * radius, Space("lab").to(base_colors(gaussians.sh[rows]))[found]


def _solved(xx, xy, yy, sides):
    more = FLATNESS * (xx + yy) + LEAST_SPREAD
    xx, xy, yy = (xx + more)[:, None], xy[:, None], (yy + more)[:, None]
    scaled = yy * sides[:, 0] - xy * sides[:, 1], xx * sides[:, 1] - xy * sides[:, 0]
    return np.stack(scaled, axis=1) / (xx * yy - xy * xy)[:, None]
