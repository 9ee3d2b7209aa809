"""Estimates of up axis and unit, which most scene files do not state: notes, never faults."""

from typing import Any

import numpy as np

from brushgs.cameras.framing import subject
from brushgs.doctor.findings import Finding
from brushgs.first_view import rank_ups
from brushgs.first_view.up import SURE, believed_up, ranking_text
from brushgs.values.gaussians import Gaussians

METRES = (0.05, 200.0)  # size of a subject, from small objects to streets


def estimate_up(gaussians: Gaussians, stated: str | None) -> Finding:
    """The up axis: stated in the header, estimated as for the first view, or not sure."""
    if stated is not None:
        what = f"the header states that up is {stated}"
        return Finding("up-axis", "note", len(gaussians), 1.0, what, {"up": stated, "confidence": "stated"})
    ups = rank_ups(gaussians)
    up, probability = believed_up(ups)
    if probability >= SURE:
        what, confidence = f"up is probably {up} ({ranking_text(ups, up)})", "likely"
    else:
        what = f"which way is up is not sure ({ranking_text(ups, up)}); {up} is taken"
        confidence = "not sure"
    facts: dict[str, Any] = {"up": up, "confidence": confidence, "probability": probability, "ups": dict(ups)}
    return Finding("up-axis", "note", len(gaussians), 1.0, what, facts)


def estimate_unit(gaussians: Gaussians) -> list[Finding]:
    """A finding if the subject's size is unlikely in meters: programs that expect meters will misplace it."""
    points, _ = subject(gaussians)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if METRES[0] <= size <= METRES[1]:
        return []
    what = (
        f"the subject is {size:.3g} units across, which are hardly meters: the file does not state its unit"
    )
    facts = {"size": size, "unit": "unknown", "confidence": "not sure"}
    return [Finding("unit", "note", len(gaussians), 1.0, what, facts)]
