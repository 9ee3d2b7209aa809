"""How far a scene file is from what was written to it: it is read back, and compared column by column."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.finite_logs import unit_quats
from brushgs.formats.scenes.read import read_scene
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

_MIDDLE = 1, 99  # per cent of the centres: few far ones do not make a scene large
_FLAT = 1e-6  # of the extent: smaller standard deviations are no lengths, and all are alike
_SMALLEST = 1e-37  # the same where there is no extent, world units
_VISIBLE = 0.5 / 255  # opacity: less is 0 in most formats, and its colour and shape are not seen


@dataclass(frozen=True)
class Losses:
    """Differences between Gaussians and their file. Pairs are the median and the largest.

    Attributes:
        extent: diagonal of the box of 98 % of the centres along each axis, world units.
        means: distance between centres, world units.
        scales: the larger of two standard deviations above the smaller, relative to this.
        quats: angle between rotations, degrees.
        opacities: difference, 0 to 1.
        colors: of the channels of degree 0, levels of 255.
        harmonics: of the higher degrees, root mean square over all directions, levels of 255; 0 without them.
    """

    extent: float
    means: tuple[float, float]
    scales: tuple[float, float]
    quats: tuple[float, float]
    opacities: tuple[float, float]
    colors: tuple[float, float]
    harmonics: tuple[float, float]

    def counts(self) -> dict[str, float]:
        """For a report: "means_error" (median), "means_error_most" and so on."""
        pairs = {name: value for name, value in asdict(self).items() if name != "extent"}
        found = {"extent": self.extent}
        for name, (median, most) in pairs.items():
            found |= {f"{name}_error": median, f"{name}_error_most": most}
        return {name: float(f"{value:.4g}") for name, value in found.items()}

    def words(self) -> list[str]:
        """For a person: a line for each kind of number, the median and the largest error."""
        share = [f"{value / self.extent:.1e}" if self.extent else "0" for value in self.means]
        lines = [
            f"centres are off by {_pair(self.means)} units, {share[0]} (at most {share[1]}) of the extent",
            f"sizes are off by {_pair(self.scales, 100)} %, rotations by {_pair(self.quats)} degrees",
            f"opacities are off by {_pair(self.opacities, 255)}, colours by {_pair(self.colors)} of 255",
        ]
        if self.harmonics[1]:
            lines.append(
                f"colours that change with the view are off by {_pair(self.harmonics)} levels of 255"
            )
        return lines


def measure_losses(given: Gaussians, path: str | Path, order: NDArray[np.integer] | None = None) -> Losses:
    """Read a file and compare it with what was written to it.

    Args:
        given: the Gaussians.
        path: their file.
        order: the rows of `given` in the order of the file; None if it is theirs.

    Raises:
        SceneError: if the file cannot be read.
    """
    found = read_scene(Path(path))[0]
    given = given if order is None else given.take(order)
    assert len(found) == len(given), "every row that is written can be drawn"
    seen = given.opacities >= _VISIBLE
    means = given.means.astype(np.float64)
    extent = float(np.linalg.norm(np.ptp(np.percentile(means, _MIDDLE, axis=0), axis=0)))
    smallest = max(_FLAT * extent, _SMALLEST)
    logs = [np.log(np.maximum(some.scales.astype(np.float64), smallest)) for some in (given, found)]
    cosines = np.abs((unit_quats(given.quats) * unit_quats(found.quats)).sum(axis=1))
    colors = (found.sh[:, 0] - given.sh[:, 0].astype(np.float64)) * (C0 * 255)
    with np.errstate(over="ignore"):
        return Losses(
            extent=extent,
            means=_ends(np.linalg.norm(found.means - means, axis=1)),
            scales=_ends(np.expm1(np.abs(logs[1] - logs[0]))[seen]),
            quats=_ends(np.degrees(2 * np.arccos(np.minimum(cosines, 1)))[seen]),
            opacities=_ends(np.abs(found.opacities - given.opacities.astype(np.float64))),
            colors=_ends(np.abs(colors)[seen]),
            harmonics=_ends(_harmonics(given, found)[seen]),
        )


def _harmonics(given: Gaussians, found: Gaussians) -> NDArray[np.float64]:
    """[N] the basis is orthonormal on the sphere, so its coefficients add up squared."""
    rest = np.zeros((len(given), max(given.sh.shape[1], found.sh.shape[1]), 3))
    rest[:, : found.sh.shape[1]] += found.sh
    rest[:, : given.sh.shape[1]] -= given.sh
    return np.asarray(255 * np.sqrt(np.square(rest[:, 1:]).sum(axis=1).mean(axis=1) / (4 * np.pi)))


def _ends(errors: NDArray[np.float64]) -> tuple[float, float]:
    """Median and largest; 0 of none."""
    return (float(np.median(errors)), float(errors.max())) if errors.size else (0.0, 0.0)


def _pair(pair: tuple[float, float], factor: float = 1) -> str:
    return f"{pair[0] * factor:.2g} (at most {pair[1] * factor:.2g})"
