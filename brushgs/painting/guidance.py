"""What strokes are made by, beside the scene itself: views of it, a field of directions, and a focus.

All of it belongs to the job, not to a frame: a frame that is painted alone has the same.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from brushgs.options.focus import Focus
from brushgs.options.painting import PaintConfig
from brushgs.painting.focus import place_focus
from brushgs.painting.job_views import draw_job_views
from brushgs.painting.report import Report
from brushgs.painting.styling import Styles, directions_of
from brushgs.painting.views import choose_first_view
from brushgs.scene import Camera, FirstView, Gaussians

if TYPE_CHECKING:
    from brushgs.arrays import F64
    from brushgs.io.guides.guide_file import Guides
    from brushgs.io.scenes.notes import LoadNotes
    from brushgs.options.direction import FieldName
    from brushgs.passes.direction.marks import Marks
    from brushgs.rendering.plain import PlainViews


@dataclass(frozen=True, eq=False)
class Guidance:
    """What strokes are made by, beside the scene.

    Attributes:
        camera: the first view of the job; None where none is needed.
        first_view: how the scene is seen; None where that is not needed.
        views: small plain pictures; None where strokes are made by the scene alone.
        field: which way strokes run, as `orient` takes it; None where they stay as they are.
    """

    camera: Camera | None = None
    first_view: FirstView | None = None
    views: "PlainViews | None" = None
    field: "FieldName | Guides | Marks | None" = None

    def focus(
        self, gaussians: Gaussians, focus: Focus | None, report: Report, *, num_threads: int | None
    ) -> "F64 | None":
        """The factors of a focus, see `place_focus`."""
        return place_focus(gaussians, focus, self.camera, self.first_view, report, num_threads=num_threads)

    def with_finest(self, gaussians: Gaussians) -> Gaussians:
        """Gaussians with `finest`, the finest line that the views show; as they are where there are none."""
        if self.views is None:
            return gaussians
        from brushgs.passes.finest import finest_of

        return replace(gaussians, finest=finest_of(gaussians, self.views.cameras))


def open_guidance(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    config: PaintConfig,
    styles: Styles | None,
    notes: "LoadNotes | None",
    report: Report,
    *,
    first_view: FirstView | None,
    is_path: bool,
    is_framed: bool,
    with_ring: bool,
) -> Guidance:
    """Open and draw what options ask for.

    Args:
        gaussians: the whole scene, N >= 1.
        cameras: of the picture or the path; empty where no view is needed.
        config: the options.
        styles: of the painting, whose marks strokes may follow.
        notes: of the scene file.
        report: gets the stages.
        first_view: of the scene, where it is known.
        is_path: see `draw_job_views`, as for what follows.
        is_framed: whether the options framed the camera.
        with_ring: whether strokes are for all of the scene.

    Raises:
        SceneError: if a file cannot be used.
    """
    passes = config.strokes
    sees = passes.see == "views"
    if first_view is None and (sees or passes.focus is not None):
        # It decides nothing that is shown: no stage, and no doubt about it is told.
        first_view = choose_first_view(gaussians, config.view, notes, Report())
    camera, views = cameras[0] if cameras else None, None
    field: FieldName | Guides | Marks | None = None
    if passes.direction.kind == "style":
        field = directions_of(styles, camera)
    elif passes.direction.kind != "own":
        from brushgs.passes.direction.open_field import open_field

        field = open_field(passes.direction, camera)
    if sees:
        assert first_view is not None, "it was chosen above"
        views = draw_job_views(
            gaussians,
            cameras,
            config.view,
            report,
            first_view=first_view,
            is_path=is_path,
            is_framed=is_framed,
            with_ring=with_ring,
            depth=config.media.draws_lines,
            num_threads=config.draw.threads,
        )
    return Guidance(camera, first_view, views, field)
