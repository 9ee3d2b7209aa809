"""Inputs of the coat of a stage, besides the materials of its medium."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.passes.add.stage import Stage
from brushgs.passes.add.stage_marks import Marking, shadow_marks, table_edge
from brushgs.passes.add.stage_paint import Brushwork, painted_stage
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class Staging:
    """A stage and how it is painted.

    Attributes:
        stage: table, wall, shadow and tones.
        brushwork: how strokes are painted.
        cameras: of the job, at least one.
        finished: applies the brushes and color changes of the subject to strokes.
        seed: of random numbers.
    """

    stage: Stage
    brushwork: Brushwork
    cameras: Sequence[Camera]
    finished: Callable[[Gaussians], Gaussians]
    seed: int

    def painted(self) -> Gaussians:
        """Its strokes, float32."""
        return painted_stage(self.stage, self.brushwork, self.cameras, seed=self.seed).astype(np.float32)

    def shadow(self, marking: Marking) -> Gaussians:
        """The marks of its shadow, float32."""
        stage = self.stage
        marks = shadow_marks(stage.place, stage.shadow, self.cameras, marking, seed=self.seed)
        return marks.astype(np.float32)

    def table_edge(self) -> Gaussians:
        """Lines along the edge of its table, float32."""
        stage = self.stage
        return table_edge(stage.place, stage.surface, self.cameras, seed=self.seed).astype(np.float32)
