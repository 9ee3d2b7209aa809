"""A scene file -> what is wrong or odd with it, and the scene as it should be read."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brushgs.arrays import Mask
from brushgs.doctor.encodings import diagnose
from brushgs.doctor.equal import equal_rows
from brushgs.doctor.findings import SEVERITIES, Finding
from brushgs.doctor.floaters import STRONG_GAP, SURE_GAP, VISIBLE, find_apart
from brushgs.doctor.guesses import guess_unit, guess_up
from brushgs.doctor.rows import check_bands, check_copies, check_dropped, check_quats
from brushgs.doctor.shapes import FAINT, check_far, check_filling, check_light, check_needles
from brushgs.io.scenes.columns import Columns
from brushgs.io.scenes.dropped import Dropped, drop_faults
from brushgs.io.scenes.encoding import Encoding
from brushgs.io.scenes.ply import RawScene, read_raw
from brushgs.options.choices import Floaters
from brushgs.scene import Gaussians


@dataclass(frozen=True)
class Examination:
    """What a look at a scene file found.

    Attributes:
        path: the file.
        num_rows: rows of the file.
        reading: how its numbers are to be read.
        gaussians: N <= num_rows of them, read so; what cannot be drawn is left out, nothing else.
        findings: faults first, then what is odd, then notes.
    """

    path: Path
    num_rows: int
    encoding: Encoding
    gaussians: Gaussians
    findings: list[Finding]

    def count(self, severity: str) -> int:
        """How many findings are so severe."""
        return sum(finding.severity == severity for finding in self.findings)


def examine(path: str | Path) -> list[Finding]:
    """Find what is wrong or odd with a scene file.

    Args:
        path: a .ply file with a trained 3D Gaussian scene.

    Returns:
        Findings, faults first; none with "fault" among them if the file can be painted as it is.

    Raises:
        SceneError: if the file cannot be used at all: no scene, damaged, or no row that can be drawn.
    """
    return look_at(path).findings


def look_at(path: str | Path, floaters: Floaters = "sure") -> Examination:
    """`examine`, with the scene that was looked at.

    Args:
        path: a .ply file with a trained 3D Gaussian scene.
        floaters: which of them the cure drops: those surely apart, nearer ones too ("strong"), or none.
    """
    raw = read_raw(path)
    total = len(raw.columns.means)
    encoding, findings = Encoding(), []
    if not raw.is_compressed:
        diagnosis = diagnose(raw.columns)
        encoding, findings = diagnosis.encoding, diagnosis.findings
    gaussians, dropped = _decode(raw, encoding)
    findings += check_dropped(dropped, total)
    findings += check_quats(gaussians, total)
    copies = check_copies(gaussians, total)
    findings += copies + check_bands(gaussians)
    findings += _check_places(gaussians, copies, floaters, total)
    findings += check_light(gaussians, total)
    findings += [guess_up(gaussians, raw.up), guess_unit(gaussians)]
    findings.sort(key=lambda finding: SEVERITIES.index(finding.severity))
    return Examination(Path(path), total, encoding, gaussians, findings)


def _decode(raw: RawScene, encoding: Encoding) -> tuple[Gaussians, Dropped]:
    """The Gaussians of raw columns, in their place: the raw values are gone afterwards."""
    columns: Columns = raw.columns
    total = len(columns.means)
    encoding.standardize(columns)
    with np.errstate(all="ignore"):
        dropped = drop_faults(columns, 0, columns.sh.shape[1] - 1)
        if dropped.num_rows == total:
            dropped.report(raw.path, total)  # raises: nothing is left
        columns = columns.part(0, total - dropped.num_rows)
        columns.activate(is_logit=True)
    return columns.gaussians(), dropped


def _check_places(
    gaussians: Gaussians, copies: list[Finding], floaters: Floaters, total: int
) -> list[Finding]:
    """Outliers, screen fillers, needles and floaters, each looked for in what the former leave."""
    findings = []
    rest = np.ones(len(gaussians), bool)
    for finding in copies:
        if finding.rows is not None:
            rest &= ~finding.rows
    for check in (check_far, check_filling):
        for finding in check(gaussians.take(rest), total):
            if finding.rows is not None:
                rows = np.zeros(len(gaussians), bool)
                rows[np.flatnonzero(rest)[finding.rows]] = True
                rest &= ~rows
                finding = replace(finding, rows=rows)
            findings.append(finding)
    findings += check_needles(gaussians.take(rest), total)
    return findings + _check_floaters(gaussians, rest, floaters, total)


def _check_floaters(gaussians: Gaussians, rest: Mask, floaters: Floaters, total: int) -> list[Finding]:
    """What hangs in the air. Gaussians at one place share one verdict."""
    candidates = np.flatnonzero(rest)
    first, groups = equal_rows(gaussians.means[candidates])
    apart = find_apart(gaussians.take(candidates[first]))
    if not apart.has_bodies:
        what = "too few Gaussians touch each other to say what hangs in the air"
        return [Finding("too-sparse", "note", len(candidates), len(candidates) / total, what)]
    is_far = apart.beyond(STRONG_GAP if floaters == "strong" else SURE_GAP)
    rows = np.zeros(len(gaussians), bool)
    rows[candidates] = is_far[groups]
    count, area = int(rows.sum()), float(apart.areas[is_far].sum())
    if not count:
        return []
    is_haze = bool(np.percentile(gaussians.opacities, 99) < FAINT)  # where all is faint, nothing is sure
    is_seen = area >= VISIBLE and not is_haze
    share = area / float(apart.areas.sum())
    what = f"Gaussians hang in the air apart from everything solid: {share:.2g} of the painted area"
    facts = {"area_share": share, "nearest": float(apart.gaps[is_far].min())}
    drops = floaters != "keep" and (is_seen or floaters == "strong") and not is_haze
    return [
        Finding(
            "floaters",
            "odd" if is_seen else "note",
            count,
            count / total,
            what,
            facts,
            rows if drops else None,
        )
    ]
