"""Guides as JSON: a list of lines, each a list of points [x, y, z]; or an object with "guides" and "reach".

{"reach": 0.5, "guides": [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 2, 0], [0, 2, 1]]]}
"""

from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.guides.guide_file import CURE, Guides, guides_of
from brushgs.io.json_file import SMALL_OBJECT, decode_json, shown

EXAMPLE = "write lines such as [[[0, 0, 0], [1, 0, 0]]]"


def read(path: Path, content: bytes) -> Guides:
    """The guides of a JSON file. Raises SceneError, see `read_guides`."""
    value = decode_json(path, content, EXAMPLE, object_bytes=SMALL_OBJECT)
    reach = None
    if isinstance(value, dict):
        unknown = sorted(set(value) - {"guides", "reach"})
        if unknown or "guides" not in value:
            fact = f"must hold 'guides', and may hold 'reach', got {shown(value)}"
            raise SceneError(path, f"{fact}; {EXAMPLE}")
        reach = value.get("reach")
        if reach is not None and (isinstance(reach, bool) or not isinstance(reach, float)):
            raise SceneError(path, f"'reach' must be a number, got {shown(reach)}; correct it")
        value = value["guides"]
    if not isinstance(value, list):
        raise SceneError(path, f"must hold a list of lines, got {shown(value)}; {EXAMPLE}")
    points: list[object] = []
    is_first: list[bool] = []
    for number, line in enumerate(value, 1):
        if not isinstance(line, list) or not all(_is_point(point) for point in line):
            fact = f"line {number} must be a list of points [x, y, z], got {shown(line)}"
            raise SceneError(path, f"{fact}; {EXAMPLE}")
        is_first += [row == 0 for row in range(len(line))]
        points += line
    if not points:
        raise SceneError(path, f"holds no line; {CURE}")
    ends = np.flatnonzero(~np.array(is_first))
    segments = np.stack([ends - 1, ends], axis=1)
    return guides_of(path, np.array(points, dtype=np.float64), segments, reach)


def _is_point(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(type(number) is float for number in value)
