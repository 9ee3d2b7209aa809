"""Estimates of what most scene files do not state, up axis and unit: notes, never faults."""

import numpy as np
from numpy.typing import NDArray

from brushgs.cameras.framing import DEFAULT_UP, subject
from brushgs.doctor.findings import Finding
from brushgs.passes.contribution import projected_areas
from brushgs.passes.extent import robust_frame
from brushgs.quats import rotation_matrices
from brushgs.scene import Gaussians

LEVEL = 0.94  # |cosine| of shortest axis and world axis: a Gaussian within 20 degrees of it is level
SLABS = 40  # slabs of the scene along an axis; the ground fills three adjacent ones
# Share of the painted area that is level and in the ground's slabs: koala's deck 0.20, playbot's ground 0.39,
# the train's 0.29. The next best axis must have less than a quarter of it, and one side of the slabs must be
# empty and the other not. The estimate is right on those three; there is none on the other real scenes and on
# the example still life, whose wall is larger than its table.
GROUND, RIVAL, EMPTY, FULL = 0.18, 0.25, 0.03, 0.05
METRES = (0.05, 200.0)  # size of a subject, from small objects to streets


def estimate_up(gaussians: Gaussians, stated: str | None) -> Finding:
    """Which way is up: as stated in the header, or away from the ground, or unknown."""
    if stated is not None:
        what, facts = f"the header states that up is {stated}", {"up": stated, "confidence": "stated"}
    elif (up := _away_from_ground(gaussians)) is not None:
        what = f"up is probably {up}: level ground lies below everything else"
        facts = {"up": up, "confidence": "likely"}
    else:
        what = f"the up axis is not known; {DEFAULT_UP} is assumed"
        facts = {"up": DEFAULT_UP, "confidence": "not sure"}
    return Finding("up-axis", "note", len(gaussians), 1.0, what, facts)


def estimate_unit(gaussians: Gaussians) -> list[Finding]:
    """A subject of a size that is hardly in metres: programs that expect metres will misplace it."""
    points, _ = subject(gaussians)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    if METRES[0] <= size <= METRES[1]:
        return []
    what = (
        f"the subject is {size:.3g} units across, which are hardly metres: the file does not state its unit"
    )
    facts = {"size": size, "unit": "unknown", "confidence": "not sure"}
    return [Finding("unit", "note", len(gaussians), 1.0, what, facts)]


def _away_from_ground(gaussians: Gaussians) -> str | None:
    """The axis that points up from level ground; None where no ground is found."""
    center, radius = robust_frame(gaussians.means)
    places = (gaussians.means - center) / radius
    sizes = np.sort(gaussians.scales.astype(np.float64), axis=1)
    weights = projected_areas(gaussians.scales) * gaussians.opacities * (sizes[:, 1] > 2 * sizes[:, 0])
    if not weights.sum() > 0:
        return None
    rows = np.arange(len(gaussians))
    shortest = rotation_matrices(gaussians.quats)[rows, :, gaussians.scales.argmin(axis=1)]
    slabs = [
        _heaviest_slabs(places[:, axis], weights * (np.abs(shortest[:, axis]) > LEVEL)) for axis in range(3)
    ]
    shares = [share / weights.sum() for share, _ in slabs]
    best = int(np.argmax(shares))
    if shares[best] < GROUND or sorted(shares)[1] > RIVAL * shares[best]:
        return None
    low = slabs[best][1]
    above, below = (places[:, best] > low + 6 / SLABS).mean(), (places[:, best] < low - 2 / SLABS).mean()
    if min(above, below) > EMPTY or max(above, below) < FULL:
        return None
    return f"{'+' if above > below else '-'}{'xyz'[best]}"


def _heaviest_slabs(places: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[float, float]:
    """The largest weight of three adjacent slabs, and where the middle one begins."""
    held, edges = np.histogram(places, bins=np.linspace(-1, 1, SLABS + 1), weights=weights)
    around = np.convolve(held, np.ones(3), mode="same")
    return float(around.max()), float(edges[int(around.argmax())])
