"""The rig of a job: where its eyes stand, and the views that strokes are made for."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.cameras.around import MOST_OF_PATH, point_ahead, small_view, subject_ahead
from brushgs.cameras.framing import distance_ahead
from brushgs.options.painting import ViewConfig
from brushgs.options.projection import USUAL_SHARE, ProjectionConfig
from brushgs.pipeline.job_views import is_from_outside
from brushgs.pipeline.report import Report
from brushgs.rendering.rigs import Rig
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians


def leveled(camera: Camera, up: F64) -> Camera:
    """The camera in the same place with a level horizon: a sphere looks up and down by itself."""
    _, down, ahead = camera.viewmat[:3, :3]
    level = ahead - (ahead @ up) * up
    if np.linalg.norm(level) < 1e-6:  # it looked straight down, or up: what was above lies ahead
        level = -down * (1 if ahead @ up < 0 else -1)
    size = {"width": camera.width, "height": camera.height, "near": camera.near}
    turned = Camera.look_at(camera.position, camera.position + level, up, **size)  # type: ignore[arg-type]
    return replace(turned, K=camera.K)


def views_of(projection: ProjectionConfig, placed: Sequence[Camera]) -> Sequence[Camera]:
    """The views that strokes are made for: of a sphere all faces, of a few frames."""
    if not projection.is_spherical:
        return placed
    rig = Rig(projection)
    faces = rig.guides(placed[0])
    num = min(max(MOST_OF_PATH // len(faces), 1), len(placed))
    return [face for i in range(num) for face in rig.guides(placed[i * len(placed) // num])]


def open_rig(
    projection: ProjectionConfig,
    gaussians: Gaussians,
    camera: Camera,
    first_view: FirstView | None,
    view: ViewConfig,
    report: Report,
    *,
    is_framed: bool,
) -> Rig:
    """The rig of a projection that is not plain, with the distance between its eyes.

    Args:
        projection: the options.
        gaussians: the scene.
        camera: of the first frame.
        first_view: of the scene; required if the camera is framed.
        view: the framing options.
        report: gets a note on a distance that is not given.
        is_framed: whether the camera was framed by the options.
    """
    if projection.stereo is None:
        return Rig(projection)
    if projection.ipd is not None:
        return Rig(projection, projection.ipd)
    distance = _subject_distance(gaussians, camera, first_view if is_framed else None, view)
    ipd = float(f"{USUAL_SHARE * distance:.3g}")
    report.tell(f"the eyes are {ipd:g} apart, 1/30 of the distance to the subject; --ipd changes it")
    return Rig(projection, ipd)


def _subject_distance(
    gaussians: Gaussians, camera: Camera, first_view: FirstView | None, view: ViewConfig
) -> float:
    """Distance from the camera to its subject, world units, > 0."""
    if first_view is None:
        from brushgs.brushes.texture import StrokeTexture
        from brushgs.rendering.render import render

        small = small_view(camera)
        point = point_ahead(small, render(gaussians, small, StrokeTexture.open("gaussian")))
    elif first_view.eye is not None and not is_from_outside(view):
        return distance_ahead(first_view, camera.viewmat[:3, :3])
    else:
        point = subject_ahead(camera, first_view, view.look_at)
    return max(float(np.linalg.norm(point - camera.position)), camera.near)
