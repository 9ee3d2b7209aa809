"""Files as Dynamic3DGaussians writes them; nothing here comes from its reader."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

C0 = 0.28209479177387814


def params(num_moments: int, num_rows: int, seed: int = 0) -> dict[str, np.ndarray]:
    """Arrays of a clip, as its trainer saves them."""
    rng = np.random.default_rng([20261122, seed])

    def walk(*shape: int) -> np.ndarray:
        steps = rng.normal(0, 0.02, (num_moments, *shape))
        return (rng.normal(size=shape) + np.cumsum(steps, axis=0)).astype(np.float32)

    moved = {"means3D": walk(num_rows, 3), "unnorm_rotations": walk(num_rows, 4)}
    moved |= {"rgb_colors": walk(num_rows, 3), "seg_colors": rng.random((num_rows, 3)).astype(np.float32)}
    kept = {"log_scales": rng.normal(-4, 0.3, (num_rows, 3)), "cam_m": np.zeros((27, 3))}
    kept |= {"logit_opacities": rng.normal(size=(num_rows, 1)), "cam_c": np.zeros((27, 3))}
    return moved | {name: values.astype(np.float32) for name, values in kept.items()}


def write_params(path: Path, moments: Sequence[Any]) -> Path:
    """A clip of the Gaussians of moments whose rows correspond; colors without view dependence."""
    first = moments[0]
    with np.errstate(divide="ignore"):
        logits = np.log(first.opacities) - np.log1p(-first.opacities)
    arrays = {"log_scales": np.log(first.scales), "logit_opacities": logits[:, None]}
    arrays["means3D"] = np.stack([moment.means for moment in moments])
    arrays["unnorm_rotations"] = np.stack([moment.quats for moment in moments])
    np.savez(path, rgb_colors=np.stack([0.5 + C0 * moment.sh[:, 0] for moment in moments]), **arrays)
    return path
