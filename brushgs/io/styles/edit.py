"""An edit of a scene, to JSON and from it."""

from typing import Any

import numpy as np

from brushgs.io.styles.arrays import pack, take_array
from brushgs.io.styles.fields import Fields, is_name
from brushgs.values.style import Residual, StyleEdit

MOST_FEATURES = 64
MOST_FACTOR = 1e3  # of the affine map
MOST_LOG_SIZE = 10.0
MOST = 1e9  # of a number of the residual


def to_json(edit: StyleEdit) -> dict[str, Any]:
    """The fields; the residual in single precision."""
    return {
        "affine": [[float(number) for number in row] for row in edit.affine],
        "log_size": float(edit.log_size),
        "residual": None if edit.residual is None else _residual_to_json(edit.residual),
    }


def _residual_to_json(residual: Residual) -> dict[str, Any]:
    return {
        "features": list(residual.features),
        "width": float(residual.width),
        "offset": pack(residual.offset, "float32"),
        "scale": pack(residual.scale, "float32"),
        "centers": pack(residual.centers, "float32"),
        "weights": pack(residual.weights, "float32"),
        "slopes": None if residual.slopes is None else pack(residual.slopes, "float32"),
    }


def of_json(style: Fields) -> StyleEdit:
    """The edit of the fields of a style.

    Raises:
        SceneError: if a field is missing or wrong.
    """
    fields = style.inner("edit")
    affine = take_array(fields, "affine", (3, 4), MOST_FACTOR)
    log_size = fields.number("log_size", -MOST_LOG_SIZE, MOST_LOG_SIZE, 0.0)
    residual = _residual_of_json(fields.inner("residual")) if "residual" in fields else None
    fields.end()
    return StyleEdit(affine, log_size, residual)


def _residual_of_json(fields: Fields) -> Residual:
    names = fields.entries("features", "names of features", 1, MOST_FEATURES)
    for name in names:
        if not isinstance(name, str) or not is_name(name) or names.count(name) > 1:
            fields.refuse("features", "different names of features", name)
    width = fields.number("width", 0, MOST, above=True)
    offset, scale = (take_array(fields, name, (len(names),), MOST) for name in ("offset", "scale"))
    if not (scale > 0).all():
        fields.refuse("scale", "numbers above 0", float(scale.min()))
    centers = take_array(fields, "centers", (None, len(names)), MOST)
    weights = take_array(fields, "weights", (len(centers), None), MOST)
    if weights.shape[1] < 3:
        fields.refuse("weights", "of 3 outputs or more", [float(side) for side in weights.shape])
    slopes = None
    if "slopes" in fields:
        slopes = take_array(fields, "slopes", (len(centers), 3, 3), MOST).astype(np.float32)
    fields.end()
    singles = (array.astype(np.float32) for array in (centers, weights, offset, scale))
    centers32, weights32, offset32, scale32 = singles
    return Residual(tuple(names), centers32, width, weights32, offset32, scale32, slopes)
