"""Central differences, and comparing gradients with them: what the tests of derivatives share."""

from collections.abc import Callable

import numpy as np

STEP = 1e-6


def central_differences(
    loss: Callable[[np.ndarray], float], at: np.ndarray, step: float = STEP
) -> np.ndarray:
    """The gradient of a loss by an array in float64, value by value."""
    gradient = np.zeros(at.shape)
    for index in np.ndindex(at.shape):
        ends = []
        for sign in (1, -1):
            moved = at.copy()
            moved[index] += sign * step
            ends.append(loss(moved))
        gradient[index] = (ends[0] - ends[1]) / (2 * step)
    return gradient


def assert_same_gradient(name: str, actual: np.ndarray, numerical: np.ndarray, rtol: float = 1e-5) -> None:
    """Each value to `rtol` of the largest; and each row's length, which that alone could let vanish."""
    scale = max(np.abs(numerical).max(initial=0), 1e-6)
    off = np.abs(actual - numerical)
    worst = np.unravel_index(np.argmax(off), off.shape)
    assert off[worst] <= rtol * scale, (
        f"{name}{list(map(int, worst))}: numerical {numerical[worst]:.8g}, analytic {actual[worst]:.8g}"
    )
    rows = [np.linalg.norm(values.reshape(len(values), -1), axis=1) for values in (actual, numerical)]
    is_large = rows[1] > 1e-3 * scale
    np.testing.assert_allclose(rows[0][is_large], rows[1][is_large], rtol=100 * rtol, err_msg=name)
