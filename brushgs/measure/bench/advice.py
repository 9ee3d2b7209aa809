"""One line of advice on the number of strokes of a scene, from the knees of its curve."""

import numpy as np

from brushgs.measure.bench.figures import Family
from brushgs.stroke_count.curve import ErrorCurve, Knee, knee, psnr_of, value_at

LEAST_POINTS = 3  # a knee lies between two ends
LEAST_GAIN = 0.05  # dB; less is reported as nothing
OF_TIME = {"frame": "a film", "painting": "a still"}  # product with this time


def curves_of(family: Family) -> dict[str, ErrorCurve]:
    """The curve for each time, "frame" and "painting"; none for fewer than three points.

    The curve of a still has the error of clustering, see `brushgs.stroke_count.curve`; in a look, which is
    compared with itself and has no error of a brush, the same error as that of a film.
    """
    points = {point.strokes: point for point in family.points}  # two counts may give the same strokes
    if len(points) < LEAST_POINTS:
        return {}
    strokes = np.array(sorted(points))
    rmse = np.array([points[count].error.rmse for count in strokes])
    errors = ((points[count].clustering, points[count].error.rmse) for count in strokes)
    clustering = np.array([total if merged is None else merged for merged, total in errors])
    frame, painting = (
        np.array([points[count].seconds[kind].median for count in strokes]) for kind in OF_TIME
    )
    return {
        "frame": ErrorCurve(strokes, rmse, frame),
        "painting": ErrorCurve(strokes, clustering, painting, ends_unmerged=True),
    }


def advice(family: Family | None) -> tuple[dict[str, Knee], str | None]:
    """The knee by each time, and the advice: "for this scene a film is worth 4,100 strokes (28.6 dB, ...".

    Args:
        family: `strokes`; None if it was not measured.
    """
    curves = {} if family is None else curves_of(family)
    if family is None or not curves:
        return {}, None
    bends = {kind: knee(curve) for kind, curve in curves.items()}
    said = [_words(kind, bend, family) for kind, bend in bends.items()]
    return bends, f"for this scene {'; '.join(said)}"


def _words(kind: str, bend: Knee, family: Family) -> str:
    points = sorted(family.points, key=lambda point: point.strokes)
    counts, errors = np.array([(point.strokes, point.error.rmse) for point in points]).T
    reached = psnr_of(value_at(counts, errors, bend.strokes))
    what = f"{OF_TIME[kind]} is worth {_rounded(bend.strokes):,} strokes ({reached:.1f} dB"
    if bend.strokes >= points[-1].strokes:
        return f"{what}, all: merging does not pay)"
    gain = f"{bend.gain_of_doubling:.1f} dB" if bend.gain_of_doubling >= LEAST_GAIN else "nothing"
    return f"{what}; doubling buys {gain} for {bend.cost_of_doubling:.1f} x the time)"


def _rounded(count: int) -> int:
    """Round to two digits, the precision of a knee."""
    return int(round(count, 2 - len(str(count)))) if count >= 100 else count
