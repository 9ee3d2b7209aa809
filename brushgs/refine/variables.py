"""Strokes as parameters of an optimizer, and back.

Scales are optimized as logarithms and opacities as logits, so that they stay in range. Rows outside the mask
and columns outside the chosen set come back bit for bit.
Source: Kerbl et al. 2023, section 5 (parameters and their learning rates).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import brushgs.autograd as ba
from brushgs.options.choices import Params
from brushgs.passes.extent import robust_frame
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

# Adam, the optimizer of every fit.
#
# Bit-identical to `torch.optim.Adam`, whose constructor loads torch's compiler: 800 modules, one second.
# Source: Kingma and Ba 2015, algorithm 1.


# Decay of the means; and epsilon against division by zero, small enough for gradients of a mean over all
# pixels.
DECAY, DECAY_OF_SQUARES, EPS = 0.9, 0.99, 1e-15


@dataclass(frozen=True, eq=False)
class _Moments:
    """Running means of a parameter's gradient and of its square, in its shape."""

    mean: Tensor
    square: Tensor


class Adam:
    """Parameters, each with its learning rate, and the running means of their gradients."""

    def __init__(
        self, moving: Mapping[str, Tensor], rates: Mapping[str, float], shares: Tensor | None = None
    ) -> None:
        """Take parameters, which `step` changes in place.

        Args:
            moving: name -> leaf tensor with a gradient.
            rates: name -> approximate step size.
            shares: [N] factor on the rates of each row of every parameter [N, ...]; None for 1.
        """
        self._moving, self._rates = dict(moving), dict(rates)
        self._moments = {name: _Moments(_zeros(value), _zeros(value)) for name, value in moving.items()}
        self._steps, self._shares = 0, shares

    def step(self, factor: float) -> None:
        """Move parameters against their gradients, at `factor` times their rates, and drop the gradients."""
        self._steps += 1
        share = 1 - DECAY**self._steps  # bias correction: the means start at zero
        share_of_squares = 1 - DECAY_OF_SQUARES**self._steps
        with torch.no_grad():
            for name, value in self._moving.items():
                gradient = value.grad
                if gradient is None:
                    continue
                moments = self._moments[name]
                moments.mean.lerp_(gradient, 1 - DECAY)
                moments.square.mul_(DECAY_OF_SQUARES).addcmul_(gradient, gradient, value=1 - DECAY_OF_SQUARES)
                size = (moments.square.sqrt() / sqrt(share_of_squares)).add_(EPS)
                mean = moments.mean
                if self._shares is not None:
                    mean = mean * self._shares.to(mean.dtype).view(-1, *(1,) * (mean.ndim - 1))
                value.addcdiv_(mean, size, value=-(factor * self._rates[name] / share))
                value.grad = None

    def state(self) -> dict[str, Any]:
        """State for `restore`: number of steps and means."""
        means = {name: (moments.mean, moments.square) for name, moments in self._moments.items()}
        return {"steps": self._steps, "means": means}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a state of the same parameters.

        Raises:
            KeyError, TypeError, ValueError, RuntimeError: if it is not a valid state.
        """
        for name, moments in self._moments.items():
            mean, square = state["means"][name]
            if mean.shape != moments.mean.shape or square.shape != moments.mean.shape:
                raise ValueError(f"the means of {name} have another shape")
            moments.mean.copy_(mean)
            moments.square.copy_(square)
        self._steps = int(state["steps"])


def _zeros(value: Tensor) -> Tensor:
    return torch.zeros_like(value, requires_grad=False)


# Parameters that each set optimizes.
MOVING: dict[Params, tuple[str, ...]] = {
    "color": ("sh_base", "sh_rest"),
    "free": ("sh_base", "sh_rest", "means", "scales", "quats"),
    "all": ("sh_base", "sh_rest", "means", "scales", "quats", "opacities"),
}
LEAST_SCALE = 1e-7  # over the radius of the scene, for logarithms
# Limits of opacities for logits. The rasterizer limits alpha to 0.99, so the upper limit changes no picture,
# and opacity can still fall from there: the logit of 0.9999 is twice as large.
LEAST_OPACITY, MOST_OPACITY = 1e-4, 0.99


@dataclass(frozen=True)
class Rates:
    """Learning rates of Adam: approximate step sizes.

    Attributes:
        means: relative to the stroke's middle scale, so large strokes move further.
        scales: of the logarithm.
        quats: of the unit quaternion.
        opacities: of the logit.
        sh_base: of the view-independent SH coefficients.
        sh_rest: of the view-dependent ones.
    """

    means: float = 0.02
    scales: float = 0.01
    quats: float = 0.01
    opacities: float = 0.03
    sh_base: float = 0.01
    sh_rest: float = 0.002

    def times(self, factors: Mapping[str, float]) -> "Rates":
        """The rates, some of them (by name) times a factor."""
        return replace(self, **{name: getattr(self, name) * factor for name, factor in factors.items()})


class Variables:
    """Strokes as tensors, some of which are optimized.

    Attributes:
        moving: parameter -> leaf tensor with a gradient.
        moves: [N] mask of the rows that may change.
    """

    def __init__(
        self,
        strokes: Gaussians,
        params: Params,
        moves: NDArray[np.bool_] | None = None,
        shares: F64 | None = None,
    ) -> None:
        """Make tensors of strokes.

        Args:
            strokes: N Gaussians; not changed.
            params: which columns may change.
            moves: [N] mask of the rows that may change; None for all.
            shares: [N] factor on the learning rates of each row; None for 1.
        """
        self.strokes = strokes
        self.moves = np.ones(len(strokes), dtype=bool) if moves is None else moves
        radius = robust_frame(strokes.means)[1]
        rows = strokes.take(self.moves)
        quats = rows.quats / np.linalg.norm(rows.quats, axis=1, keepdims=True)
        start = {
            "means": np.zeros_like(rows.means),  # offsets over the size of the stroke
            "scales": np.log(np.maximum(rows.scales, LEAST_SCALE * radius)),
            "quats": quats,
            "opacities": _logit(np.clip(rows.opacities, LEAST_OPACITY, MOST_OPACITY)),
            "sh_base": rows.sh[:, :1],
            "sh_rest": rows.sh[:, 1:],
        }
        self.moving = {
            name: torch.tensor(start[name]).requires_grad_() for name in MOVING[params] if start[name].size
        }
        self._fixed = {name: torch.tensor(column) for name, column in strokes.columns().items()}
        self._integers = {
            name: torch.tensor(column)
            for name, column in (("brushes", strokes.brushes), ("ids", strokes.ids))
            if column is not None
        }
        self._shares = None if shares is None else torch.from_numpy(shares[self.moves])
        self._rows = torch.from_numpy(np.flatnonzero(self.moves))
        sizes = np.maximum(np.sort(rows.scales, axis=1)[:, 1:2], LEAST_SCALE * radius)
        self._homes, self._sizes = torch.tensor(rows.means), torch.tensor(sizes)

    def optimizer(self, rates: Rates) -> Adam:
        """Adam at these rates."""
        return Adam(self.moving, {name: getattr(rates, name) for name in self.moving}, self._shares)

    def gaussians(self) -> ba.Gaussians:
        """The current strokes, differentiable by `moving`."""
        tensors = dict(self._fixed)
        for name, column in self._columns().items():
            is_whole = self.moves.all()
            tensors[name] = column if is_whole else tensors[name].index_put((self._rows,), column)
        return ba.Gaussians(**tensors, antialiased=self.strokes.antialiased, **self._integers)

    def result(self) -> Gaussians:
        """The current strokes as arrays; fixed values are bit-identical to the input."""
        arrays = {name: column.copy() for name, column in self.strokes.columns().items()}
        for name, column in self._columns().items():
            arrays[name][self.moves] = column.detach().numpy()
        return replace(self.strokes, **arrays)

    def _columns(self) -> dict[str, Tensor]:
        """The columns that may change, of the rows that may change, decoded."""
        raw, columns = self.moving, {}
        if "means" in raw:
            columns["means"] = self._homes + self._sizes * raw["means"]
            columns["quats"] = raw["quats"]
            columns["scales"] = raw["scales"].exp()
        if "opacities" in raw:
            columns["opacities"] = raw["opacities"].sigmoid()
        if "sh_base" in raw:
            columns["sh"] = (
                torch.cat([raw["sh_base"], raw["sh_rest"]], 1) if "sh_rest" in raw else raw["sh_base"]
            )
        return columns


def _logit(shares: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(np.log(shares) - np.log1p(-shares), dtype=shares.dtype)
