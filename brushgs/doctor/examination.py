"""Examine a scene file: findings, and the correctly decoded scene."""

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brushgs.doctor.encodings import Diagnosis, detect_encoding
from brushgs.doctor.estimates import estimate_unit, estimate_up
from brushgs.doctor.findings import SEVERITIES, Finding, Severity
from brushgs.doctor.scene_checks import check_digits, check_far, check_filling, check_light, check_needles
from brushgs.errors import SceneError
from brushgs.formats.scenes.columns import Columns, Dropped, Encoding
from brushgs.formats.scenes.open_file import join_notes
from brushgs.formats.scenes.read import read_raw_parts
from brushgs.formats.scenes.rows import SceneFile, activate_rows
from brushgs.options.choices import Clean
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.passes.reduce.clean import find_floaters
from brushgs.passes.reduce.equal_rows import equal_rows
from brushgs.values.arrays import Mask
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.notes import LoadNotes


@dataclass(frozen=True)
class Examination:
    """The result of examining a scene file.

    Attributes:
        source: the files.
        notes: notes on the files.
        num_rows: rows in the files.
        encoding: encoding of the numbers.
        gaussians: N <= num_rows decoded Gaussians: only rows that cannot be drawn are dropped.
        findings: faults first, then odd things, then notes.
    """

    source: SceneSource
    notes: LoadNotes
    num_rows: int
    encoding: Encoding
    gaussians: Gaussians
    findings: list[Finding]

    def count(self, severity: str) -> int:
        """Number of findings of a severity."""
        return sum(finding.severity == severity for finding in self.findings)


def examine(path: SceneFiles) -> list[Finding]:
    """Find faults and oddities of a scene file.

    Args:
        path: the file or files of a trained 3D Gaussian scene, see `brushgs.load`.

    Returns:
        Findings, faults first; without "fault" the file can be painted as it is.

    Raises:
        SceneError: if the file cannot be used: not a scene, damaged, or without drawable rows.

    Example:
        >>> bg.save(gaussians, "scene.ply")
        >>> faults = [finding for finding in bg.examine("scene.ply") if finding.severity == "fault"]
        >>> faults
        []
    """
    return examine_file(path).findings


def examine_file(path: SceneFiles, clean: Clean = "sure") -> Examination:
    """`examine`, with the decoded scene.

    Args:
        path: the file or files of a trained 3D Gaussian scene, see `brushgs.load`.
        clean: floaters that the cure drops: clearly detached ones ("sure"), closer ones too ("strong"), or
            none ("off").
    """
    source = SceneSource.of(path)
    parts = read_raw_parts(source)
    files = [file for _, file in parts]
    encoding, findings = _detect_encoding(parts)
    columns = Columns.joined([columns for columns, _ in parts])
    total = len(columns.means)
    gaussians, dropped = _decode(columns, encoding, files[0].path)
    notes = join_notes(files, rows_dropped=dropped.num_rows, sh_degree_used=gaussians.sh_degree)
    notes = replace(notes, camera_folders=source.camera_folders())
    gaussians = replace(gaussians, antialiased=notes.training == "antialiased")
    findings += check_dropped(dropped, total)
    findings += check_quats(gaussians, total)
    copies = check_copies(gaussians, total)
    findings += copies + check_bands(gaussians)
    findings += _check_places(gaussians, copies, clean, total)
    findings += check_light(gaussians, total) + check_digits(gaussians, total)
    findings += [estimate_up(gaussians, notes.up), *estimate_unit(gaussians)]
    findings.sort(key=lambda finding: SEVERITIES.index(finding.severity))
    return Examination(source, notes, total, encoding, gaussians, findings)


def _detect_encoding(parts: list[tuple[Columns, SceneFile]]) -> tuple[Encoding, list[Finding]]:
    """The common encoding of all files, with findings if it is not the standard one.

    Raises:
        SceneError: if a file is encoded differently from the first.
    """
    diagnoses = [
        Diagnosis(Encoding(), []) if file.has_fixed_encoding else detect_encoding(columns)
        for columns, file in parts
    ]
    for (_, file), diagnosis in zip(parts, diagnoses, strict=True):
        if diagnosis.encoding != diagnoses[0].encoding:
            what = f"seems to be encoded in another way than {parts[0][1].path}"
            raise SceneError(file.path, f"{what}; examine and fix each file by itself first")
    findings = diagnoses[0].findings
    if len(parts) > 1:  # evidence of the first file, rows of all
        total = sum(len(columns.means) for columns, _ in parts)
        counts = Counter[str]()
        for diagnosis in diagnoses:
            counts.update({finding.name: finding.count for finding in diagnosis.findings})
        findings = [replace(f, count=counts[f.name], share=counts[f.name] / total) for f in findings]
    return diagnoses[0].encoding, findings


def _decode(columns: Columns, encoding: Encoding, path: Path) -> tuple[Gaussians, Dropped]:
    """Decode raw columns in place; the raw values are overwritten."""
    total, num_rest = len(columns.means), columns.sh.shape[1] - 1
    columns, dropped = activate_rows(columns, encoding, first_row=0, num_rest=num_rest, is_logit=True)
    if dropped.num_rows == total:
        dropped.report(path, total)  # raises: no row is left
    return columns.gaussians(), dropped


def _check_places(gaussians: Gaussians, copies: list[Finding], clean: Clean, total: int) -> list[Finding]:
    """Outliers, screen fillers, needles and floaters, each among the rows kept by earlier checks."""
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
    return findings + _check_floaters(gaussians, rest, clean, total)


def _check_floaters(gaussians: Gaussians, rest: Mask, clean: Clean, total: int) -> list[Finding]:
    """Findings about floaters among the rows in `rest`."""
    candidates = np.flatnonzero(rest)
    found = find_floaters(gaussians.take(candidates))
    if not found.has_bodies:
        what = "too few Gaussians touch each other to tell floaters from surfaces"
        return [Finding("too-sparse", "note", len(candidates), len(candidates) / total, what)]
    level = found.strong if clean == "strong" else found.sure
    if not level.rows.any():
        return []
    rows = np.zeros(len(gaussians), bool)
    rows[candidates] = level.rows
    count = int(rows.sum())
    what = (
        f"Gaussians float in the air, detached from everything solid: {level.share:.2g} of the painted area"
    )
    facts = {"area_share": level.share, "nearest": level.nearest}
    return [
        Finding(
            "floaters",
            "odd" if level.is_seen else "note",
            count,
            count / total,
            what,
            facts,
            rows if found.dropped(clean).any() else None,
        )
    ]


# Findings about single rows and columns: damaged rows, copies, quaternion lengths, empty SH bands.


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
