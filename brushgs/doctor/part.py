"""Figures of a part of a scene."""

from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.options.where import WhereConfig
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.notes import LoadNotes

DIGITS = 6


def describe_part(gaussians: Gaussians, notes: "LoadNotes", config: WhereConfig) -> dict[str, Any]:
    """Figures of a part of a scene, as added by `brushgs info --where`.

    Args:
        gaussians: the Gaussians of a file.
        notes: notes on the file.
        config: the part.

    Returns:
        Name -> number, text or list of numbers, ready for JSON: the number of Gaussians with a weight above 0
        in the part; the weighted share of Gaussians and of the sum of opacities; and the corners of the box
        around their centers, if there are any.

    Raises:
        ValueError: if a term lacks its cameras or model.
        SceneError: if a mask or the camera file cannot be used.
    """
    from brushgs.passes.where import memberships
    from brushgs.pipeline.report import Report
    from brushgs.pipeline.views import default_first_view
    from brushgs.pipeline.where import context_of

    first_view = default_first_view(gaussians, notes, Report()) if config.needs_first_view else None
    found = memberships(config.expression, gaussians, context_of(config, first_view))
    opacities = gaussians.opacities.astype(np.float64)
    inside = gaussians.means[found > 0]
    facts: dict[str, Any] = {
        "where": str(config),
        "where_gaussians": len(inside),
        "where_share": _rounded(found.mean()),
        "where_opacity": _rounded(opacities @ found / max(opacities.sum(), np.finfo(float).tiny)),
    }
    if len(inside):
        facts["where_low"] = [_rounded(value) for value in inside.min(axis=0)]
        facts["where_high"] = [_rounded(value) for value in inside.max(axis=0)]
    return facts


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
