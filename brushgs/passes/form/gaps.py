"""Growth of each stroke to close gaps in surfaces of a single layer.

In trained scenes surfaces are several layers of Gaussians, and the gaps between strokes of one layer show the
next. Scenes from other sources (a scanned relief, surfaces sampled by a program) have one layer. There
Gaussians have 0.5 to 0.7 of their distance as standard deviation; merged by the law of total variance it is
0.29 of the distance, 0.34 with the usual overlap: a third of the surface would stay unpainted.

So strokes grow if nothing else covers their place. A stroke is viewed along its thinnest axis, perpendicular
to its surface:

- `alone` is the share of its paint that no other stroke covers at its center. On a lattice of one layer that
  is 0.85 to 0.95; on five trained scenes (2000 strokes) 0.06 to 0.2 in the median, 0.3 to 0.6 for one in ten.
- `flat` distinguishes planes from curved surfaces. Strokes on small fruit, which end at an outline, must not
  spill.
- A stroke that no neighbor touches has no gap to close.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default

NUM_NEIGHBORS = 12  # considered for coverage: two rings of a lattice
NUM_TOUCHING = 8  # of these are used for flatness
ENOUGH_TOUCHING = 4
TOUCH = 20.0  # squared Mahalanobis distance: on a square lattice direct neighbors have 9, diagonal ones 18
ALONE = (0.4, 0.8)  # where growth begins and is complete
FLAT = (0.9, 0.98)  # mean cosine between normals, likewise
# Growth of the variance between members, in units of that variance, on curved surfaces and on planes. With
# 1.2 a relief of 40,000 Gaussians in 2000 strokes gains 7.8 dB with the plain kernel and 2.4 with the flat
# brush, whose best is 0.8, the kernel's is 2.2. On the curled surfaces of the still life 0.2 gains 0.4 dB
# with the kernel and costs the brush 0.1.
CURLED, PLANE = 0.2, 1.2


def growth(
    means: NDArray[np.float64],
    scales: NDArray[np.float64],
    axes: NDArray[np.float64],
    opacities: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Growth of the variance of each stroke along its layer, [k], 0 to `PLANE`.

    Independent of unit, position and order of the strokes, and of the number of threads.

    Args:
        means: [k, 3] centers.
        scales: [k, 3] standard deviations, ascending.
        axes: [k, 3, 3] axes, as columns.
        opacities: [k].
    """
    num = len(means)
    neighbors = np.empty((num, max(0, min(NUM_NEIGHBORS, num - 1))), dtype=np.int32)
    _core.neighbors(means, neighbors, num_threads_or_default(None))
    passed, num_touching, parallel = _core.cover(
        means=means,
        scales=scales,
        axes=axes,
        opacities=opacities,
        rows=np.arange(num),
        neighbors=neighbors,
        num_touching=NUM_TOUCHING,
        touch=TOUCH,
        num_threads=num_threads_or_default(None),
    )
    flat = _ramp(parallel / np.maximum(num_touching, 1), *FLAT)
    touched = np.minimum(num_touching / ENOUGH_TOUCHING, 1)
    return np.asarray((CURLED + (PLANE - CURLED) * flat) * touched * _ramp(opacities * passed, *ALONE))


def _ramp(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.float64]:
    return np.clip((values - low) / (high - low), 0, 1)
