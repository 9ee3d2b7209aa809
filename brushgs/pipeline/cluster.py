"""`brushgs.cluster`: the clustering pass, with a number of strokes as on the command line."""

import operator
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import Brush, BrushSet
from brushgs.options.choices import Features, Knee, Merge, Method
from brushgs.options.painting import DEFAULT_STROKE, ClusterConfig
from brushgs.options.stroke_target import ErrorBudget, parse_strokes
from brushgs.passes.reduce import cluster as passes
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.plain import PlainViews
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.stroke_count.search import Clustered


def cluster(
    gaussians: Gaussians,
    num_strokes: int | float | str,
    *,
    features: Features = "balanced",
    merge: Merge = "cover",
    method: Method = "auto",
    seed: int = 0,
    views: Sequence[Camera] | PlainViews | None = None,
    focus: NDArray[np.float64] | None = None,
    camera: Camera | None = None,
    texture: Brush = DEFAULT_STROKE,
) -> Gaussians:
    """Merge Gaussians into fewer, larger ones.

    Args:
        gaussians: N Gaussians.
        num_strokes: maximum number of strokes: k >= 1, or a share of N, 0.1 or "10%"; "all" merges none. Or a
            target in a view: "auto" is the knee of error over painting time, "auto:frame" over frame time,
            see `choose_strokes`; "24dB" is the fewest strokes that reach this PSNR to the plain picture,
            found by repeated clustering.
        features: "balanced" does not depend on the unit of the scene and weighs each Gaussian by its
            contribution and the color detail around it (`cluster_weights`); "paper" is raw and unweighted.
            See `cluster_features`.
        merge: "cover" or "paper", see `merge_clusters`.
        method: "minibatch" as published, "lloyd" with exact steps, "auto" by `choose_method`.
        seed: of all random choices, 0 to 2^32 - 1. Equal seeds give bit-identical results for any number of
            threads.
        views: views to make the strokes for: a few small cameras (see `plain_views`), or plain pictures of
            the whole scene. Gaussians are then weighted by their visible share, strokes that differ from the
            pictures are split in two, and colors are fitted to the pictures. None, or views that show
            nothing: all Gaussians count.
        focus: [N] > 0, factor on the number of strokes per area; None is 1 for all.
        camera: view of a target; None for that of `frame_scene`. Not used for a plain number.
        texture: brush of a target, or its name or path, see `render`. Not used for a plain number.

    Returns:
        At most k Gaussians; the input itself if k >= N.

    Raises:
        TypeError: if `num_strokes` is no number or text, or `seed` is not an integer.
        ValueError: if an option is out of range or unknown, `focus` or `views` do not match, or even N
            strokes do not reach the PSNR.

    Shuffled rows give the same clusters under other labels, unless two Gaussians have equal weight and
    position. Sums over a cluster may differ in the last bits, which can move a Gaussian midway between two
    clusters.

    Example:
        >>> bg.cluster(gaussians, 300)
        Gaussians(300, SH 3)
        >>> tenth = bg.cluster(gaussians, "10%")
        >>> strokes = bg.cluster(gaussians, "auto", camera=camera, texture="flat")
    """
    wanted = _number_of(num_strokes)

    def clustered(count: int) -> Gaussians:
        return passes.cluster(
            gaussians,
            count,
            features=features,
            merge=merge,
            method=method,
            seed=seed,
            views=views,
            focus=focus,
        )

    if wanted is None:
        return gaussians
    if isinstance(wanted, int):
        return clustered(wanted)
    if isinstance(wanted, float):
        return clustered(ClusterConfig(wanted).num_strokes(len(gaussians)))

    from brushgs.stroke_count.choose import choose_for_view_model, open_view_model
    from brushgs.stroke_count.search import search_budget

    if camera is None:
        from brushgs.pipeline.cameras import frame_scene

        camera = frame_scene(gaussians)
    views = None if views is None else PlainViews.of(gaussians, views)  # drawn once
    brush_set = BrushSet.of(texture)
    view_model = open_view_model(gaussians, camera, brush_set, RenderOptions.of(brush_set))
    psnr = wanted.psnr if isinstance(wanted, ErrorBudget) else None
    are_changed = views is not None
    choice = choose_for_view_model(
        gaussians,
        view_model,
        psnr=psnr,
        features=features,
        merge=merge,
        cost=ClusterConfig(wanted).cost,
        are_changed=are_changed,
    )
    if psnr is None:
        return clustered(choice.strokes)

    def attempt(count: int) -> "Clustered":
        return clustered(count), None

    found = search_budget(len(gaussians), psnr, view_model, choice, attempt, descends=are_changed)
    return found.clustered[0]


def _number_of(num_strokes: object) -> "int | float | Knee | ErrorBudget | None":
    """Parse a number of strokes: a count, a share or a target; None for all."""
    if isinstance(num_strokes, str):
        try:
            return parse_strokes(num_strokes)
        except ValueError as error:
            raise ValueError(f"cluster: num_{error}") from None
    if isinstance(num_strokes, float | np.floating):
        if not 0 < num_strokes <= 1:
            raise ValueError(
                f"cluster: num_strokes must be a whole number, or a share in (0, 1], got {num_strokes}"
            )
        return float(num_strokes)
    try:
        return operator.index(num_strokes)  # type: ignore[arg-type]
    except TypeError:
        kind = type(num_strokes).__name__
        raise TypeError(f"cluster: num_strokes must be a number, a share or text, got {kind}") from None
