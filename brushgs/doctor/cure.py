"""The cured scene: what was read rightly, less the rows and bands that findings say to drop."""

import numpy as np

from brushgs.doctor.examination import Examination
from brushgs.quats import normalized
from brushgs.scene import Gaussians


def cure(examination: Examination) -> Gaussians:
    """Apply the cures of all findings.

    What no finding names stays as it is, bit for bit, in the order of the file.

    Args:
        examination: of a file.

    Returns:
        At least one Gaussian: no finding names more than a part of the scene to be dropped.
    """
    gaussians, findings = examination.gaussians, {f.name: f for f in examination.findings}
    keeps = np.ones(len(gaussians), bool)
    for finding in findings.values():
        if finding.rows is not None:
            keeps &= ~finding.rows
    assert keeps.any(), "each finding leaves half of what the former leave"
    if not keeps.all():
        gaussians = gaussians.take(keeps)
    quats, sh = gaussians.quats, gaussians.sh
    if "unnormalised-quaternions" in findings:
        quats = normalized(quats).astype(quats.dtype)
    if "empty-sh-bands" in findings:
        sh = sh[:, : findings["empty-sh-bands"].facts["terms"]]
    return Gaussians(gaussians.means, quats, gaussians.scales, gaussians.opacities, sh)
