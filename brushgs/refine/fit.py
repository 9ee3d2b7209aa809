"""One way to move strokes downhill, whatever the objective: steps, a falling rate, looks, checkpoints.

The same strokes, views and seed give the same fit, bit for bit, also when it was stopped and gone on with;
sums of PyTorch may depend on its number of threads, of which `distil` takes one.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import cos, pi
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.refine.variables import Rates, Variables
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.scene import Camera, Frame, Gaussians

LAST_RATE = 0.05  # of the first, at the last step, along half a cosine
LOOKS = 20  # at the error, over all steps
# Looks in a row that bring less than this together end the fit: the eye sees no tenth of a decibel. Not in
# its first half: what high rates throw about, falling ones settle.
PATIENCE, LEAST_GAIN = 5, 0.05
SECONDS_BETWEEN_CHECKPOINTS = 20.0

Objective = Callable[[ba.Frame, int, ba.Gaussians], Tensor]  # painted frame, number of the view, strokes


@dataclass(frozen=True)
class Drawing:
    """How the strokes are drawn, in the fit as in the painting.

    Attributes:
        texture: the stroke image.
        options: see `RenderOptions`; the order is "depth", the only one with a gradient.
    """

    texture: StrokeTexture
    options: RenderOptions

    @classmethod
    def of(cls, texture: StrokeTexture, options: RenderOptions | None = None) -> "Drawing":
        """Without depth, and nearer strokes before others; by default as `render` draws."""
        options = options or RenderOptions.of(texture)
        return cls(texture, replace(options, order="depth", depth=False))

    def frame(self, strokes: Gaussians, camera: Camera) -> Frame:
        """The strokes as a camera sees them."""
        return render_with(strokes, camera, self.texture, self.options)

    def tensors(self, strokes: ba.Gaussians, camera: Camera) -> ba.Frame:
        """The same with gradients."""
        options = self.options
        assert options.lock != "track", "one view has no path to track"
        return ba.render(
            strokes,
            camera,
            self.texture,
            lock=options.lock,
            filter=options.filter,
            num_sigmas=options.num_sigmas,
            low_pass=options.low_pass,
            depth=options.depth,
            num_threads=options.num_threads,
        )


@dataclass
class Curve:
    """Error against run time.

    Attributes:
        steps: [M] done until each look.
        seconds: [M] of steps until then; the looks themselves are not counted.
        losses: [M] mean loss of the steps since the look before; NaN where no step was done yet.
        scores: [M] what the look found, in dB; the higher the better.
        stopped: why the fit ended.
    """

    steps: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    losses: list[float] = field(default_factory=list)
    scores: list[float] = field(default_factory=list)
    stopped: str = ""


@dataclass(frozen=True)
class Plan:
    """How long a fit goes on, and where it may be picked up again.

    Attributes:
        steps: at most so many, >= 1.
        rates: of the first step.
        seed: of the order of the views.
        checkpoint: file that is written now and then, and gone at the end; None for none.
        is_resumed: whether a fit is gone on with where the file says.
    """

    steps: int
    rates: Rates = field(default_factory=Rates)
    seed: int = 0
    checkpoint: Path | None = None
    is_resumed: bool = False


class Fit:
    """A fit on its way; `run` does it."""

    def __init__(
        self,
        variables: Variables,
        cameras: Sequence[Camera],
        drawing: Drawing,
        objective: Objective,
        score: Callable[[Gaussians], float],
        plan: Plan,
    ) -> None:
        """Set up a fit.

        Args:
            variables: strokes to move.
            cameras: n views that are painted in turn.
            drawing: how.
            objective: what is to fall.
            score: what a look finds, higher is better; validation_views strokes by other views than these.
            plan: how long.
        """
        self.variables, self.cameras, self.drawing = variables, cameras, drawing
        self.objective, self.score, self.plan = objective, score, plan
        self.optimizer = variables.optimizer(plan.rates)
        self.curve, self.step = Curve(), 0
        self._best: tuple[float, list[Tensor]] | None = None  # of the looks after the first
        self._since: list[float] = []
        self._seconds = 0.0

    def run(self, advance: Callable[[float], None] = lambda score: None) -> Gaussians:
        """Do the fit.

        Args:
            advance: called after every step with the latest score.

        Returns:
            The strokes of the best look: never worse by the score than those that came in.
        """
        if self.plan.is_resumed:
            self._load()
        saved = time.perf_counter()
        every = max(1, self.plan.steps // LOOKS)
        while not self.curve.stopped:
            if self.step % every == 0 or self.step == self.plan.steps:
                self._look()
            if self.curve.stopped:
                break
            start = time.perf_counter()
            self._step()
            self._seconds += time.perf_counter() - start
            advance(self.curve.scores[-1])
            if time.perf_counter() - saved > SECONDS_BETWEEN_CHECKPOINTS:
                self._save()
                saved = time.perf_counter()
        if self.plan.checkpoint is not None:
            self.plan.checkpoint.unlink(missing_ok=True)
        if self._best is None or self._best[0] < self.curve.scores[0]:
            return self.variables.strokes
        for value, best in zip(self.variables.moving.values(), self._best[1], strict=True):
            value.data.copy_(best)
        return self.variables.result()

    def _step(self) -> None:
        share = self.step / self.plan.steps
        factor = LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + cos(pi * share))
        for group in self.optimizer.param_groups:
            group["lr"] = factor * group["initial_lr"]
        view = self._view()
        strokes = self.variables.gaussians()
        frame = self.drawing.tensors(strokes, self.cameras[view])
        loss = self.objective(frame, view, strokes)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        self.optimizer.step()
        self._since.append(float(loss.detach()))
        self.step += 1

    def _view(self) -> int:
        """Every view once in a round, in an order by chance that depends on nothing but seed and round."""
        around, place = divmod(self.step, len(self.cameras))
        return int(np.random.default_rng((self.plan.seed, around)).permutation(len(self.cameras))[place])

    def _look(self) -> None:
        curve, is_first = self.curve, not self.curve.scores
        score = self.score(self.variables.strokes if is_first else self.variables.result())
        curve.steps.append(self.step)
        curve.seconds.append(round(self._seconds, 3))
        curve.losses.append(float(np.mean(self._since)) if self._since else float("nan"))
        curve.scores.append(score)
        self._since = []
        if not is_first and (self._best is None or score > self._best[0]):
            self._best = score, [value.detach().clone() for value in self.variables.moving.values()]
        if self.step == self.plan.steps:
            curve.stopped = f"all {self.step} steps are done"
        elif (
            len(curve.scores) > PATIENCE
            and 2 * self.step >= self.plan.steps
            and max(curve.scores[-PATIENCE:]) - max(curve.scores[:-PATIENCE]) < LEAST_GAIN
        ):
            curve.stopped = f"the last {PATIENCE} looks brought less than {LEAST_GAIN} together"

    def _save(self) -> None:
        if self.plan.checkpoint is None:
            return
        state = {
            "step": self.step,
            "seconds": self._seconds,
            "since": self._since,
            "curve": asdict(self.curve),
            "best": self._best,
            "moving": {name: value.detach() for name, value in self.variables.moving.items()},
            "optimizer": self.optimizer.state_dict(),
            "steps": self.plan.steps,
            "seed": self.plan.seed,
        }
        with replacing(self.plan.checkpoint) as path:
            torch.save(state, path)

    def _load(self) -> None:
        path = self.plan.checkpoint
        if path is None or not path.exists():
            return
        try:
            state = torch.load(path, weights_only=True)
            same = state["steps"] == self.plan.steps and state["seed"] == self.plan.seed
            same = same and all(state["moving"][n].shape == v.shape for n, v in self.variables.moving.items())
        except Exception as error:
            raise SceneError(path, f"is no checkpoint ({error}); delete it, or leave out --resume") from None
        if not same:
            raise SceneError(
                path,
                "is the checkpoint of another fit; give the options it was begun with, or leave out --resume",
            )
        for name, value in self.variables.moving.items():
            value.data.copy_(state["moving"][name])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self._seconds, self._since = state["step"], state["seconds"], state["since"]
        self.curve, self._best = Curve(**state["curve"]), state["best"]
