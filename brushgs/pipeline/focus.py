"""The stages of `--focus` and `--depth-of-field`: from options to factors and a lens."""

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.options.focus import Focus
from brushgs.passes.seen import some_small
from brushgs.pipeline.maps import lightness
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import flatten
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.form.defocus import Lens
    from brushgs.values.arrays import F64, Array

DARK = 0.02  # luminance up to which a mask is dark
MOST = 0.95  # share of the Gaussians in focus above which the report says that it hardly matters
LENS_VIEWS, LENS_SIDE = 8, 240  # most views that measure the focus, and pixels of their longer side
SAME = 1.02  # contrast of factors up to which a focus has no effect


def open_mask(path: Path, width: int, height: int) -> "Array":
    """[height, width] lightness of a picture, 0 to 1, scaled to fill a view; transparent pixels are dark.

    Raises:
        SceneError: if the picture cannot be read, or is dark all over.
    """
    from brushgs.formats.pictures.images import read_image

    mask = lightness(flatten(read_image(path), 0.0), width, height)
    if not mask.max() > DARK:
        raise SceneError(path, "is dark all over, so there is no focus; paint light what more strokes go to")
    return mask


def place_focus(
    gaussians: Gaussians,
    focus: Focus | None,
    camera: Camera | None,
    first_view: FirstView | None,
    report: Report,
    *,
    num_threads: int | None = None,
) -> "F64 | None":
    """The factor [N] of each Gaussian on the strokes per area; None, without a stage, if there is no focus.

    Args:
        gaussians: N Gaussians to make strokes of.
        focus: where more strokes go.
        camera: the first view of the job, which a mask covers.
        first_view: of the scene, for its subject and salience.
        report: gets the stage.
        num_threads: None takes the processors available to this process.

    Raises:
        SceneError: if the mask cannot be read, is dark all over, or light only where the picture is empty.
        ValueError: if no part of the scene lies in the sphere.
    """
    if focus is None:
        return None
    with report.stage("focus") as stage:
        from brushgs.cameras.around import small_view
        from brushgs.passes.reduce.focus import auto_focus, contrast, mask_focus, sphere_focus, subject_focus

        if focus.mask is not None:
            assert camera is not None, "a mask lies over the first view"
            small = small_view(camera)
            mask = open_mask(focus.mask, small.width, small.height)
            factors = mask_focus(gaussians, small, mask, num_threads=num_threads)
            if not factors.max() > SAME:
                raise SceneError(
                    focus.mask, "is light only where the view shows nothing; paint light what it shows"
                )
        elif focus.sphere is not None:
            *center, radius = focus.sphere
            factors = sphere_focus(gaussians, center, radius)
            if not factors.max() > SAME:
                low, high = gaussians.means.min(axis=0), gaussians.means.max(axis=0)
                raise ValueError(
                    f"focus must lie in the scene, got {focus}; nothing is there, the scene spans "
                    f"{_point(low)} to {_point(high)}"
                )
        else:
            assert first_view is not None, "the subject is that of the first view"
            factors = (auto_focus if focus.is_auto else subject_focus)(gaussians, first_view)
        in_focus = int(np.count_nonzero(factors > 0.5 * (1 + factors.max())))
        stage.did = f"{focus}: {in_focus:,} of {len(gaussians):,} Gaussians"
        stage.counts = {"focus": str(focus), "gaussians": len(gaussians), "in_focus": in_focus}
        if contrast(factors) <= SAME:
            why = "nothing stands out" if focus.is_auto else "all of the scene is in it"
            stage.skipped.append(f"focus: {why}")
            if not focus.is_auto:
                cure = "name a smaller area, a sphere X,Y,Z,R or a picture that is light there"
                warnings.warn(SceneWarning(f"--focus {focus} changes nothing: {why}; {cure}"), stacklevel=2)
            return None
        if in_focus > MOST * len(gaussians):
            stage.did += "; that is nearly all, so little changes"
    return factors


def open_lens(
    gaussians: Gaussians,
    focus: "F64 | None",
    first_view: FirstView | None,
    cameras: Sequence[Camera],
    report: Report,
    *,
    num_threads: int | None = None,
) -> "Lens":
    """What is in focus in some views of the job: where strokes are dense, else the subject.

    Without either, as in scenes seen from inside, the middle of the pictures is in focus.

    Args:
        gaussians: N >= 1 Gaussians to make strokes of.
        focus: [N] factors on the strokes per area; None without a focus.
        first_view: of the scene, for its subject; None if unknown.
        cameras: of the job.
        report: gets the stage.
        num_threads: None takes the processors available to this process.
    """
    with report.stage("lens") as stage:
        from brushgs.passes.form.defocus import focused
        from brushgs.passes.reduce.focus import contrast, subject_focus

        if focus is None and first_view is not None and first_view.eye is None:
            focus = subject_focus(gaussians, first_view)
        is_focus = None if focus is None or contrast(focus) <= SAME else focus > 0.5 * (1 + focus.max())
        small = some_small(cameras, LENS_VIEWS, LENS_SIDE)
        found = focused(gaussians, small, is_focus, num_threads=num_threads)
        low, high = found.depths.mean(axis=0)
        what = "the middle of the picture" if is_focus is None else "the focus"
        stage.did = f"{what} is sharp, {low:.3g} to {high:.3g} away, in {len(small)} views"
        stage.counts = {"views": len(small), "depths": found.depths.round(4).tolist()}
    return found


def _point(numbers: "Array") -> str:
    return ",".join(f"{number:.3g}" for number in numbers)
