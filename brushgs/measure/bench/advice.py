"""One line of advice on the number of strokes of a scene, from the knee of its curve."""

import numpy as np

from brushgs.measure.bench.figures import Family
from brushgs.stroke_count.curve import ErrorCurve, Knee, fitted_seconds, knee

LEAST_POINTS = 3  # a knee lies between two ends
LEAST_GAIN = 0.05  # dB; less is reported as nothing


def curves_of(family: Family) -> dict[str, ErrorCurve]:
    """The curve of strokes for each cost, "frame" and "painting"; none of fewer than three points."""
    points = {point.strokes: point for point in family.points}  # two counts may give the same strokes
    if len(points) < LEAST_POINTS:
        return {}
    strokes = np.array(sorted(points))
    rmse = np.array([points[count].error.rmse for count in strokes])
    kinds = family.points[0].seconds
    return {
        kind: ErrorCurve(strokes, rmse, np.array([points[count].seconds[kind].median for count in strokes]))
        for kind in kinds
    }


def advice(curves: dict[str, ErrorCurve]) -> tuple[Knee | None, str | None]:
    """The knee by the seconds of a frame, and the advice: "for this scene 3,100 strokes reach ..."."""
    if not curves:
        return None, None
    bend = knee(curves["frame"])
    low = min(bend.strokes, curves["painting"].strokes[-1] / 2)
    once, twice = fitted_seconds(curves["painting"], np.array([low, 2 * low]))
    gain = f"{bend.gain_of_doubling:.1f} dB" if bend.gain_of_doubling >= LEAST_GAIN else "nothing"
    return bend, (
        f"for this scene {_rounded(bend.strokes):,} strokes reach {bend.psnr:.1f} dB; doubling them buys "
        f"{gain} for {bend.cost_of_doubling:.1f} x the time of a frame, {twice / once:.1f} x that of a whole "
        "painting"
    )


def _rounded(count: int) -> int:
    """To two digits: a knee is not known more precisely."""
    return int(round(count, 2 - len(str(count)))) if count >= 100 else count
