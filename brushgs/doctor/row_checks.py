"""Findings about single rows and columns: damaged rows, copies, quaternion lengths, empty SH bands."""

import numpy as np

from brushgs.doctor.findings import Finding, Severity
from brushgs.formats.scenes.columns import Dropped
from brushgs.passes.reduce.equal_rows import equal_rows
from brushgs.values.gaussians import SH_TERMS, Gaussians

# Quantized files (codebooks of 256 scales, colors in 8 bits) have copies by chance: 72 of 94,936 rows of
# skull (0.08 %). Others have none at all.
FEW_VALUES = 0.5  # distinct scales over rows
CHANCE_COPIES = 0.001
OFF_UNIT = 0.01  # of |length - 1|; trainers that do not normalize quaternions store lengths of 0.5 to 3
FEWEST_OFF = 0.001
# Half a step of 8 bits: a smaller difference of color is less than rounding.
INVISIBLE = 0.5 / 255


def check_dropped(dropped: Dropped, total: int) -> list[Finding]:
    """Rows that cannot be drawn, and numbers replaced by zero."""
    findings = []
    if dropped.zeroed is not None:
        row, name, value = dropped.zeroed
        what = f"rows hold view-dependent colors that are not finite (first: row {row}, {name} = {value:g})"
        count = dropped.num_zeroed
        facts = {"first_row": row, "column": name}
        findings.append(Finding("non-finite-colors", "odd", count, count / total, what, facts))
    if dropped.broken is not None:
        row, name, value = dropped.broken
        what = f"rows hold values that cannot be drawn (first: row {row}, {name} = {value:g})"
        facts = {"first_row": row, "column": name}
        count = dropped.num_broken
        findings.append(Finding("non-finite-rows", "fault", count, count / total, what, facts))
    if dropped.unrotated is not None:
        what = f"rows have an all-zero rotation, as padding rows do (first: row {dropped.unrotated})"
        count = dropped.num_unrotated
        findings.append(
            Finding("zero-quaternions", "fault", count, count / total, what, {"first_row": dropped.unrotated})
        )
    return findings


def check_quats(gaussians: Gaussians, total: int) -> list[Finding]:
    """Quaternions of a length other than 1, which are legitimate: most trainers store them."""
    lengths = np.linalg.norm(gaussians.quats.astype(np.float64), axis=1)
    count = int((np.abs(lengths - 1) > OFF_UNIT).sum())
    if count < max(1, FEWEST_OFF * len(gaussians)):
        return []
    low, high = float(lengths.min()), float(lengths.max())
    what = f"quaternions have lengths of {low:.3g} to {high:.3g}, not 1, which is harmless"
    facts = {"shortest": low, "longest": high}
    return [Finding("unnormalised-quaternions", "note", count, count / total, what, facts)]


def check_copies(gaussians: Gaussians, total: int) -> list[Finding]:
    """Rows that equal an earlier one in every column."""
    columns = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    first, _ = equal_rows(*columns)
    count = len(gaussians) - len(first)
    if not count:
        return []
    num_values = np.count_nonzero(np.diff(np.sort(gaussians.scales[:, 0]), prepend=-1))
    is_coarse = num_values < FEW_VALUES * len(gaussians)
    severity: Severity = "note" if is_coarse and count <= CHANCE_COPIES * len(gaussians) else "odd"
    rows = np.ones(len(gaussians), bool)
    rows[first] = False
    what = "rows are copies of earlier ones in every column"
    if severity == "note":
        what += ", which is chance in a file of rounded numbers"
    return [
        Finding(
            "duplicate-rows", severity, count, count / total, what, rows=None if severity == "note" else rows
        )
    ]


def check_bands(gaussians: Gaussians) -> list[Finding]:
    """SH bands, from the highest degree down, that together cannot change a color visibly.

    The band of degree l adds to a color at most the length of its coefficients times
    sqrt((2 l + 1) / (4 pi)), by the addition theorem.
    """
    reach = np.zeros((len(gaussians), 3))
    degree, largest = gaussians.sh_degree, 0.0
    while degree:
        band = gaussians.sh[:, degree**2 : (degree + 1) ** 2].astype(np.float64)
        reach += np.sqrt(np.square(band).sum(axis=1) * (2 * degree + 1) / (4 * np.pi))
        if reach.max(initial=0) >= INVISIBLE:
            break
        degree, largest = degree - 1, float(reach.max(initial=0))
    count = gaussians.sh_degree - degree
    if not count:
        return []
    bands = f"degree {degree + 1}" if count == 1 else f"degrees {degree + 1} to {gaussians.sh_degree}"
    effect = (
        "are zero in every row" if not largest else f"change no color by more than {255 * largest:.2g}/255"
    )
    facts = {"degree": degree, "terms": {d: k for k, d in SH_TERMS.items()}[degree], "largest": largest}
    what = f"spherical harmonics of {bands} {effect}"
    return [Finding("empty-sh-bands", "note", count, count / gaussians.sh_degree, what, facts)]
