"""Findings as text for people."""

from collections.abc import Iterator

from brushgs.doctor.examination import Examination
from brushgs.doctor.findings import Finding

ESTIMATES = ("up-axis", "unit")  # findings about the whole scene, without a cure


def lines(examination: Examination) -> Iterator[str]:
    """A verdict, then each finding with its treatment."""
    yield f"{examination.source}: {examination.num_rows:,} Gaussians; {verdict(examination)}"
    for finding in examination.findings:
        yield f"{finding.severity:5}  {finding.name}{_rows(finding)}: {finding.what}"
        if finding.name not in ESTIMATES:
            yield f"       brushgs: {finding.by_default}; --fix: {finding.cure}"


def verdict(examination: Examination) -> str:
    """The counts of findings in words; "sound" if there are only notes."""
    faults, odd = examination.count("fault"), examination.count("odd")
    if not faults and not odd:
        return "sound"
    parts = [f"{faults} fault{'s' * (faults != 1)}"] if faults else []
    parts += [f"{odd} odd thing{'s' * (odd != 1)}"] if odd else []
    return " and ".join(parts)


def _rows(finding: Finding) -> str:
    if finding.name in (*ESTIMATES, "empty-sh-bands"):
        return ""
    share = f"{100 * finding.share:.2g}" if finding.share < 1 else "all"
    return f", {finding.count:,} rows ({share}{' %' * (finding.share < 1)})"
