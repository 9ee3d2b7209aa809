"""The optimization loop of every refinement: Adam steps, a decaying learning rate, evaluations, checkpoints.

Equal strokes, views and seed give bit-identical fits, also after stop and resume, and for any number of
threads.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from math import cos, pi

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.brushes.brush_set import Brushes
from brushgs.core.signals import defer_stop
from brushgs.refine.checkpoint import SECONDS_BETWEEN_CHECKPOINTS, Checkpoint
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Rates, Variables
from brushgs.rendering.motion import StrokeMotion
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

LAST_RATE = 0.05  # learning rate of the last step over that of the first; half a cosine in between
NUM_EVALUATIONS = 20  # over all steps, besides the one before the first step
# The fit ends early if this many evaluations in a row gain less than this many dB together; 0.1 dB is
# invisible. Never in its first half, because lower rates later settle what high ones scatter.
PATIENCE, LEAST_GAIN = 5, 0.05

Objective = Callable[
    [ba.Frame, TargetView, ba.Gaussians], Tensor
]  # (painted frame, its view, strokes at their reference moments) -> loss


def no_progress(score: float) -> None:
    """An `on_step` that reports nothing."""


@dataclass(frozen=True)
class Drawing:
    """Rendering of strokes, in the fit as in the painting.

    Attributes:
        texture: the brush or brushes.
        options: see `RenderOptions`; the order is "depth", the only one with a gradient.
        motion: of the strokes, constant in the fit; None for still strokes.
        takes_light: whether strokes follow color changes over time.
    """

    texture: Brushes
    options: RenderOptions
    motion: StrokeMotion | None = None
    takes_light: bool = True

    @classmethod
    def of(
        cls,
        texture: Brushes,
        options: RenderOptions | None = None,
        motion: StrokeMotion | None = None,
        *,
        takes_light: bool = True,
    ) -> "Drawing":
        """A drawing by depth order, without a depth image; other options default to those of `render`.

        The locks "track" and "canonical" become the axes' own direction: single views have no path, and
        directions of fields have no gradient.
        """
        options = options or RenderOptions.of(texture)
        lock = "anchor" if options.lock in ("track", "canonical") else options.lock
        return cls(texture, replace(options, lock=lock, order="depth", depth=False), motion, takes_light)

    def frame(self, strokes: Gaussians, camera: Camera, moment: int | None = None) -> Frame:
        """Paint strokes in a view; `moment` is a row of the moments of the motion."""
        if self.motion is not None and moment is not None:
            strokes = self.motion.pose(moment).moved(strokes, has_color=self.takes_light)
        return render_with(strokes, camera, self.texture, self.options)

    def tensors(self, strokes: ba.Gaussians, camera: Camera, moment: int | None = None) -> ba.Frame:
        """Paint strokes in a view, see `frame`, with gradients."""
        if self.motion is not None and moment is not None:
            strokes = ba.moved(strokes, self.motion.pose(moment), has_color=self.takes_light)
        options = self.options
        assert options.lock != "track", "one view has no path to track"
        assert options.lock != "canonical", "see `of`"
        return ba.render(
            strokes,
            camera,
            self.texture,
            lock=options.lock,
            filter=options.filter,
            num_sigmas=options.num_sigmas,
            low_pass=options.low_pass,
            depth=options.depth,
            underpaint=options.underpaint or False,
            streaks=options.streaks,
            num_threads=options.num_threads,
        )


@dataclass
class LossCurve:
    """Loss and score over the steps of a fit, one entry per evaluation.

    Attributes:
        steps: [M] steps done until each evaluation.
        seconds: [M] of these steps; evaluations themselves are not counted.
        losses: [M] mean loss of the steps since the previous evaluation; NaN before the first step.
        scores: [M] in dB, higher is better.
        stopped: why the fit ended.
    """

    steps: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    stopped: str = ""


@dataclass(frozen=True)
class FitSchedule:
    """Number of steps, learning rates and checkpoint of a fit.

    Attributes:
        steps: maximum, >= 1.
        rates: learning rates of the first step.
        seed: of the order of the views.
        evaluations: over all steps, besides the one before the first step.
        checkpoint: written every `SECONDS_BETWEEN_CHECKPOINTS`, at the end and on a stop; the fit starts from
            its state, if any. Or None.
    """

    steps: int
    rates: Rates = field(default_factory=Rates)
    seed: int = 0
    evaluations: int = NUM_EVALUATIONS
    checkpoint: Checkpoint | None = None


class Fit:
    """The state of one fit; `run` executes it."""

    def __init__(
        self,
        variables: Variables,
        views: Sequence[TargetView],
        drawing: Drawing,
        objective: Objective,
        score: Callable[[Gaussians], float],
        schedule: FitSchedule,
    ) -> None:
        """Set up a fit.

        Args:
            variables: strokes to optimize.
            views: n views, painted in turn.
            drawing: how strokes are drawn.
            objective: loss of one painted view, to be minimized.
            score: evaluation of strokes in dB, higher is better; its views should not be among `views`.
            schedule: how long.
        """
        self.variables, self.views, self.drawing = variables, views, drawing
        self.objective, self.score, self.schedule = objective, score, schedule
        self.optimizer = variables.optimizer(schedule.rates)
        self.curve, self.step = LossCurve(), 0
        self._best: tuple[float, list[Tensor]] | None = None  # best of the evaluations after the first
        self._recent_losses: list[float] = []  # of the steps since the last evaluation
        self._seconds = 0.0

    def run(self, on_step: Callable[[float], None] = no_progress) -> Gaussians:
        """Do the fit.

        Args:
            on_step: called after every step with the latest score.

        Returns:
            The strokes with the highest score, never below that of the input.

        Raises:
            SceneError: if a checkpoint cannot be written, or does not match these variables.
            KeyboardInterrupt: if it is stopped, after its checkpoint is written.
        """
        self._load()
        try:
            with _one_thread():
                self._run_steps(on_step)
        except KeyboardInterrupt:  # between two steps
            self._save()
            raise
        self._save()
        if self._best is None or self._best[0] < self.curve.scores[0]:
            return self.variables.strokes
        for value, best in zip(self.variables.moving.values(), self._best[1], strict=True):
            value.data.copy_(best)
        return self.variables.result()

    def _run_steps(self, on_step: Callable[[float], None]) -> None:
        saved = time.perf_counter()
        every = max(1, self.schedule.steps // self.schedule.evaluations)
        while not self.curve.stopped:
            is_due = self.step % every == 0 or self.step == self.schedule.steps
            if is_due and self.step not in self.curve.steps[-1:]:  # not twice after resuming
                self._evaluate()
            if self.curve.stopped:
                break
            with defer_stop():  # steps must be complete to be resumed
                start = time.perf_counter()
                self._step()
                self._seconds += time.perf_counter() - start
            on_step(self.curve.scores[-1])
            if time.perf_counter() - saved > SECONDS_BETWEEN_CHECKPOINTS:
                self._save()
                saved = time.perf_counter()

    def _step(self) -> None:
        share = self.step / self.schedule.steps
        factor = LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + cos(pi * share))
        view = self.views[self._view()]
        strokes = self.variables.gaussians()
        frame = self.drawing.tensors(strokes, view.camera, view.moment)
        loss = self.objective(frame, view, strokes)
        loss.backward()
        self.optimizer.step(factor)
        self._recent_losses.append(float(loss.detach()))
        self.step += 1

    def _view(self) -> int:
        """The view of this step: each once per round, shuffled by seed and round."""
        round_, place = divmod(self.step, len(self.views))
        return int(np.random.default_rng((self.schedule.seed, round_)).permutation(len(self.views))[place])

    def _evaluate(self) -> None:
        is_first = not self.curve.scores
        score = self.score(self.variables.strokes if is_first else self.variables.result())
        with defer_stop():
            self._record(score)

    def _record(self, score: float) -> None:
        curve, is_first = self.curve, not self.curve.scores
        curve.steps.append(self.step)
        curve.seconds.append(round(self._seconds, 3))
        curve.losses.append(float(np.mean(self._recent_losses)) if self._recent_losses else float("nan"))
        curve.scores.append(score)
        self._recent_losses = []
        if not is_first and (self._best is None or score > self._best[0]):
            self._best = score, [value.detach().clone() for value in self.variables.moving.values()]
        if self.step == self.schedule.steps:
            curve.stopped = f"all {self.step} steps are done"
        elif (
            len(curve.scores) > PATIENCE
            and 2 * self.step >= self.schedule.steps
            and max(curve.scores[-PATIENCE:]) - max(curve.scores[:-PATIENCE]) < LEAST_GAIN
        ):
            curve.stopped = f"the last {PATIENCE} evaluations gained less than {LEAST_GAIN} dB together"

    def _save(self) -> None:
        if self.schedule.checkpoint is None or not self.step:
            return
        state = {
            "step": self.step,
            "seconds": self._seconds,
            "since": self._recent_losses,
            "curve": asdict(self.curve),
            "best": self._best,
            "moving": {name: value.detach() for name, value in self.variables.moving.items()},
            "optimizer": self.optimizer.state(),
        }
        self.schedule.checkpoint.save(state)

    def _load(self) -> None:
        checkpoint = self.schedule.checkpoint
        if checkpoint is None or checkpoint.state is None:
            return
        state = checkpoint.state
        try:
            for name, value in self.variables.moving.items():
                if state["moving"][name].shape != value.shape:
                    raise ValueError(f"{name} has another shape")
                value.data.copy_(state["moving"][name])
            self.optimizer.restore(state["optimizer"])
            self.step, self._seconds, self._recent_losses = state["step"], state["seconds"], state["since"]
            self.curve, self._best = LossCurve(**state["curve"]), state["best"]
        except (ValueError, KeyError, TypeError, AttributeError, RuntimeError) as error:
            raise checkpoint.unreadable(error) from None


@contextmanager
def _one_thread() -> Iterator[None]:
    """PyTorch on one thread, since its sums depend on the number of threads; rasterizing keeps all threads.

    Its threads also busy-wait: on two shared cores a style step took 6.9 s with two threads and 0.6 s with
    one.
    """
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
