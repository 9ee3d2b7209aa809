"""The motif of a drawing: what its scene looks like without the lamp, for the half-closed eye."""

from dataclasses import dataclass

import numpy as np

from brushgs.rendering.plain import PlainViews
from brushgs.values.arrays import F64

# Share of the squinted values that a lamp of full strength may take: it models a form, and gives a flat one
# its light and shade, but what is dark in a scene stays dark. At the usual strength values keep 0.95.
TAKEN = 0.41
MOST_VIEWS = 3


@dataclass(frozen=True, eq=False)
class Motif:
    """Plain pictures of a scene, and how far a drawing of it keeps their values.

    Attributes:
        views: at least one.
        kept: least correlation of squinted values, 0 to 1.
    """

    views: PlainViews
    kept: float

    @classmethod
    def of(cls, views: PlainViews, key: float, num_own: int) -> "Motif":
        """By the guide views of a job, of which the first are its own, and the strength of the lamp."""
        rows = np.unique(np.linspace(0, num_own - 1, MOST_VIEWS).astype(int))
        cameras, frames = (tuple(each[row] for row in rows) for each in (views.cameras, views.frames))
        return cls(PlainViews(cameras, frames), 1 - TAKEN * key**2)

    def held(self, lit: F64, plain: F64, weight: F64) -> F64:
        """[H, W] lit values, mixed with plain ones [H, W] until they correlate enough by weights [H, W]."""
        total = max(float(weight.sum()), 1e-9)

        def standard(values: F64) -> tuple[F64, float, float]:
            mean = float((weight * values).sum()) / total
            spread = float(np.sqrt((weight * (values - mean) ** 2).sum() / total))
            return (values - mean) / max(spread, 1e-9), mean, spread

        (own, mean, spread), (aim, _, _) = standard(lit), standard(plain)
        found = float((weight * own * aim).sum()) / total
        if spread == 0 or found >= self.kept or not aim.any():
            return lit
        across = np.sqrt(max(1 - found**2, 0) / max(1 - self.kept**2, 1e-9))
        mixed, _, _ = standard(own + (across * self.kept - found) * aim)
        return np.asarray(mean + spread * mixed)
