"""The stage that draws the guide views of strokes: a few small plain pictures, chosen once per job.

They are not taken from larger pictures of the same view, such as the truth of `--strokes auto`: strokes must
depend neither on how their number was chosen nor on the size of the picture.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from brushgs.options.painting import ViewConfig
from brushgs.pipeline.report import Report
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.rendering.plain import PlainViews


def draw_job_views(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    view: ViewConfig,
    report: Report,
    *,
    first_view: FirstView,
    is_path: bool,
    is_framed: bool,
    with_ring: bool,
    depth: bool,
    num_threads: int | None,
) -> "PlainViews":
    """Draw the scene in the views of a job, see `brushgs.cameras.around`.

    Args:
        gaussians: the scene, N >= 1.
        cameras: those of the picture or the path.
        view: the framing options.
        report: gets the stage.
        first_view: of the scene, where the ring begins.
        is_path: whether the cameras are a path, whose own views replace those near a picture.
        is_framed: whether the camera of a picture was framed by the options, not given or from a file.
        with_ring: whether to include views from all around the scene.
        depth: see `plain_views`.
        num_threads: None takes the processors available to this process.
    """
    with report.stage("plain views") as stage:
        from brushgs.cameras.around import near_views, path_views, ring_views
        from brushgs.rendering.plain import plain_views

        is_inside = first_view.eye is not None and not (is_framed and is_from_outside(view))
        if is_path:
            own, words = path_views(cameras), "of the path"
        else:
            target = _target(gaussians, cameras[0], view, first_view, is_framed, is_inside, num_threads)
            own, words = near_views(cameras[0], target, first_view.up), "near this one"
        width, height = cameras[0].width, cameras[0].height
        ring = ring_views(first_view, width, height, from_outside=not is_inside) if with_ring else []
        views = plain_views(gaussians, [*own, *ring], depth=depth, num_threads=num_threads)
        around = f", {len(ring)} {'from where it stands' if is_inside else 'around the subject'}"
        small = f"{own[0].width}x{own[0].height}"
        stage.did = f"{len(own)} small pictures of views {words}{around if ring else ''}, {small}"
        is_blank = not any(frame.alpha.any() for frame in views.frames)
        if is_blank:
            stage.did += "; they show nothing: strokes are made by the scene alone"
        stage.counts = {
            "views": len(own) + len(ring),
            "is_blank": is_blank,
            "own": len(own),
            "ring": len(ring),
            "width": own[0].width,
            "height": own[0].height,
        }
    return views


def is_from_outside(view: ViewConfig) -> bool:
    """Whether options request a view from outside even of a scene that is seen from inside."""
    return view.look_at is not None or view.side is not None


def _target(
    gaussians: Gaussians,
    camera: Camera,
    view: ViewConfig,
    first_view: FirstView,
    is_framed: bool,
    is_inside: bool,
    num_threads: int | None,
) -> F64:
    """[3] the pivot of a camera: its own position inside a scene, else its target."""
    from brushgs.cameras.around import point_ahead, small_view, subject_ahead

    if is_inside:
        return camera.position
    if is_framed:
        return subject_ahead(camera, first_view, view.look_at)
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.rendering.render import render

    small = small_view(camera)
    plain = render(gaussians, small, StrokeTexture.open("gaussian"), num_threads=num_threads)
    return point_ahead(small, plain)
