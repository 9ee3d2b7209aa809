"""Search for clusters that meet an error budget or a stroke size, by repeated clustering.

`choose` estimates a count from nested cells, which differ from clusters. Here the clusters themselves are
compared with the target.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.reduce.cluster import Grouping
from brushgs.stroke_count.choose import Choice, check_reach
from brushgs.stroke_count.curve import psnr_of
from brushgs.stroke_count.view_model import ViewModel
from brushgs.values.gaussians import Gaussians

# Clusters mostly reach the error of cells at 0.7 to 1.4 of their count: the search starts one step below the
# estimate, and each step multiplies the count by 1.19.
STEP = 2**0.25
START = 1 / STEP
CHANGED_START = 0.5  # if strokes are changed after clustering, which reach it at 0.2 to 0.7 of that count
SIZE_TOLERANCE, SIZE_TRIES = 0.05, 5  # relative to the target length; clusterings
SHALLOWEST = -0.2  # flattest power of sizes over counts, against noise

# Strokes, and the grouping of the Gaussians; None if each is a stroke.
Clustered = tuple[Gaussians, Grouping | None]
Cluster = Callable[[int], Clustered]  # maximum number of strokes -> strokes


@dataclass(frozen=True, eq=False)
class Found:
    """The clusters that meet a target best.

    Attributes:
        clustered: the clusters.
        count: number of strokes that clustering was called with.
        tries: clusterings made.
        size: typical length of the strokes, pixels.
        psnr: dB to the plain picture.
    """

    clustered: Clustered
    count: int
    tries: int
    size: float
    psnr: float


def search_budget(
    num: int,
    psnr: float,
    view_model: ViewModel,
    choice: Choice,
    cluster: Cluster,
    *,
    descends: bool = False,
) -> Found:
    """Find the first of a ladder of counts whose clusters reach a PSNR.

    The ladder is the same for every budget, so a stricter budget never gives fewer strokes.

    Args:
        num: Gaussians, one stroke per Gaussian at most.
        psnr: the budget, dB.
        view_model: the view.
        choice: the estimate to start from.
        cluster: merges the Gaussians.
        descends: try lower counts if the first reaches the budget, for strokes far better than the cells of
            the estimate.

    Raises:
        ValueError: if even one stroke per Gaussian does not reach it.
    """
    step, tries = _step_of((CHANGED_START if descends else START) * choice.strokes), 0
    low, best = None, None  # highest failing and lowest passing step
    while True:
        count, tries = min(num, round(STEP**step)), tries + 1
        clustered = cluster(count)
        boxes = view_model.boxes(clustered[0])
        reached = psnr_of(view_model.rmse(boxes))
        if count == num:
            check_reach(num, reached, psnr, view_model.texture.name)
        if reached >= psnr:
            best = step, Found(clustered, count, tries, view_model.size(boxes), reached)
        else:
            low = step
        if best is None:
            step += 1
            continue
        high, found = best
        if not descends or found.count == 1 or high - 1 == low:
            return replace(found, tries=tries)
        if low is not None:
            step = (low + high) // 2
        elif tries == 1:  # extrapolate the gain of strokes over cells, which is similar at other counts
            step = min(high - 1, _step_of(choice.count_below(count, reached - psnr)))
        else:
            step = max(0, high - 2 ** (tries - 1))


def _step_of(count: float) -> int:
    """The first step of the ladder at or above a count."""
    return int(np.ceil(np.log(max(1.0, count)) / np.log(STEP)))


def search_size(pixels: float, view_model: ViewModel, choice: Choice, cluster: Cluster) -> Found:
    """Find clusters with a typical size closest to `pixels`, in a few tries.

    The second try corrects the target size of the cells by the factor that the first clusters missed it by;
    later ones take the size as a power of the count, through the two nearest tries.

    Args:
        pixels: the target.
        view_model: the view.
        choice: the estimate to start from.
        cluster: merges the Gaussians.
    """
    tried: dict[int, tuple[float, Clustered]] = {}  # count -> logarithm of size over target, clusters
    count, most = choice.strokes, int(choice.curve.strokes[-1])
    while count not in tried:
        clustered = cluster(count)
        size = view_model.size(view_model.boxes(clustered[0]))
        tried[count] = float(np.log(max(size, 1e-9) / pixels)), clustered
        if abs(tried[count][0]) <= SIZE_TOLERANCE or len(tried) == SIZE_TRIES or size == 0:
            break
        if len(tried) == 1:
            count = choice.count_of_size(pixels * pixels / size)
            continue
        near, other = sorted(tried, key=lambda count: abs(tried[count][0]))[:2]
        power = (tried[near][0] - tried[other][0]) / np.log(near / other)
        step = -tried[near][0] / min(power, SHALLOWEST)
        count = int(np.clip(round(near * float(np.exp(step))), 1, most))
    best = min(tried, key=lambda count: abs(tried[count][0]))
    clustered = tried[best][1]
    boxes = view_model.boxes(clustered[0])
    return Found(clustered, best, len(tried), view_model.size(boxes), psnr_of(view_model.rmse(boxes)))
