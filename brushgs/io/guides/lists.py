"""Guides as JSON: a list of lines, each a list of points [x, y, z]; or an object with "guides" and "reach".

{"reach": 0.5, "guides": [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 2, 0], [0, 2, 1]]]}
"""

from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.io.guides.guide_file import CURE, Guides, guides_of
from brushgs.io.json_file import SMALL_OBJECT
from brushgs.io.schema import decode
from brushgs.values.arrays import F64

EXAMPLE = "write lines such as [[[0, 0, 0], [1, 0, 0]]]"
_Point = Annotated[list[float], Meta(min_length=3, max_length=3, description="a point [x, y, z]")]
_Line = Annotated[list[_Point], Meta(description="a list of points [x, y, z]")]
_Lines = Annotated[list[_Line], Meta(description="a list of lines")]


class _File(Struct, forbid_unknown_fields=True):
    guides: _Lines
    reach: float | None = None


def read(path: Path, content: bytes) -> Guides:
    """The guides of a JSON file. Raises SceneError, see `read_guides`."""
    if content.lstrip()[:1] == b"{":
        file = decode(path, content, _File, EXAMPLE, object_bytes=SMALL_OBJECT)
    else:
        lines = decode(path, content, _Lines, EXAMPLE, root="lines", object_bytes=SMALL_OBJECT)
        file = _File(lines)
    points: F64 = np.array([point for line in file.guides for point in line], dtype=np.float64)
    if not len(points):
        raise SceneError(path, f"holds no line; {CURE}")
    is_first = np.array([row == 0 for line in file.guides for row in range(len(line))])
    ends = np.flatnonzero(~is_first)
    segments = np.stack([ends - 1, ends], axis=1)
    return guides_of(path, points, segments, file.reach)
