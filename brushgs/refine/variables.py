"""The numbers of strokes that an optimiser moves, and back to Gaussians.

Scales are moved as logarithms and opacities as logits, so that they stay in range; what does not move is
never touched: rows outside a mask and columns outside the chosen set come back bit for bit.
Source: Kerbl et al. 2023, section 5 (parameters and their learning rates).
"""

from dataclasses import dataclass, fields

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

import brushgs.autograd as ba
from brushgs.options.choices import Params
from brushgs.passes.extent import robust_frame
from brushgs.scene import Gaussians

# Names of the columns that each set moves.
MOVING: dict[Params, tuple[str, ...]] = {
    "colour": ("base", "bands"),
    "free": ("base", "bands", "means", "scales", "quats"),
    "all": ("base", "bands", "means", "scales", "quats", "opacities"),
}
LEAST_SCALE = 1e-7  # of the scene's radius: a scale of zero has no logarithm
# Neither end of the opacities has a logit. The kernel holds alphas at 0.99, so nothing is seen of the upper
# limit, and a stroke as solid as that finds its way back: at 0.9999 its logit is twice as far up.
LEAST_OPACITY, MOST_OPACITY = 1e-4, 0.99


@dataclass(frozen=True)
class Rates:
    """Learning rates of Adam, per step: how far a number may go.

    Attributes:
        means: in sizes of the stroke itself, its middle scale: large strokes go further.
        scales: of the logarithm.
        quats: of the unit quaternion.
        opacities: of the logit.
        base: of the view-independent SH coefficient.
        bands: of the others.
    """

    means: float = 0.02
    scales: float = 0.01
    quats: float = 0.01
    opacities: float = 0.03
    base: float = 0.01
    bands: float = 0.002


class Variables:
    """Strokes as tensors, of which some are moved.

    Attributes:
        moving: name -> leaf tensor with a gradient.
        moves: [N] rows that may change.
    """

    def __init__(self, strokes: Gaussians, params: Params, moves: NDArray[np.bool_] | None = None) -> None:
        """Make tensors of strokes.

        Args:
            strokes: N Gaussians; not changed.
            params: which columns move.
            moves: [N] which rows move; None for all.
        """
        self.strokes = strokes
        self.moves = np.ones(len(strokes), dtype=bool) if moves is None else moves
        radius = robust_frame(strokes.means)[1]
        rows = strokes.take(self.moves)
        quats = rows.quats / np.linalg.norm(rows.quats, axis=1, keepdims=True)
        start = {
            "means": np.zeros_like(rows.means),  # away from where they were, in own sizes
            "scales": np.log(np.maximum(rows.scales, LEAST_SCALE * radius)),
            "quats": quats,
            "opacities": _logit(np.clip(rows.opacities, LEAST_OPACITY, MOST_OPACITY)),
            "base": rows.sh[:, :1],
            "bands": rows.sh[:, 1:],
        }
        self.moving = {
            name: torch.tensor(start[name]).requires_grad_() for name in MOVING[params] if start[name].size
        }
        self._fixed = {f.name: torch.tensor(getattr(strokes, f.name)) for f in fields(strokes)}
        self._rows = torch.from_numpy(np.flatnonzero(self.moves))
        sizes = np.maximum(np.sort(rows.scales, axis=1)[:, 1:2], LEAST_SCALE * radius)
        self._homes, self._sizes = torch.tensor(rows.means), torch.tensor(sizes)

    def optimizer(self, rates: Rates) -> torch.optim.Adam:
        """Adam with a group for each name, its rate also under "initial_lr"."""
        groups = [
            {"params": [value], "lr": getattr(rates, name), "initial_lr": getattr(rates, name), "name": name}
            for name, value in self.moving.items()
        ]
        return torch.optim.Adam(groups, betas=(0.9, 0.99), eps=1e-15)

    def gaussians(self) -> ba.Gaussians:
        """The strokes as they are now, with gradients to what moves."""
        now = dict(self._fixed)
        for name, column in self._columns().items():
            now[name] = column if self.moves.all() else now[name].index_put((self._rows,), column)
        return ba.Gaussians(**now)

    def result(self) -> Gaussians:
        """The strokes as they are now; what did not move is what came in, bit for bit."""
        now = {f.name: getattr(self.strokes, f.name).copy() for f in fields(self.strokes)}
        for name, column in self._columns().items():
            now[name][self.moves] = column.detach().numpy()
        return Gaussians(**now)

    def _columns(self) -> dict[str, Tensor]:
        """The columns that move, of the rows that move, decoded."""
        raw, columns = self.moving, {}
        if "means" in raw:
            columns["means"] = self._homes + self._sizes * raw["means"]
            columns["quats"] = raw["quats"]
            columns["scales"] = raw["scales"].exp()
        if "opacities" in raw:
            columns["opacities"] = raw["opacities"].sigmoid()
        if "base" in raw:
            columns["sh"] = torch.cat([raw["base"], raw["bands"]], 1) if "bands" in raw else raw["base"]
        return columns


def _logit(shares: NDArray[np.floating]) -> NDArray[np.floating]:
    return np.asarray(np.log(shares) - np.log1p(-shares), dtype=shares.dtype)
