"""What is known of a stroke that means the same in every scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64, Rows


@dataclass(frozen=True, eq=False)
class StrokeFeatures:
    """Features of strokes by name.

    Attributes:
        names: of the F features.
        values: [N, F] finite.
    """

    names: tuple[str, ...]
    values: F64

    def __len__(self) -> int:
        return len(self.values)

    def take(self, rows: Rows | slice | NDArray[np.bool_]) -> "StrokeFeatures":
        """Those of some strokes."""
        return StrokeFeatures(self.names, self.values[rows])

    def columns(self, names: tuple[str, ...]) -> F64:
        """[N, len(names)] the features of these names, in their order.

        Raises:
            KeyError: if there is no such feature.
        """
        row_of = {name: row for row, name in enumerate(self.names)}
        return self.values[:, [row_of[name] for name in names]]
