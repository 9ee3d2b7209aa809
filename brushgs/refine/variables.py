"""Strokes as parameters of an optimizer, and back.

Scales are optimized as logarithms and opacities as logits, so that they stay in range. Rows outside the mask
and columns outside the chosen set come back bit for bit.
Source: Kerbl et al. 2023, section 5 (parameters and their learning rates).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import brushgs.autograd as ba
from brushgs.options.choices import Params
from brushgs.passes.extent import robust_frame
from brushgs.refine.adam import Adam
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

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
