"""The derivative of `project` on NumPy arrays: gradients of a loss by the boxes in, by the Gaussians out.

What `brushgs.autograd` puts behind torch tensors; it needs no torch itself. `v_name` is the gradient of the
loss by `name` and has its shape. The arithmetic is in the compiled core, which projects once more.
"""

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs import _core
from brushgs.arrays import Array
from brushgs.options.choices import ViewLock
from brushgs.rendering.gradients import BOX_COLUMNS, GAUSSIAN_COLUMNS, BoxGradients, GaussianGradients
from brushgs.rendering.project import Directions
from brushgs.scene import Camera, Gaussians
from brushgs.threads import num_threads_or_default


def project_backward(
    gaussians: Gaussians,
    camera: Camera,
    ids: NDArray[np.int32],
    colors: Array,
    v_boxes: BoxGradients,
    *,
    num_sigmas: float = 2.0,
    low_pass: float = 0.3,
    lock: ViewLock | Directions = "off",
    fade: bool = False,
    wanted: Collection[str] = GAUSSIAN_COLUMNS,
    num_threads: int | None = None,
) -> GaussianGradients:
    """Gradients by the Gaussians of what `project` made of them.

    The derivative is that of the value computed, where it has one. Elsewhere:

    - Which Gaussians have a box, and the order of boxes, have no derivative: rows without a box get zeros.
    - A channel of a colour that was cut at 0 passes nothing on.
    - Outside 1.3 times the field of view, where the Jacobian is held, its gradient by the position is 0.
    - Of a round ellipse (its direction below rounding, 1e-14) the angle passes nothing on. Just above, its
      gradient grows like one over the anisotropy: that is its derivative.
    - `Directions` stay as they are: the angle passes nothing on.
    - Which of the own axes is longest (`lock="anchor"`) is held.

    Args:
        gaussians: as projected.
        camera: as projected.
        ids: [M] of the boxes that `project` made of them, like the next.
        colors: [M, 3].
        v_boxes: the gradient by the boxes.
        num_sigmas: as projected.
        low_pass: as projected.
        lock: as projected.
        fade: as projected.
        wanted: the columns whose gradients are computed.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        The columns asked for. Bands of spherical harmonics that are all zero, and skipped by `project`, too.
    """
    given = lock if isinstance(lock, Directions) else None
    columns = {name: getattr(gaussians, name) for name in GAUSSIAN_COLUMNS}
    outputs: dict[str, Any] = {
        name: np.zeros(column.shape, column.dtype) if name in wanted else None
        for name, column in columns.items()
    }
    _core.project_backward(
        gaussians.means,
        gaussians.quats,
        gaussians.scales,
        gaussians.opacities,
        gaussians.sh,
        camera.viewmat,
        camera.K,
        int(camera.width),
        int(camera.height),
        float(camera.near),
        float(num_sigmas),
        float(low_pass),
        num_threads_or_default(num_threads),
        _core.Lock.given if given is not None else getattr(_core.Lock, str(lock)),
        None if given is None else given.angles,
        None if given is None else given.area_scales,
        bool(fade),
        ids,
        colors,
        *(getattr(v_boxes, name) for name in BOX_COLUMNS),
        *outputs.values(),
    )
    return GaussianGradients(**outputs)
