"""The cured scene: correctly decoded, without rows and SH bands dropped by findings."""

from dataclasses import replace

import numpy as np

from brushgs.doctor.examination import Examination
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized


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
