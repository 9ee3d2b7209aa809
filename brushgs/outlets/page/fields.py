"""Fields of directions (`rendering/canonical.py`) as a column of a page: six bytes for each stroke.

The two vectors of a field are the first two axes of a frame; stored is the turn to it from the axes of the
stroke, so a field turns with its stroke where that moves. Of the unit quaternion of a turn, the component of
largest size follows from the other three. `quaternionsOfCodes` in `web/matrix.js` reads the column.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.values.quats import quats_of, rotation_matrices

if TYPE_CHECKING:
    from brushgs.rendering.canonical import Canonical
    from brushgs.values.gaussians import Gaussians

BITS = 14  # of a component; 10 turn strokes by more than a degree near their singular views, 14 do not
LEVELS = 2**BITS - 1
LARGEST = np.sqrt(0.5)  # of a component that is not the largest


def field_codes(fields: "Canonical", strokes: "Gaussians") -> NDArray[np.uint16]:
    """[N, 3] codes of fields.

    Three components of the quaternion w, x, y, z in their order, 14 bits each from -`LARGEST` to `LARGEST`;
    the two highest bits of the first code say which was left out. Three zeros, which are no rotation, stand
    for a stroke that follows its longest axis.
    """
    frames = np.stack([fields.facing, fields.along, np.cross(fields.facing, fields.along)], axis=2)
    quats = quats_of(rotation_matrices(strokes.quats).transpose(0, 2, 1) @ frames)
    omitted = np.abs(quats).argmax(axis=1)
    largest = np.take_along_axis(quats, omitted[:, None], axis=1)
    others = (np.arange(3) + (np.arange(3) >= omitted[:, None])).astype(np.intp)
    components = np.take_along_axis(quats, others, axis=1) * np.where(largest < 0, -1, 1)
    codes: NDArray[np.uint16] = (
        np.rint((components / LARGEST + 1) * (0.5 * LEVELS)).clip(0, LEVELS).astype(np.uint16)
    )
    codes[:, 0] |= (omitted << BITS).astype(np.uint16)
    codes[fields.is_anchored] = 0
    return codes
