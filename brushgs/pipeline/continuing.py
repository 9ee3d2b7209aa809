"""The pass of `--continue`: learnt from the first strokes it receives, then applied unchanged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from brushgs.pipeline.report import Stage
from brushgs.pipeline.stroke_pass import StrokePass
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Marks

if TYPE_CHECKING:
    from brushgs.passes.marks.learn import Continuation

NO_MARKS = "the marks hold no paint, so there is nothing to continue"
NO_STROKES = "the marks cover no stroke, so there is nothing to continue"


@dataclass(eq=False)
class ContinuePass(StrokePass):
    """A pass that reports how many strokes it found like painted ones.

    Attributes:
        changed: strokes of the last call.
    """

    changed: int = 0

    @classmethod
    def of(cls, marks: Marks | None, first_view: Callable[[], FirstView]) -> "ContinuePass":
        """The pass for marks.

        Args:
            marks: all that are laid; None for none.
            first_view: of the scene.
        """
        learnt: list[Continuation | None] = []

        def continued(strokes: Gaussians) -> Gaussians:
            from brushgs.passes.marks.learn import learn

            if not learnt and len(strokes):
                assert marks is not None, "see skip"
                learnt.append(learn(strokes, marks, first_view()))
                made.skip = NO_STROKES if learnt[0] is None else None
            if not learnt or learnt[0] is None:
                return strokes
            after, made.changed = learnt[0](strokes)
            return after

        has_marks = marks is not None and len(marks) > 0
        made = cls("continue", "", continued, None if has_marks else NO_MARKS)
        return made

    def _describe(self, stage: Stage) -> None:
        self.what = f"looked at, {self.changed:,} painted like those below the marks"
        self.counts: dict[str, Any] = {"changed": self.changed}
        super()._describe(stage)
