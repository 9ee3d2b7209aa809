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
from brushgs.passes.where.edges import ramp, soft_mask
from brushgs.passes.where.ground import Ground, height_depths
from brushgs.passes.where.hull import size_of
from brushgs.passes.where.masks import MaskView, mask_votes
from brushgs.passes.where.parts import connected_parts
from brushgs.passes.where.shapes import box_depths, color_depths, half_depths, sphere_depths
from brushgs.passes.where.subject import find_subject
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.hashing import GOLDEN, uniform

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
