"""The curve of error over run time by number of strokes, and its knee.

The knee is the count with the best trade-off: with e the share of error removed and t the share of seconds
added, both 0 at the first count of the curve and 1 at its last, the knee maximizes e - t. There the curve of
RMSE over seconds is parallel to the chord between its ends: before it a second removes more error than
average, after it less.
Source: the Kneedle algorithm (Satopaa et al. 2011, Finding a "Kneedle" in a Haystack), on a fit in place of a
smoothing spline.

Seconds are those of a frame for films, of a whole painting for stills. The curve of a film uses the error of
its frames. That of a still uses the error of clustering alone, drawn with the kernel of the plain picture:
the error added by a brush image, 4 to 10 of 255, does not depend on the number of strokes. The last count,
one stroke per Gaussian, needs no clustering: error and seconds jump there, so it is an end of the curve but
not part of its fit. If the best trade-off before it is worth less than `LEAST_WORTH`, or it takes no longer
than the first count, it is the knee: merging does not pay.

The knee does not depend on the unit of error, the speed of the machine or a fixed start-up time. It does
depend on the ends, so a curve should end at one stroke per Gaussian. (If the curve ends at 32,000 strokes,
the knee of a scene of 150,000 moves from 12,600 to 3,800.)

Why not the minimum of error x seconds^p, which needs no ends: on nine real scenes both are nearly powers of
the count, so that minimum is flat. 7 % of noise in the seconds, with one count omitted, moves it by factors
up to 5.8 (p = 1/2 and 1; standard deviation of the logarithm, on smooth fits), and on most scenes it lies at
an end of the curve: 125 strokes for a camp ground. The same noise moves the knee by 1.05 to 1.21, and it lies
at 1,200 to 12,600 strokes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Array, check

EXPONENTS = (-0.5, -0.25, 0.0, 0.25, 0.5)  # of the falling terms of the error; 0 is the logarithm
COSTS = (
    0.25,
    0.5,
    0.75,
    1.0,
)  # of the rising terms of the seconds: a stroke costs the same, or less as their number grows
STEPS = 512  # counts for evaluating a fit, evenly spaced in the logarithm, 1.5 % apart on the longest curves
RIDGE = 0.05  # ridge regression of relative terms: with noise, weights do not jump from one term to another
LEAST_WORTH = 0.2  # of e - t: below, merging does not pay
TINY = 1e-9  # replaces zero errors or sizes before taking logarithms
LEAST = 1e-12  # replaces zero errors before taking logarithms


@dataclass(frozen=True, eq=False)
class ErrorCurve:
    """Error and cost of a frame over the number of strokes.

    Attributes:
        strokes: [M] ascending counts, >= 1.
        rmse: [M] >= 0, of 1, to the plain picture, both on the same background.
        seconds: [M] > 0, of a frame or a painting.
        ends_unmerged: whether the last count is one stroke per Gaussian, see the module.

    Raises:
        ValueError: if lengths differ, counts do not ascend from 1 on, or a value is out of range.
    """

    strokes: Array  # [M]
    rmse: Array  # [M]
    seconds: Array  # [M]
    ends_unmerged: bool = False

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

    @property
    def merged(self) -> "ErrorCurve":
        """The fitted part: without an unmerged last count, unless it is the only one."""
        if not self.ends_unmerged or len(self.strokes) == 1:
            return self
        return ErrorCurve(self.strokes[:-1], self.rmse[:-1], self.seconds[:-1])


@dataclass(frozen=True)
class Knee:
    """The knee of a curve.

    Attributes:
        strokes: the count, within those of the curve.
        psnr: dB there, of the fit.
        gain_of_doubling: dB gained by twice the strokes.
        cost_of_doubling: seconds of twice the strokes over seconds here, >= 1.
    """

    strokes: int
    psnr: float
    gain_of_doubling: float
    cost_of_doubling: float


def knee(curve: ErrorCurve) -> Knee:
    """Find the knee of a curve, see the module.

    It is the first count if the error does not fall, and the last if more strokes cost nothing. Doubling is
    limited to the last fitted count; an unmerged last count does not double.
    """
    fitted, (counts, error, seconds) = curve.merged, _fine(curve)
    if curve.rmse.min() >= curve.rmse[0]:
        at = 0
    elif (seconds[-1] if curve.ends_unmerged else curve.seconds.max()) <= curve.seconds[0]:
        at = len(counts) - 1
    else:
        traded = _share(error, error.min()) - _share(seconds, seconds[-1])
        at = int(np.argmax(traded))
        if curve.ends_unmerged and traded[at] < LEAST_WORTH:
            at = len(counts) - 1
    if counts[at] > fitted.strokes[-1]:
        return Knee(int(curve.strokes[-1]), psnr_of(error[at]), 0.0, 1.0)
    high = min(2 * counts[at], fitted.strokes[-1])
    low = max(high / 2, counts[0])
    pair = np.array([low, high])
    octaves = float(np.log2(high / low)) or 1.0  # a curve of one count: nothing doubles
    (e1, e2), (t1, t2) = fitted_rmse(fitted, pair), fitted_seconds(fitted, pair)
    return Knee(
        round(float(counts[at])),
        psnr_of(error[at]),
        (psnr_of(e2) - psnr_of(e1)) / octaves,
        float((t2 / t1) ** (1 / octaves)),
    )


def worth(curve: ErrorCurve) -> float:
    """The largest e - t of a curve, see the module; -1 if the last count is no slower than the first."""
    _, error, seconds = _fine(curve)
    if seconds[-1] <= seconds[0]:
        return -1.0
    return float(np.max(_share(error, error.min()) - _share(seconds, seconds[-1])))


def _fine(curve: ErrorCurve) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Many counts with fitted error and seconds, and those of an unmerged last count."""
    fitted = curve.merged
    counts = np.geomspace(fitted.strokes[0], fitted.strokes[-1], STEPS)
    error, seconds = fitted_rmse(fitted, counts), fitted_seconds(fitted, counts)
    if fitted is curve:
        return counts, error, seconds
    return (
        np.append(counts, curve.strokes[-1]),
        np.append(error, curve.rmse[-1]),
        np.append(seconds, curve.seconds[-1]),
    )


def fitted_rmse(curve: ErrorCurve, counts: Array) -> NDArray[np.float64]:
    """The error at other counts within those of the curve, smooth and not increasing, [n].

    The model is a constant plus terms that fall to zero at the last count, (K^a - k^a) / a, with weights >=
    0. Weights minimize the squared relative errors (NNLS with a ridge), so that noise averages out.
    """
    last = float(curve.strokes[-1])

    def terms(strokes: Array) -> NDArray[np.float64]:
        x = np.asarray(strokes, dtype=np.float64) / last
        falling = [-np.log(x) if a == 0 else (1 - x**a) / a for a in EXPONENTS]
        return np.stack([np.ones_like(x), *falling], axis=1)

    return _fitted(terms(curve.strokes), np.maximum(curve.rmse, LEAST), terms(counts))


def fitted_seconds(curve: ErrorCurve, counts: Array) -> NDArray[np.float64]:
    """The seconds at other counts, smooth and not decreasing, [n]: a constant and rising powers."""
    last = float(curve.strokes[-1])

    def terms(strokes: Array) -> NDArray[np.float64]:
        x = np.asarray(strokes, dtype=np.float64) / last
        return np.stack([np.ones_like(x), *(x**a for a in COSTS)], axis=1)

    return _fitted(terms(curve.strokes), curve.seconds, terms(counts))


def psnr_of(rmse: float) -> float:
    """PSNR in dB of an RMSE of 1; 240 dB at most."""
    return float(-20 * np.log10(max(float(rmse), LEAST)))


def value_at(counts: Array, values: Array, count: int) -> float:
    """The value at a count, interpolated between sampled counts as a power of the count."""
    logs = np.log(np.maximum(values, TINY))
    value = float(np.exp(np.interp(np.log(count), np.log(counts), logs)))
    return value if value > 2 * TINY else 0.0


def _fitted(known: NDArray[np.float64], values: Array, others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fit weights of terms [M, T] to the values [M]; apply them to the terms at other counts [n, T]."""
    relative = known / values[:, None]
    lengths = np.linalg.norm(relative, axis=0)
    lengths[lengths == 0] = 1.0  # a term that is zero at all counts has no effect
    relative = relative / lengths
    gram = relative.T @ relative + RIDGE**2 * np.eye(len(lengths))
    return np.asarray(others @ (_nnls(gram, relative.sum(axis=0)) / lengths))


def _nnls(gram: NDArray[np.float64], target: NDArray[np.float64]) -> NDArray[np.float64]:
    """Non-negative least squares (NNLS): the x >= 0 that minimizes x.gram.x / 2 - target.x.

    The solution is positive on one subset of the terms, where it solves the normal equations of that subset.
    All subsets of the few terms are tried, in 1.3 ms; importing scipy.optimize.nnls takes 360 ms.
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


def _share(values: NDArray[np.float64], end: float) -> NDArray[np.float64]:
    """Values scaled to 0 at the first and 1 at the end; all 0 if these are equal."""
    way = end - values[0]
    return np.asarray((values - values[0]) / way if way else np.zeros_like(values))
