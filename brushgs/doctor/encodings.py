"""Detect how raw columns are encoded: log or linear scales, wxyz or xyzw, SH coefficients or RGB.

Each decision needs a clear difference between the encodings; otherwise the standard one is assumed. Figures
in comments are from ten real scenes (examples/measured/doctor.md).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.doctor.findings import Finding
from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.passes.neighbours import NUM_NEIGHBOURS, nearest
from brushgs.passes.reduce.equal_rows import equal_rows
from brushgs.values.arrays import Array
from brushgs.values.quats import rotation_matrices

_AddFinding = Callable[..., None]  # (name of the finding, sentence, **facts)

FEWEST_ROWS = 10  # with fewer no decision is possible
ALMOST_ALL = 0.999  # share of rows; the rest may be damaged
SAMPLE = 20_000  # rows of the costly checks
# Real scenes have at most 0.24 of their logits in 0 to 1, and at most 0.19 of their rows with all three f_dc
# there. These are the least differences between percentiles 1 and 99 of a column, since equal values decide
# nothing. Integer logits of 0 to 20 are opacities of 0.5 to 1 - 2e-9; none spread wider.
SPREAD_OPACITY, SPREAD_COLOR, SPREAD_BYTES = 0.02, 0.25, 20.0
BLINDING = 16.0  # largest f_dc of a real scene: 12.6
# Median log of the longest axis over the distance to the nearest neighbour: -1.3 to 1.6.
TYPICAL_LOG_SIZE = 0.6
# Log-likelihood ratio of linear against log scales, nats a row. Ten real scenes in units of 1e-4 to 3e4: 1.5
# and more where they are linear (two synthetic ones: 0.5, 2.8), below -2.2 where they are logarithms.
LEAST_EVIDENCE = 0.25
TINY = 1e-30  # replaces linear scales of 0 before taking logarithms
FLAT, PLANAR = 2.0, 0.7  # middle over shortest axis; 1 - smallest over middle variance of the neighbors
FEWEST_FLAT = 100
# Mean |cosine| of shortest axis and surface normal, wxyz minus xyzw: 0.08 to 0.41 (10 to 40 standard errors);
# negative if the order is xyzw.
LEAST_ALIGNMENT, LEAST_ERRORS = 0.03, 6.0
# Mean |cosine| in the right order: 0.62 to 0.97. For random axes it is 0.5, up to 0.63 if one quaternion
# component is constant.
LEAST_NORMAL, SURE_NORMAL = 0.6, 0.8


@dataclass(frozen=True)
class Diagnosis:
    """The encoding of the columns, with findings if it is not the standard one."""

    encoding: Encoding
    findings: list[Finding]


def detect_encoding(columns: Columns) -> Diagnosis:
    """Detect the encoding of raw columns."""
    rows = _usable_rows(columns)
    encoding = Encoding()
    findings: list[Finding] = []
    if len(rows) < FEWEST_ROWS:
        return Diagnosis(encoding, findings)
    means = columns.means[rows]
    points = means[equal_rows(means)[0]]  # k-d trees take quadratic time for equal points
    picked = np.random.default_rng(0).permutation(len(rows))[:SAMPLE]
    distances, near = nearest(points, means[picked], min(NUM_NEIGHBOURS + 1, len(points)))

    def add_finding(name: str, what: str, **facts: float) -> None:
        rounded = {fact: round(float(value), 4) for fact, value in facts.items()}
        findings.append(Finding(name, "fault", len(rows), len(rows) / len(columns.means), what, rounded))

    scales, quats = columns.scales[rows][picked], columns.quats[rows][picked]
    encoding = _detect_scales(scales, distances, encoding, add_finding)
    encoding = _detect_opacities(columns.opacities[rows], encoding, add_finding)
    encoding = _detect_colors(columns.sh[rows, 0], encoding, add_finding)
    encoding = _detect_order(quats, scales, points[near], encoding, add_finding)
    return Diagnosis(encoding, findings)


def linear_evidence(scales: Array, spacings: Array) -> float:
    """Log-likelihood ratio of linear against logarithmic scales, nats a row; negative for logarithms.

    Decoded correctly, the longest axis is about as long as the distance to the nearest neighbor, and sizes
    are log-normal: if raw values are linear, a normal distribution fits their logarithms better than the
    values, for the shortest, middle and longest axes.

    Args:
        scales: [n, 3] raw values.
        spacings: [n] distance to the nearest neighbor, world units.
    """
    raw = np.sort(scales.astype(np.float64), axis=1)
    if (raw >= 0).mean() < ALMOST_ALL:
        return -np.inf
    spacings = np.asarray(spacings, np.float64)
    usable = (raw[:, 0] > 0) & (spacings > 0)
    if usable.sum() < FEWEST_ROWS:
        return -np.inf
    raw, spacings = raw[usable], spacings[usable]
    as_log = abs(np.median(raw[:, 2] - np.log(spacings)) - TYPICAL_LOG_SIZE)
    as_linear = abs(np.median(np.log(raw[:, 2] / spacings)) - TYPICAL_LOG_SIZE)
    evidence = as_log - as_linear
    for values in raw.T:  # shortest, middle and longest axis
        if values.std() > 1e-6 * values.mean():
            evidence += np.log(values.std() / np.log(values).std()) - np.log(values).mean()
    return float(evidence)


def order_evidence(quats: Array, log_scales: Array, neighbours: Array) -> tuple[float, float, float]:
    """Alignment of the shortest axes of flat Gaussians with surface normals, as wxyz (> 0) or as xyzw.

    The surface normal is the direction of least variance of a point's neighbours. Points in one axis-aligned
    plane decide nothing.

    Args:
        quats: [n, 4] as stored, no row zero.
        log_scales: [n, 3] natural logarithms.
        neighbours: [n, k, 3] points around each.

    Returns:
        Mean |cosine| of axis and normal as wxyz minus as xyzw, that difference over its standard error, and
        the mean as xyzw.
    """
    if (np.ptp(neighbours, axis=(0, 1)) == 0).any():
        return 0.0, 0.0, 0.0
    points = neighbours.astype(np.float64)
    points -= points.mean(axis=1, keepdims=True)
    variances, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", points, points))
    with np.errstate(invalid="ignore"):  # two scales of 0
        flatness = np.subtract(*np.sort(log_scales, axis=1)[:, 1::-1].T)
    chosen = (flatness > np.log(FLAT)) & (variances[:, 0] < (1 - PLANAR) * variances[:, 1])
    if chosen.sum() < FEWEST_FLAT:
        return 0.0, 0.0, 0.0
    normals, shortest = axes[chosen, :, 0], log_scales[chosen].argmin(axis=1)

    def cosines(order: list[int]) -> NDArray[np.float64]:
        rotations = rotation_matrices(quats[chosen][:, order])
        return np.asarray(np.abs((rotations[np.arange(len(shortest)), :, shortest] * normals).sum(axis=1)))

    as_xyzw = cosines([3, 0, 1, 2])
    gains = cosines([0, 1, 2, 3]) - as_xyzw
    error = gains.std() / np.sqrt(len(gains))
    return float(gains.mean()), float(gains.mean() / max(error, 1e-12)), float(as_xyzw.mean())


def _usable_rows(columns: Columns) -> NDArray[np.int64]:
    """Rows that can be drawn in some encoding."""
    is_usable = columns.quats.any(axis=1)
    for column in (columns.means, columns.quats, columns.sh[:, 0]):
        is_usable &= np.isfinite(column).all(axis=1)
    is_usable &= ~np.isnan(columns.scales).any(axis=1) & (columns.scales < np.inf).all(axis=1)
    return np.flatnonzero(is_usable & ~np.isnan(columns.opacities))


def _detect_scales(scales: Array, distances: Array, encoding: Encoding, add_finding: _AddFinding) -> Encoding:
    if distances.shape[1] < 2:  # all Gaussians are at one place
        return encoding
    evidence = linear_evidence(scales, distances[:, 1])
    if evidence <= LEAST_EVIDENCE:
        return encoding
    add_finding(
        "linear-scales", "scales are stored as they are, not as their logarithms", nats_a_row=evidence
    )
    return replace(encoding, scales="linear")


def _detect_order(
    quats: Array, scales: Array, neighbours: Array, encoding: Encoding, add_finding: _AddFinding
) -> Encoding:
    if neighbours.shape[1] < 4:  # a plane needs three
        return encoding
    logs = scales.astype(np.float64)
    if encoding.scales == "linear":
        logs = np.log(np.maximum(logs, TINY))
    alignment, errors, as_xyzw = order_evidence(quats, logs, neighbours)
    least = SURE_NORMAL if (np.ptp(quats, axis=0) == 0).any() else LEAST_NORMAL
    if alignment > -LEAST_ALIGNMENT or errors > -LEAST_ERRORS or as_xyzw < least:
        return encoding
    what = "rotations are stored as x, y, z, w: in this order flat Gaussians lie on the surfaces"
    add_finding("xyzw-quaternions", what, alignment=alignment, standard_errors=errors)
    return replace(encoding, quats="xyzw")


def _detect_opacities(values: Array, encoding: Encoding, add_finding: _AddFinding) -> Encoding:
    low, high = np.percentile(values, (1, 99), method="nearest")  # infinite logits are legitimate
    if ((values >= 0) & (values <= 1)).mean() >= ALMOST_ALL:
        # Equal opacities may be either; beside linear scales they are linear, too.
        if high - low > SPREAD_OPACITY or encoding.scales == "linear":
            add_finding(
                "linear-opacities", "opacities are stored as 0 to 1, not as their logits", low=low, high=high
            )
            return replace(encoding, opacities="linear")
    elif (
        high - low > SPREAD_BYTES
        and ((values >= 0) & (values <= 255) & (values == np.round(values))).mean() >= ALMOST_ALL
    ):
        add_finding(
            "byte-opacities", "opacities are stored as 0 to 255, not as their logits", low=low, high=high
        )
        return replace(encoding, opacities="byte")
    return encoding


def _detect_colors(values: Array, encoding: Encoding, add_finding: _AddFinding) -> Encoding:
    lows, highs = np.percentile(values, (1, 99), axis=0)
    low, high = lows.min(), highs.max()
    spread = (highs - lows).max()  # per channel: channels of a plain color differ
    facts = {"low": float(low), "high": float(high)}
    if ((values >= 0) & (values <= 1)).all(axis=1).mean() >= ALMOST_ALL:
        if spread > SPREAD_COLOR:
            add_finding(
                "linear-colors", "colors are stored as RGB of 0 to 1, not as SH coefficients", **facts
            )
            return replace(encoding, colors="rgb")
    elif min(high, spread) > BLINDING and ((values >= 0) & (values <= 255)).all(axis=1).mean() >= ALMOST_ALL:
        add_finding("byte-colors", "colors are stored as RGB of 0 to 255, not as SH coefficients", **facts)
        return replace(encoding, colors="byte")
    return encoding
