"""An example of what a file of marks holds."""

import numpy as np

from brushgs.values.marks import Combs, Density, Erased, Marks, Overpaint

X, Z = np.array([[1.0, 0, 0]] * 2), np.array([[0, 0, -1.0]] * 2)
MEANS, ONES = np.array([[0.0, 1, 2], [3, 4, 5]]), np.ones(2)


def example() -> Overpaint:
    rng = np.random.default_rng(0)
    images = tuple(rng.integers(0, 256, shape, np.uint8) for shape in ((5, 4, 4), (3, 6, 4)))
    marks = Marks(MEANS, X, Z, 2 * ONES, ONES, 0.5 * X, 0.5 * ONES, np.arange(2), images)
    combs, density = Combs(MEANS, ONES, X, 0.5 * ONES), Density(MEANS, ONES, 2 * ONES)
    return Overpaint(marks, Erased(MEANS, Z, ONES), combs, density, time=0.5)
