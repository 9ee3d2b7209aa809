"""Findings about positions, sizes and light: far outliers, fillers, needles; too dark, faint or bright."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.doctor.findings import Finding, Severity
from brushgs.passes.extent import robust_frame
from brushgs.passes.reduce.clean import FAINT
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.arrays import Array, Mask
from brushgs.values.colors import LUMINANCE
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0, base_colors

# Radii of the core (the middle 80 %). The outermost Gaussian of the ten real scenes lies at 6.1.
FAR = 50.0
# Three standard deviations over the distance: smaller ones appear as dots from the middle of the scene, not
# as sky.
SKY = 0.05
# Longest axis over the radius that holds 98 %: at most 0.31 (chair). At 1 a box is wider than the scene.
FILLING = 1.0
# Longest over middle axis, and longest axis over that radius. No Gaussian of the ten scenes exceeds both: 199
# of the chair have an aspect above 100 and a length above 0.05, but none is longer than 0.1.
NEEDLE_ASPECT, NEEDLE_LENGTH = 100.0, 0.1
# Mean luminance weighted by painted area. Real scenes: 0.19 (biker) and more. The 99th percentile of their
# opacities is 0.83 and more, except 0.22 for a firework made by a script.
DARK = 0.03
# A base color component; the share of rows, and of the painted area, above it. Real scenes: at most 0.05 %
# of the rows and 0.01 % of the area (campsite), except the sunflowers, whose glare is 9 % of the rows and
# 0.2 % of the area.
BRIGHT, BRIGHT_ROWS, BRIGHT_AREA = 2.0, 0.01, 0.01
MOST = 0.5  # largest share of rows to drop
# Digits of positions, see `position_digits`. Real scenes: 4.8 and more. At 1 Gaussians are off by a twentieth
# of their length, at 0 by half of it.
FEW_DIGITS, NO_DIGITS = 1.0, 0.0


def check_far(gaussians: Gaussians, total: int) -> list[Finding]:
    """Gaussians so far away that the scene is a dot from there."""
    core = Core.of(gaussians.means)
    distances = core.distances(gaussians.means)
    rows = distances > FAR
    rows &= 3 * gaussians.scales.max(axis=1).astype(np.float64) < SKY * core.radius * distances
    count = int(rows.sum())
    if not count:
        return []
    farthest = float(distances[rows].max())
    what = f"Gaussians lie {FAR:g} or more radii of the scene away from it, the farthest {farthest:.3g}"
    facts = {"farthest": farthest}
    return [Finding("far-outliers", "odd", count, count / total, what, facts, _unless_most(rows))]


def check_filling(gaussians: Gaussians, total: int) -> list[Finding]:
    """Gaussians larger than the scene that cover it."""
    center, radius = robust_frame(gaussians.means)
    sizes = gaussians.scales.max(axis=1).astype(np.float64) / radius
    rows = (sizes > FILLING) & (np.linalg.norm(gaussians.means - center, axis=1) < 3 * sizes * radius)
    count = int(rows.sum())
    if not count:
        return []
    what = f"Gaussians are larger than the whole scene and cover it, the largest {sizes.max():.3g} times"
    facts = {"largest": float(sizes.max())}
    return [Finding("screen-fillers", "odd", count, count / total, what, facts, _unless_most(rows))]


def check_needles(gaussians: Gaussians, total: int) -> list[Finding]:
    """Gaussians that are long relative to the scene and a hundred times as long as wide."""
    _, radius = robust_frame(gaussians.means)
    sizes = np.sort(gaussians.scales.astype(np.float64), axis=1)
    is_long = (sizes[:, 2] > NEEDLE_LENGTH * radius) & (sizes[:, 2] <= FILLING * radius)
    is_needle = is_long & (sizes[:, 2] > NEEDLE_ASPECT * sizes[:, 1])
    count = int(is_needle.sum())
    if not count:
        return []
    length = float(sizes[is_needle, 2].max() / radius)
    what = f"Gaussians are needles, the longest {length:.2g} radii of the scene"
    return [Finding("needles", "odd", count, count / total, what, {"longest": length})]


def check_digits(gaussians: Gaussians, total: int) -> list[Finding]:
    """Positions so far from the origin that float32 steps are about as long as the Gaussians."""
    digits, step, length = position_digits(gaussians)
    if digits >= FEW_DIGITS:
        return []
    what = (
        f"positions have {max(digits, 0):.1f} digits left: they have steps of {step:.2g} so far from the "
        f"origin, and Gaussians are {length:.2g} long; move the scene to the origin before it is exported"
    )
    severity: Severity = "fault" if digits < NO_DIGITS else "odd"
    facts = {"digits": round(digits, 2), "step": step, "length": length}
    return [Finding("coarse-positions", severity, len(gaussians), len(gaussians) / total, what, facts)]


def position_digits(gaussians: Gaussians) -> tuple[float, float, float]:
    """Decimal digits of positions, with the lengths behind them.

    Returns:
        log10 of length over step; the step of float32 at the largest coordinate of a Gaussian, world units;
        the standard deviation along its longest axis, world units. Both are medians.
    """
    steps = np.spacing(np.abs(gaussians.means).max(axis=1).astype(np.float32))
    least = float(np.finfo(np.float32).smallest_subnormal)
    step = max(float(np.median(steps)), least)
    length = max(float(np.median(gaussians.scales.max(axis=1))), least)
    return float(np.log10(length / step)), step, length


def check_light(gaussians: Gaussians, total: int) -> list[Finding]:
    """A scene that is nearly invisible, or far too bright."""
    findings = _check_bright(gaussians, total)
    count, share = len(gaussians), len(gaussians) / total
    strong = float(np.percentile(gaussians.opacities, 99))
    if strong < FAINT:
        what = f"99 % of the opacities are below {strong:.2g}"
        findings.append(Finding("all-faint", "odd", count, share, what, {"opacity_99": strong}))
    weights = projected_areas(gaussians.scales) * gaussians.opacities
    luminances = base_colors(gaussians.sh) @ LUMINANCE
    mean = float(np.average(luminances, weights=weights)) if weights.sum() > 0 else float(luminances.mean())
    if mean < DARK:
        what = f"the mean luminance is {mean:.2g} of 1: on a dark background nothing will be visible"
        findings.append(Finding("all-dark", "odd", count, share, what, {"luminance": mean}))
    return findings


def _check_bright(gaussians: Gaussians, total: int) -> list[Finding]:
    """Colors far above white: odd if they fill a visible part of the painted area."""
    brightest = 0.5 + C0 * gaussians.sh[:, 0].astype(np.float64).max(axis=1)
    is_bright = brightest > BRIGHT
    count = int(is_bright.sum())
    weights = projected_areas(gaussians.scales) * gaussians.opacities
    area = float(weights[is_bright].sum() / weights.sum()) if weights.sum() > 0 else 0.0
    if count < BRIGHT_ROWS * len(gaussians) and area < BRIGHT_AREA:
        return []
    what = (
        f"Gaussians are more than {BRIGHT:g} times as bright as white, the brightest {brightest.max():.2g} "
        f"times: {area:.2g} of the painted area is burnt out"
    )
    facts = {"brightest": float(brightest.max()), "area_share": area}
    severity: Severity = "odd" if area >= BRIGHT_AREA else "note"
    return [Finding("over-bright", severity, count, count / total, what, facts)]


def _unless_most(rows: Mask) -> Mask | None:
    """The rows to drop; None if they are most of the scene."""
    return rows if rows.mean() <= MOST else None


# Robust middle and radius of a scene.


# Robust against a tenth of the rows at each end.
CORE_PERCENTILES = (10, 90)


@dataclass(frozen=True)
class Core:
    """Middle [3] and half diagonal of the box of the middle 80 % along each axis, world units."""

    center: NDArray[np.float64]
    radius: float

    @classmethod
    def of(cls, means: Array) -> "Core":
        """The core of points [N, 3]; without extent, the radius is that of `robust_frame`."""
        low, high = np.percentile(means.astype(np.float64), CORE_PERCENTILES, axis=0)
        radius = 0.5 * float(np.linalg.norm(high - low))
        return cls(0.5 * (low + high), radius if radius > 0 else robust_frame(means)[1])

    def distances(self, means: Array) -> NDArray[np.float64]:
        """[N] distances from the middle, in radii."""
        return np.asarray(np.linalg.norm(means - self.center, axis=1) / self.radius)
