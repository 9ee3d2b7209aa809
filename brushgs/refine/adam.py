"""Adam, the optimizer of every fit.

Bit-identical to `torch.optim.Adam`, whose constructor loads torch's compiler: 800 modules, one second.
Source: Kingma and Ba 2015, algorithm 1.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Any

import torch
from torch import Tensor

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
