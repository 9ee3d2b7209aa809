"""`brushgs doctor`: a scene file becomes findings, and a cured scene file if one is asked for."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

from brushgs import __version__
from brushgs.doctor.cure import cure
from brushgs.doctor.examination import Examination, look_at
from brushgs.doctor.table import lines, verdict
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.options.choices import Floaters
from brushgs.painting.outputs import check_output
from brushgs.painting.report import Report
from brushgs.painting.strokes import write_scene

SCHEMA = 1  # of the JSON; grows when a field changes its meaning


@dataclass
class DoctorReport(Report):
    """A run, and what it found.

    Attributes:
        examination: None until the file was looked at.
    """

    examination: Examination | None = None

    @property
    def has_faults(self) -> bool:
        """Whether faults were found and no cured scene was written."""
        return self.examination is not None and self.examination.count("fault") > 0 and self.output is None

    def as_json(self) -> str:
        """The findings and the stages for machines: one JSON object."""
        value = json.loads(super().as_json()) | {"schema": SCHEMA, "brushgs": __version__}
        if self.examination is not None:
            value |= {
                "file": str(self.examination.path),
                "rows": self.examination.num_rows,
                "verdict": verdict(self.examination),
                "faults": self.examination.count("fault"),
                "odd": self.examination.count("odd"),
                "findings": [finding.as_dict() for finding in self.examination.findings],
            }
        return json.dumps(value, indent=2)

    def print_table(self) -> None:
        """The findings: on stdout where they are the answer, on stderr beside the path of a cured scene."""
        if self.examination is not None:
            stream = sys.stdout if self.output is None else sys.stderr
            print("\n".join(lines(self.examination)), file=stream)


def run_doctor(
    scene: str | Path,
    output: str | Path | None = None,
    *,
    floaters: Floaters = "sure",
    report: DoctorReport | None = None,
) -> DoctorReport:
    """Examine a scene file, and write the cured scene.

    Args:
        scene: a .ply file with a trained 3D Gaussian scene.
        output: a .ply file for the cured scene; None for findings only.
        floaters: which of them the cure drops, see `look_at`.
        report: where the stages are told; a new one if None.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if the output is no .ply.
    """
    report = report or DoctorReport()
    if output is not None:
        check_output(Path(output), SCENE_SUFFIXES, inputs=(Path(scene),))
    with report.stage("examine") as stage:
        report.examination = examination = look_at(scene, floaters)
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
        write_scene(cured, output, report)
    return report
