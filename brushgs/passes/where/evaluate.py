"""The memberships of a whole expression: each term alone, then combined."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, assert_never
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs.options.where import Where
from brushgs.options.where_terms import (
    Box,
    Color,
    Half,
    Height,
    Part,
    Sphere,
    Subject,
    Surroundings,
    Term,
    Words,
)
from brushgs.options.where_terms import (
    Mask as MaskTerm,
)
from brushgs.passes.reduce.contribution import paint_of
from brushgs.passes.where.ground import Ground, height_depths, in_hull, size_of
from brushgs.passes.where.masks import MaskView, mask_votes
from brushgs.passes.where.parts import connected_parts
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.hashing import GOLDEN, uniform
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import base_colors

T = TypeVar("T")
HALF = 0.5  # minimum membership of a Gaussian inside, if it cannot be partial


@dataclass(frozen=True)
class WhereContext:
    """Inputs of memberships besides the Gaussians.

    Attributes:
        first_view: of the scene; needed if `Where.needs_subject`, and for soft edges.
        soft: width of edges as a share of the subject's size, half to each side; for colors a distance in
            RGB. 0 for hard edges: memberships are 0 or 1.
        open_masks: the views of a file or folder of painted masks, needed by terms `mask:`.
        relevance: how well each of N Gaussians matches words, 0 to 1, inside from 1/2 on; needed by terms
            `text:`.
        num_threads: None takes the processors available to this process; no result depends on it.
    """

    first_view: FirstView | None = None
    soft: float = 0.0
    open_masks: Callable[[Path], Sequence[MaskView]] | None = None
    relevance: Callable[[str, Gaussians], F64] | None = None
    num_threads: int | None = None


def memberships(where: Where, gaussians: Gaussians, context: WhereContext | None = None) -> F64:
    """The membership of each Gaussian in a part of the scene.

    Args:
        where: the part.
        gaussians: N Gaussians, a scene or strokes.
        context: inputs of some terms, or None.

    Returns:
        [N] 0 to 1: `and` is the minimum of its parts, `or` the maximum, `not` 1 minus its part.

    Raises:
        ValueError: if a term needs something that the context lacks, or names a missing part.

    Does not depend on the order of the rows, or on the unit of the scene for terms without lengths.
    """
    if len(gaussians) == 0:
        return np.zeros(0)
    return _Evaluation(gaussians, context or WhereContext()).of(where)


def sides(shares: F64, gaussians: Gaussians) -> Mask:
    """[N] mask of the Gaussians inside, each completely, by a hash of its position.

    Args:
        shares: [N] memberships, 0 to 1; 1 is always inside, 0 never.
        gaussians: N Gaussians.
    """
    bits = np.ascontiguousarray(gaussians.means.astype(np.float64) + 0.0).view(np.uint64)
    states = np.zeros(len(gaussians), np.uint64)
    for column in bits.T:
        states = (states ^ column) * np.uint64(GOLDEN)
        states ^= states >> np.uint64(32)
    return np.asarray(uniform(states) < shares)


# Cache of results for a scene and a view, as long as both live: several rules, and successive inputs in the
# viewer, need the same subject.
_known: WeakKeyDictionary[Gaussians, WeakKeyDictionary[FirstView, dict[str, Any]]] = WeakKeyDictionary()


class _Evaluation:
    """Memberships of one set of Gaussians."""

    def __init__(self, gaussians: Gaussians, context: WhereContext) -> None:
        self._gaussians, self._context = gaussians, context

    def of(self, where: Where) -> F64:
        if where.term is not None:
            return self._of_term(where.term)
        parts = [self.of(part) for part in where.parts]
        if where.operator == "not":
            return 1 - parts[0]
        combine = np.minimum if where.operator == "and" else np.maximum
        return np.asarray(combine.reduce(parts))

    def _of_term(self, term: Term) -> F64:
        means = self._gaussians.means
        match term:
            case Box():
                return self._ramp(box_depths(term, means))
            case Sphere():
                return self._ramp(sphere_depths(term, means))
            case Half():
                return self._ramp(half_depths(term, means))
            case Color():
                return ramp(color_depths(term, self._gaussians), self._context.soft)
            case Height():
                return self._ramp(height_depths(term, self._ground, means))
            case Subject():
                return self._soft(self._subject)
            case Surroundings():
                return 1 - self._soft(self._subject)
            case Part():
                return self._soft(self._part(term))
            case MaskTerm():
                return self._soft(self._masked(term))
            case Words():
                return self._soft(self._relevant(term))
        assert_never(term)

    def _ramp(self, depths: F64) -> F64:
        return ramp(depths, self._width)

    def _soft(self, inside: Mask) -> F64:
        return soft_mask(inside, self._gaussians.means, self._width)

    @cached_property
    def _width(self) -> float:
        """Width of soft edges, world units."""
        return self._context.soft * size_of(self._view) if self._context.soft > 0 else 0.0

    @cached_property
    def _view(self) -> FirstView:
        if self._context.first_view is None:
            raise ValueError("where: the first view of the scene must be known for this; give first_view")
        return self._context.first_view

    def _found(self, name: str, find: Callable[[], T]) -> T:
        """A result that is computed once per scene and view."""
        of_scene = _known.setdefault(self._gaussians, WeakKeyDictionary())
        found = of_scene.setdefault(self._view, {})
        if name not in found:
            found[name] = find()
        known: T = found[name]
        return known

    @property
    def _ground(self) -> Ground:
        return self._found("ground", lambda: Ground.under(self._gaussians, self._view))

    @property
    def _subject(self) -> Mask:
        return self._found("subject", lambda: find_subject(self._gaussians, self._view, self._ground))

    def _part(self, term: Part) -> Mask:
        parts = self._parts
        if term.point is not None:
            away = self._gaussians.means.astype(np.float64) - np.array(term.point)
            return np.asarray(parts == parts[np.argmin((away**2).sum(axis=1))])
        assert term.rank is not None, "a part has a rank or a point"
        num = int(parts[self._subject].max(initial=-1)) + 1
        if term.rank > num:
            raise ValueError(f"where: {term} is not there; the subject has {num:,} connected parts")
        return np.asarray(parts == term.rank - 1)

    @property
    def _parts(self) -> NDArray[np.intp]:
        """[N] the connected part of each: those of the subject from 0, then those of the surroundings."""
        return self._found("parts", self._find_parts)

    def _find_parts(self) -> NDArray[np.intp]:
        subject = self._subject
        parts = np.empty(len(subject), np.intp)
        parts[subject] = connected_parts(self._gaussians.take(subject))
        num = int(parts[subject].max(initial=-1)) + 1
        parts[~subject] = num + connected_parts(self._gaussians.take(~subject))
        return parts

    def _masked(self, term: MaskTerm) -> Mask:
        if self._context.open_masks is None:
            raise ValueError(f"where: {term} needs the cameras that the masks were painted from")
        views = self._context.open_masks(term.path)
        found = mask_votes(self._gaussians, views, num_threads=self._context.num_threads)
        return np.asarray(found >= HALF)

    def _relevant(self, term: Words) -> Mask:
        if self._context.relevance is None:
            raise ValueError(f"where: {term} needs a CLIP model; give one with --text-model")
        found: Array = self._context.relevance(term.words, self._gaussians)
        return np.asarray(found >= HALF)


# Turn distances into memberships: hard edges, and soft ones of a given width.


def ramp(depths: F64, width: float) -> F64:
    """Memberships [N] for signed distances from an edge.

    Args:
        depths: [N] how far inside, any unit; below 0 outside. 0 is inside.
        width: of the soft edge, in the same unit, half of it to each side; 0 for a hard one.

    Returns:
        0 to 1, at least 1/2 exactly if `depths` is at least 0.
    """
    if not width > 0:
        return (depths >= 0).astype(np.float64)
    return np.clip(0.5 + depths / width, 0.0, 1.0)


def soft_mask(inside: Mask, means: Array, width: float) -> F64:
    """Memberships [N] for a mask, by the distance to the nearest Gaussian of the other side.

    Args:
        inside: [N].
        means: [N, 3] world units.
        width: see `ramp`.
    """
    if not width > 0 or inside.all() or not inside.any():
        return inside.astype(np.float64)
    from scipy.spatial import cKDTree

    from brushgs.core.threads import num_threads_or_default

    points, depths = means.astype(np.float64), np.empty(len(means))
    for side, sign in ((inside, 1.0), (~inside, -1.0)):
        tree = cKDTree(points[~side])
        distances, _ = tree.query(
            points[side], distance_upper_bound=width, workers=num_threads_or_default(None)
        )
        depths[side] = sign * np.minimum(distances, width)  # infinite where none is as near
    return ramp(depths, width)


# Signed distances from the surfaces of boxes, balls, half spaces and colors; above 0 inside.


def box_depths(box: Box, means: Array) -> F64:
    """[N] world units: the distance from the nearest face inside, minus that from the box outside."""
    points = means.astype(np.float64)
    beyond = np.maximum(np.array(box.low) - points, points - np.array(box.high))  # [N, 3], above 0 outside
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return np.asarray(np.where(outside > 0, -outside, -beyond.max(axis=1, initial=-np.inf)))


def sphere_depths(sphere: Sphere, means: Array) -> F64:
    """[N] world units."""
    away = means.astype(np.float64) - np.array(sphere.center)
    return np.asarray(sphere.radius - np.linalg.norm(away, axis=1))


def half_depths(half: Half, means: Array) -> F64:
    """[N] world units."""
    longest = max(map(abs, half.normal))  # squares of tiny and huge numbers stay in range
    normal = np.array(half.normal) / longest
    length = float(np.linalg.norm(normal))
    return np.asarray((means.astype(np.float64) @ normal - half.offset / longest) / length)


def color_depths(color: Color, gaussians: Gaussians) -> F64:
    """[N] in display-encoded RGB of 0 to 1."""
    away = base_colors(gaussians.sh) - np.array(color.rgb)
    return np.asarray(color.distance - np.linalg.norm(away, axis=1))


# Separate the subject of a scene from its surroundings.


MARGIN = 0.01  # of the subject's size, tolerance of its hull
# For a scene with surroundings, in sizes of the subject: maximum reach of a part beyond its hull, and maximum
# height of level Gaussians that belong to the ground.
AROUND = 0.3
LEVEL_ON_GROUND = 0.02
LEVEL = np.cos(np.radians(30.0))  # of the shortest axis against up
FLAT = 2.0  # minimum ratio of the second axis to the shortest for a normal
# Minimum shares of a connected part of the subject: its painted area inside the hull, and its part of all
# such area. The fence beside the truck lies in the hull in part.
MOSTLY, WORTH = 0.8, 0.005


def find_subject(gaussians: Gaussians, view: FirstView, ground: Ground) -> Mask:
    """[N] the Gaussians of the subject.

    Without surroundings and ground these are the Gaussians in the hull of its points. Otherwise the hull also
    contains ground and parts of other objects; then the subject consists of the connected parts above the
    ground that lie mostly in the hull, including parts that stick out.
    """
    size = size_of(view)
    inside = in_hull(gaussians.means, view.points, MARGIN * size)
    if not view.has_surroundings and not ground.is_found:
        return inside
    near = in_hull(gaussians.means, view.points, AROUND * size)
    if ground.is_found:
        near &= ~_on_ground(gaussians, ground, size)
    rows = np.flatnonzero(near)
    some = gaussians.take(rows)
    parts = connected_parts(some)
    areas = paint_of(some)
    num = int(parts.max(initial=-1)) + 1
    whole, in_it = (np.bincount(parts, weights, num) for weights in (areas, areas * inside[rows]))
    belongs = in_it >= MOSTLY * whole
    belongs &= in_it >= WORTH * in_it[belongs].sum()
    if not belongs.any():  # nothing rises above the ground: take the hull
        return inside
    found = np.zeros(len(gaussians), bool)
    found[rows] = belongs[parts]
    return found


def _on_ground(gaussians: Gaussians, ground: Ground, size: float) -> Mask:
    heights = ground.plane.heights(gaussians.means)
    found = heights <= 0
    rows = np.flatnonzero(~found & (heights <= LEVEL_ON_GROUND * size))
    sizes = np.sort(gaussians.scales[rows].astype(np.float64), axis=1)
    normals = shortest_axes(gaussians.quats[rows], gaussians.scales[rows])
    is_level = np.abs(normals @ ground.plane.normal) >= LEVEL
    found[rows] = is_level & (sizes[:, 1] > FLAT * sizes[:, 0])
    return np.asarray(found)
