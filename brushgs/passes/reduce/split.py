"""Adaptive splitting: clusters are cut in two if their strokes differ from the pictures of the scene.

Starting from about half of the strokes, a few rounds of: merge, draw, measure the error under every stroke,
and cut the clusters with the largest errors. Quiet areas keep large strokes; areas rich in form, and
silhouettes over which a stroke spills, get small ones. A cut cluster is replaced: coarse strokes behind fine
ones would spill over silhouettes.
Source: Hertzmann 1998, Painterly rendering with curved brush strokes of multiple sizes (layers by error;
there they stay).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.form.economy import LEAST, SEEN, ViewingError
from brushgs.passes.form.slabs import too_long
from brushgs.passes.groups import Groups, add_rows, compacted
from brushgs.rendering.options import RenderOptions, draw_with
from brushgs.rendering.plain import PlainViews
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_shares
from brushgs.values.arrays import F32, F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

FIRST_SHARE = 0.5  # of the strokes, made by k-means; 0.3 loses 0.1 to 0.5 dB, 0.7 is as good and slower
NUM_ROUNDS = 4  # two lose 0.1 to 0.6 dB, six gain 0.1
NUM_LAST_ROUNDS = 2  # with economy: before these, every second view is used, a difference within 0.1 dB
NUM_STEPS = 3  # of 2-means after the cut across the widest direction
# Minimum span in any direction, of the mean square distance in a cluster: 0.02 to 0.2 are within 0.1 dB of
# each other, 1 gains half as much. Without spans 2000 strokes lose 0.0 to 0.5 dB.
LEAST_SPAN = 0.1

Labels = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Goal:
    """When clusters are cut, and how many strokes there should be.

    Attributes:
        views: of the scene.
        num_strokes: >= 1.
        focus: [N] > 0, factor on the errors of clusters by their members; None is 1.
        worth_keeping: from k strokes to a mask [k] of those to keep; others do not count toward the target.
            None keeps all.
        economy: 0 to 1, share of errors as seen from the viewing distance, see `brushgs.passes.form.economy`:
            clusters without any are not cut.
        cameras: views in which strokes that are too long are cut first, see `brushgs.passes.form.slabs`.
    """

    views: PlainViews
    num_strokes: int
    focus: F64 | None = None
    worth_keeping: Callable[[Gaussians], Mask] | None = None
    economy: float = 0.0
    cameras: Sequence[Camera] = ()


def split(
    labels: NDArray[np.int32],
    merged: Callable[[Labels], Gaussians],
    points: Array,
    spans: F32,
    weights: F64,
    goal: Goal,
    num_rounds: int = NUM_ROUNDS,
    order: Rows | None = None,
) -> Iterator[Labels]:
    """Cut clusters until there are as many strokes as the goal says.

    Args:
        labels: [N] of the clusters to start from, 0 to k - 1, each in use.
        merged: from labels to strokes, one per label, ascending.
        points: [N, D] the Gaussians in feature space; the first three numbers are positions.
        spans: [N, 3, 3] half axes of the Gaussians in that space, as columns.
        weights: [N] of the Gaussians, > 0.
        goal: see `Goal`.
        num_rounds: >= 1.
        order: that of `cut`.

    Yields:
        [N] labels, 0 to k' - 1, each in use: the initial ones, and those after each round. The final number
        is below the target only if nothing is left to cut: no error, or no cluster of different points.
    """
    views, economy, focus = goal.views, goal.economy, goal.focus
    found = np.asarray(labels, dtype=np.intp)
    yield found
    seen = [ViewingError.of(frame) for frame in views.frames] if economy > 0 else []
    for remaining in range(num_rounds, 0, -1):
        strokes = merged(found)
        worth_keeping = goal.worth_keeping
        is_kept = np.ones(len(strokes), bool) if worth_keeping is None else worth_keeping(strokes)
        num_missing = goal.num_strokes - np.count_nonzero(is_kept)
        if num_missing <= 0:
            break
        step = 2 if economy and remaining > NUM_LAST_ROUNDS else 1
        some = PlainViews(views.cameras[::step], views.frames[::step])
        errors = painted_errors(strokes, some, seen[::step], economy) * is_kept
        if focus is not None:
            totals, sums = Groups.of(found, len(strokes)).totals_and_sums(focus[:, None], weights)
            errors *= sums[:, 0] / totals
        errors[too_long(strokes, goal.cameras)] += errors.max(initial=0.0)
        errors[np.bincount(found, minlength=len(strokes)) < 2] = 0
        errors[errors < economy * LEAST * SEEN[1] ** 2 * len(some)] = 0
        worst = np.argsort(-errors, kind="stable")[: -(-num_missing // remaining)]
        worst = worst[errors[worst] > 0]
        if len(worst) == 0:
            break
        found = cut(found, np.sort(worst), points, weights, spans, order)
        yield found


def painted_errors(
    strokes: Gaussians, views: PlainViews, seen: Sequence[ViewingError] = (), economy: float = 0.0
) -> F64:
    """The share of each stroke in the squared error of pictures, [k], sum over all views.

    The error at a pixel is shared among the strokes by their weights in it.

    Args:
        strokes: k strokes, drawn as flat dabs.
        views: of the scene.
        seen: one per view, for errors as seen from the viewing distance.
        economy: 0 to 1, the share of these errors.
    """
    kernel = StrokeTexture.open("ellipse")
    options = RenderOptions.of(kernel, depth=False)
    errors = np.zeros(len(strokes))

    def look(index: int) -> tuple[NDArray[np.int32], Array]:
        boxes, painted = draw_with(strokes, views.cameras[index], kernel, options)
        wrong = np.zeros_like(painted.alpha)
        if economy < 1:
            wrong += (1 - economy) * _squared_errors(views.frames[index], painted)
        if economy > 0:
            wrong += economy * seen[index].of_painted(painted)
        return boxes.ids, painted_shares(boxes, kernel, wrong)

    for ids, sums in view_by_view(look, range(len(views)), len(strokes)):
        add_rows(errors, ids, sums)
    return errors


def _squared_errors(plain: Frame, painted: Frame) -> Array:
    """The squared error at each pixel [H, W]: mean over a black and a white background."""
    more_alpha = painted.alpha - plain.alpha
    on_black, on_white = np.zeros_like(more_alpha), np.zeros_like(more_alpha)
    for channel in range(3):  # the last axis of a picture is too short for NumPy to be fast along it
        away = painted.rgb[..., channel] - plain.rgb[..., channel]
        on_black += away * away
        away -= more_alpha
        on_white += away * away
    return 0.5 * (on_black + on_white)


def cut(
    labels: Labels,
    chosen: Labels,
    points: Array,
    weights: F64,
    spans: F32 | None = None,
    order: Rows | None = None,
) -> Labels:
    """Cut the chosen clusters in two by 2-means, starting across the widest direction of each.

    With `spans`, see `split`, distances count less along the length of members: overlapping members stay
    together rather than members side by side. The half with the first member keeps the label: the first row,
    or that of the lowest number in `order` [N], each in use once.
    """
    num = int(labels.max()) + 1
    place = np.full(num, -1)
    place[chosen] = np.arange(len(chosen))
    rows = np.flatnonzero(place[labels] >= 0)
    groups = Groups.of(place[labels[rows]], len(chosen))
    rows = rows[groups.rows]
    second = _core.halves(
        np.ascontiguousarray(points),
        np.ascontiguousarray(weights, np.float64),
        None if spans is None else np.ascontiguousarray(spans, points.dtype),
        rows.astype(np.int32),
        groups.begins,
        LEAST_SPAN,
        NUM_STEPS,
        num_threads_or_default(None),
    )
    is_second = np.asarray(second, bool)
    if order is not None:
        places = order[rows]
        are_first = places == np.repeat(np.minimum.reduceat(places, groups.begins[:-1]), groups.sizes)
        is_second ^= np.repeat(is_second[are_first], groups.sizes)
    labels = labels.copy()
    labels[rows[is_second]] = num + np.repeat(np.arange(len(chosen)), groups.sizes)[is_second]
    return compacted(labels)[0].astype(np.intp)
