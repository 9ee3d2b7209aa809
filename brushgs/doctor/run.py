"""`brushgs doctor`: examine a scene file, and optionally write a cured one."""

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brushgs.doctor.examination import Examination, examine_file
from brushgs.doctor.findings import Finding
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.choices import Clean
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.outputs import check_output, scene_inputs
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import name_of, write_scene
from brushgs.pipeline.views import default_first_view
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized
from brushgs.version import __version__

SCHEMA = 1  # version of the JSON; increases when a field changes its meaning


@dataclass
class DoctorReport(Report):
    """The report of a run.

    Attributes:
        examination: None until the file has been examined.
    """

    examination: Examination | None = None

    @property
    def has_faults(self) -> bool:
        """Whether faults were found and no cured scene was written."""
        return self.examination is not None and self.examination.count("fault") > 0 and self.output is None

    def as_json(self) -> str:
        """Findings and stages as one JSON object."""
        value = json.loads(super().as_json()) | {"schema": SCHEMA, "brushgs": __version__}
        if self.examination is not None:
            value |= {
                "file": str(self.examination.source),
                "rows": self.examination.num_rows,
                "verdict": verdict(self.examination),
                "faults": self.examination.count("fault"),
                "odd": self.examination.count("odd"),
                "findings": [finding.as_dict() for finding in self.examination.findings],
            }
        return json.dumps(value, indent=2)

    def print_table(self) -> None:
        """Print the findings to stdout, or to stderr if stdout gets the path of the cured scene."""
        if self.examination is not None:
            stream = sys.stdout if self.output is None else sys.stderr
            print("\n".join(lines(self.examination)), file=stream)


def run_doctor(
    scene: SceneFiles,
    output: str | Path | None = None,
    *,
    clean: Clean = "sure",
    report: DoctorReport | None = None,
) -> DoctorReport:
    """Examine a scene file, and write the cured scene if there is an output.

    Args:
        scene: the files of a trained 3D Gaussian scene, of any format that is read.
        output: a .ply file for the cured scene; None for findings only.
        clean: floaters that the cure drops, see `examine_file`.
        report: collects stages and findings; None makes a new one.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if the output is not a .ply file.
    """
    report = report or DoctorReport()
    if output is not None:
        check_output(Path(output), SCENE_SUFFIXES, inputs=scene_inputs(scene))
    with report.stage("examine") as stage:
        report.examination = examination = examine_file(scene, clean)
        stage.did = verdict(examination)
        stage.counts = {
            "rows": examination.num_rows,
            "faults": examination.count("fault"),
            "odd": examination.count("odd"),
        }
    if output is not None:
        with report.stage("cure") as stage:
            cured = cure(examination)
            stage.did = f"{examination.num_rows:,} rows into {len(cured):,}"
            stage.counts = {"before": examination.num_rows, "after": len(cured)}
        view = default_first_view(examination.gaussians, examination.notes, report)
        write_scene(
            cured,
            output,
            report,
            is_strokes=examination.notes.is_strokes,
            scene=name_of(scene, examination.notes),
            first_view=view,  # view of the uncured scene, so that pictures of both line up
            brushes=examination.notes.brushes,
        )
    return report


# Findings as text for people.


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


# The cured scene: correctly decoded, without rows and SH bands dropped by findings.


def cure(examination: Examination) -> Gaussians:
    """Apply the cures of all findings.

    All other numbers keep their exact values, in the order of the file.

    Args:
        examination: the examination of a file.

    Returns:
        At least one Gaussian: no finding drops all of the scene.
    """
    gaussians, findings = examination.gaussians, {f.name: f for f in examination.findings}
    keeps = np.ones(len(gaussians), bool)
    for finding in findings.values():
        if finding.rows is not None:
            keeps &= ~finding.rows
    assert keeps.any(), "each finding keeps half of what earlier ones keep"
    if not keeps.all():
        gaussians = gaussians.take(keeps)
    quats, sh = gaussians.quats, gaussians.sh
    if "unnormalised-quaternions" in findings:
        quats = normalized(quats).astype(quats.dtype)
    if "empty-sh-bands" in findings:
        sh = sh[:, : findings["empty-sh-bands"].facts["terms"]]
    return replace(gaussians, quats=quats, sh=sh)
