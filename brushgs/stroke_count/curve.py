"""The curve of error against run time over the number of strokes, and its knee: the one definition of both.

The knee is the count at which the curve has bought the most for the least: with e the share of the error
that was taken away and t the share of the seconds that were added, both from the first count of the curve
(0) to its last (1), the knee is where e - t is largest. There the curve of RMSE over seconds is parallel to
the chord between its ends: before it a second takes away more error than on average, after it less.
Source: Satopaa et al. 2011, Finding a "Kneedle" in a Haystack; but on a fit in place of a spline.

It depends neither on the unit of the error nor on the speed of the machine nor on a fixed start-up time.
What it does depend on are the ends, so a curve should end where the scene does: at one stroke per Gaussian,
whose frame needs no clustering. (Cut at 32,000 strokes, the knee of a scene of 150,000 moves from 12,600 to
3,800.)

Why not the least error x seconds^p, which needs no ends: on nine real scenes both are near powers of the
count, so that optimum is flat. 7 % of noise in the seconds, and one count left out, move it by factors up to
5.8 (p = 1/2 and 1; standard deviation of the logarithm, on smooth fits), and on most scenes it lies at an
end of the curve: 125 strokes for a camp ground. The same noise moves the knee by 1.05 to 1.21, and it lies
at 1,200 to 12,600 strokes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array, check

EXPONENTS = (-0.5, -0.25, 0.0, 0.25, 0.5)  # of the falling terms of the error; 0 is the logarithm
COSTS = (
    0.25,
    0.5,
    0.75,
    1.0,
)  # of the rising terms of the seconds: a stroke costs as much, or less with each
STEPS = 512  # at which a fit is looked at: even in the logarithm, 1.5 % apart on the longest curves
RIDGE = 0.05  # on weights of relative terms: shares them out, so that noise does not switch one for another
LEAST = 1e-12  # in place of an error of zero, which has no logarithm


@dataclass(frozen=True, eq=False)
class ErrorCurve:
    """What more strokes cost and what they bring.

    Attributes:
        strokes: [M] ascending counts, >= 1.
        rmse: [M] >= 0, of 1, against the plain render, both on the same ground.
        seconds: [M] > 0, of a frame or a painting.

    Raises:
        ValueError: if lengths differ, counts do not ascend from 1 on, or a value is out of range.
    """

    strokes: Array  # [M]
    rmse: Array  # [M]
    seconds: Array  # [M]

    def __post_init__(self) -> None:
        for name in ("strokes", "rmse", "seconds"):
            dtype = np.int64 if name == "strokes" else np.float64
            column = np.array(getattr(self, name), dtype=dtype)
            column.flags.writeable = False
            object.__setattr__(self, name, column)
        columns = {name: (getattr(self, name), "M") for name in ("strokes", "rmse", "seconds")}
        check("ErrorCurve", **columns)
        if len(self.strokes) == 0 or self.strokes[0] < 1 or (np.diff(self.strokes) <= 0).any():
            raise ValueError(f"ErrorCurve: strokes must ascend from 1 or more, got {self.strokes.tolist()}")
        if not (np.isfinite(self.rmse).all() and (self.rmse >= 0).all()):
            raise ValueError(f"ErrorCurve: rmse must be finite and >= 0, got {self.rmse.tolist()}")
        if not (np.isfinite(self.seconds).all() and (self.seconds > 0).all()):
            raise ValueError(f"ErrorCurve: seconds must be finite and > 0, got {self.seconds.tolist()}")


@dataclass(frozen=True)
class Knee:
    """Where a curve bends.

    Attributes:
        strokes: the count, within those of the curve.
        psnr: dB there, of the fit.
        gain_of_doubling: dB that twice the strokes bring.
        cost_of_doubling: seconds of twice the strokes over seconds here, >= 1.
    """

    strokes: int
    psnr: float
    gain_of_doubling: float
    cost_of_doubling: float


def knee(curve: ErrorCurve) -> Knee:
    """The knee of a curve, see the module.

    Where the error does not fall it is the first count, where more strokes cost nothing the last. Beyond the
    last count nothing is known: a doubling that would lead there is told from the last one that does not.
    """
    counts = np.geomspace(curve.strokes[0], curve.strokes[-1], STEPS)
    error, seconds = fitted_rmse(curve, counts), fitted_seconds(curve, counts)
    if curve.rmse.min() >= curve.rmse[0]:
        at = 0
    elif curve.seconds.max() <= curve.seconds[0]:
        at = STEPS - 1
    else:
        at = int(np.argmax(_share(error) - _share(seconds)))
    high = min(2 * counts[at], counts[-1])
    low = max(high / 2, counts[0])
    pair = np.array([low, high])
    octaves = float(np.log2(high / low)) or 1.0  # a curve of one count: nothing doubles
    (e1, e2), (t1, t2) = fitted_rmse(curve, pair), fitted_seconds(curve, pair)
    return Knee(
        round(float(counts[at])),
        psnr_of(error[at]),
        (psnr_of(e2) - psnr_of(e1)) / octaves,
        float((t2 / t1) ** (1 / octaves)),
    )


def fitted_rmse(curve: ErrorCurve, counts: Array) -> NDArray[np.float64]:
    """The error at other counts within the curve's, smooth and nowhere rising, [n].

    A sum, with weights >= 0, of a floor and of terms that fall to zero at the last count: (K^a - k^a) / a.
    The weights make the relative errors least, in squares; so noise of single counts averages out.
    """
    last = float(curve.strokes[-1])

    def terms(strokes: Array) -> NDArray[np.float64]:
        x = np.asarray(strokes, dtype=np.float64) / last
        falling = [-np.log(x) if a == 0 else (1 - x**a) / a for a in EXPONENTS]
        return np.stack([np.ones_like(x), *falling], axis=1)

    return _fitted(terms(curve.strokes), np.maximum(curve.rmse, LEAST), terms(counts))


def fitted_seconds(curve: ErrorCurve, counts: Array) -> NDArray[np.float64]:
    """The seconds at other counts, smooth and nowhere falling, [n]: a fixed part and rising powers."""
    last = float(curve.strokes[-1])

    def terms(strokes: Array) -> NDArray[np.float64]:
        x = np.asarray(strokes, dtype=np.float64) / last
        return np.stack([np.ones_like(x), *(x**a for a in COSTS)], axis=1)

    return _fitted(terms(curve.strokes), curve.seconds, terms(counts))


def psnr_of(rmse: float) -> float:
    """PSNR in dB of an RMSE of 1; 240 dB at most."""
    return float(-20 * np.log10(max(float(rmse), LEAST)))


def _fitted(known: NDArray[np.float64], values: Array, wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Terms [n, T] at other counts, weighed so that those at the known ones [M, T] come to the values."""
    relative = known / values[:, None]
    lengths = np.linalg.norm(relative, axis=0)
    lengths[lengths == 0] = 1.0  # a term that is zero at all counts takes no part
    relative = relative / lengths
    gram = relative.T @ relative + RIDGE**2 * np.eye(len(lengths))
    return np.asarray(wanted @ (_nnls(gram, relative.sum(axis=0)) / lengths))


def _nnls(gram: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Non-negative least squares (NNLS): the x >= 0 that minimises x.gram.x / 2 - target.x.

    The solution is positive on one subset of the terms, where it solves the normal equations of that subset.
    All subsets of the few terms are tried, in 1.3 ms; to import scipy.optimize.nnls takes 360 ms.
    """
    best, weights = 0.0, np.zeros(len(target))
    for subset in range(1, 1 << len(target)):
        used = [term for term in range(len(target)) if subset >> term & 1]
        solved = np.linalg.solve(gram[np.ix_(used, used)], target[used])
        value = -0.5 * float(target[used] @ solved)
        if value < best and (solved >= 0).all():
            best, weights = value, np.zeros(len(target))
            weights[used] = solved
    return weights


def _share(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far from the first value to the last; 0 throughout where they are equal."""
    way = values[-1] - values[0]
    return np.asarray((values - values[0]) / way if way else np.zeros_like(values))
