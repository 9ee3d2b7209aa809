"""What a scene file does not say, guessed from the scene: notes, never faults."""

import numpy as np
from numpy.typing import NDArray

from brushgs.cameras.framing import DEFAULT_UP, subject
from brushgs.doctor.findings import Finding
from brushgs.passes.contribution import projected_areas
from brushgs.passes.extent import robust_frame
from brushgs.quats import rotation_matrices
from brushgs.scene import Gaussians

LEVEL = 0.94  # |cosine| of a shortest axis and an axis of the world: within 20 degrees
SLABS = 40  # slices of the scene along an axis; the ground fills three neighbouring ones
# Share of the painted area that is level and lies in one slab: koala's deck 0.20, playbot's ground 0.39, the
# train's 0.29. The next best axis must have less than a quarter of it, one side of the slab be empty and the
# other not. Then the guess is right on those three; on the other real scenes it is left open, as it is
# on the example still life, whose wall is larger than its table.
GROUND, RIVAL, EMPTY, FULL = 0.18, 0.25, 0.03, 0.05
# Sizes of a subject in units that people work in: objects and rooms in metres.
METRES = (0.05, 200.0)


def guess_up(gaussians: Gaussians, stated: str | None) -> Finding:
    """Which way is up: as the header states, or away from the ground, or left open."""
    if stated is not None:
        what, facts = f"the header states that up is {stated}", {"up": stated, "confidence": "stated"}
    elif (up := _away_from_ground(gaussians)) is not None:
        what = f"up is likely {up}: a level ground lies below everything else"
        facts = {"up": up, "confidence": "likely"}
    else:
        what = f"which way is up is not sure; {DEFAULT_UP} is assumed"
        facts = {"up": DEFAULT_UP, "confidence": "not sure"}
    return Finding("up-axis", "note", len(gaussians), 1.0, what, facts)


def guess_unit(gaussians: Gaussians) -> Finding:
    """The size of the subject, and whether it could be in metres."""
    points, _ = subject(gaussians)
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    could_be = METRES[0] <= size <= METRES[1]
    guess = "could be in metres, or in any unit" if could_be else "is hardly in metres"
    what = f"the subject is {size:.3g} units across, which {guess}: a PLY does not say"
    facts = {"size": size, "unit": "metre" if could_be else "unknown", "confidence": "not sure"}
    return Finding("unit", "note", len(gaussians), 1.0, what, facts)


def _away_from_ground(gaussians: Gaussians) -> str | None:
    """The axis that points up from a level ground; None where there is none, or not surely one."""
    center, radius = robust_frame(gaussians.means)
    places = (gaussians.means - center) / radius
    sizes = np.sort(gaussians.scales.astype(np.float64), axis=1)
    weights = projected_areas(gaussians.scales) * gaussians.opacities * (sizes[:, 1] > 2 * sizes[:, 0])
    if not weights.sum() > 0:
        return None
    rows = np.arange(len(gaussians))
    shortest = rotation_matrices(gaussians.quats)[rows, :, gaussians.scales.argmin(axis=1)]
    slabs = [_slab(places[:, axis], weights * (np.abs(shortest[:, axis]) > LEVEL)) for axis in range(3)]
    shares = [share / weights.sum() for share, _ in slabs]
    best = int(np.argmax(shares))
    if shares[best] < GROUND or sorted(shares)[1] > RIVAL * shares[best]:
        return None
    low = slabs[best][1]
    above, below = (places[:, best] > low + 6 / SLABS).mean(), (places[:, best] < low - 2 / SLABS).mean()
    if min(above, below) > EMPTY or max(above, below) < FULL:
        return None
    return f"{'+' if above > below else '-'}{'xyz'[best]}"


def _slab(places: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[float, float]:
    """The most weight that three neighbouring slices hold, and where the middle one begins."""
    held, edges = np.histogram(places, bins=np.linspace(-1, 1, SLABS + 1), weights=weights)
    around = np.convolve(held, np.ones(3), mode="same")
    return float(around.max()), float(edges[int(around.argmax())])
