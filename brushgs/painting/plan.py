"""From where, and when: the cameras of a job, one per frame, and the moments of a moving scene they see."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from operator import methodcaller
from typing import TYPE_CHECKING

from brushgs.options.choices import CLIP_FPS
from brushgs.options.painting import CleanConfig, PaintConfig, ViewConfig
from brushgs.options.sequence import GrowConfig, PathConfig
from brushgs.painting.clean import clean_scene
from brushgs.painting.clip import Clip, Film
from brushgs.painting.memory import Memory
from brushgs.painting.report import Report
from brushgs.painting.views import choose_camera, choose_first_view, known_first_view, plan_views
from brushgs.scene import Camera, FirstView, Gaussians

if TYPE_CHECKING:
    from brushgs.arrays import F64
    from brushgs.cameras.paths import CameraPath
    from brushgs.io.scenes.notes import LoadNotes


@dataclass(frozen=True, eq=False)
class Plan:
    """What is seen.

    Attributes:
        cameras: that strokes are made for: those of a path, or one; empty if no view is needed.
        frames: one camera per frame; None for a single picture.
        film: the moment of each frame; None for a still scene.
        first_view: how the scene is seen; None if neither a view nor an output needs it.
        is_path: whether the camera moves.
        is_framed: whether a view is framed on the scene, not given by a camera or a file.
        view: the options of the view, with the size and the place that a composed picture was given.
    """

    cameras: Sequence[Camera]
    frames: "CameraPath | None"
    film: Film | None
    first_view: FirstView | None
    is_path: bool
    is_framed: bool
    view: ViewConfig

    @property
    def shown(self) -> Sequence[Camera]:
        """One camera per frame."""
        return self.cameras if self.frames is None else self.frames.cameras


def plan_cameras(
    gaussians: Gaussians,
    notes: "LoadNotes | None",
    config: PaintConfig,
    views: Camera | PathConfig | GrowConfig | None,
    clip: Clip | None,
    report: Report,
    memory: Memory,
    *,
    check_path: "Callable[[CameraPath], None] | None",
    needs_view: bool,
    needs_first_view: bool,
) -> Plan:
    """Find the first view, and place the cameras.

    Args:
        gaussians: the scene, cleaned.
        notes: of its files.
        config: of the job.
        views: see `prepare`.
        clip: the moving scene; None for a still one.
        report: gets the stages.
        memory: see `prepare`.
        check_path: see `prepare`.
        needs_view: whether a view is needed.
        needs_first_view: whether the first view is found also where the cameras do not depend on it.

    Raises:
        SceneError: if a camera file cannot be used.
        ValueError: if an option does not suit the scene.
    """
    growing, views = (views, None) if isinstance(views, GrowConfig) else (None, views)
    is_framed, first_view = _is_framed(views, config, needs_view=needs_view), None
    moments: Iterable[Gaussians] = ()
    is_stored = notes is not None and notes.first_view is not None
    if clip is not None and (is_framed or needs_first_view) and not is_stored:
        clean = _without_floaters(clip, gaussians, notes, config.clean)
        if not clip.scene.has_rows or len(gaussians) == 0:
            gaussians = clean(clip.first_seen())
        moments = map(clean, clip.moments())
    if needs_first_view or is_framed:
        looking = config.view if is_framed else _with_up_of_views(gaussians, config.view, notes, views)
        first_view = memory.of(
            "first view",
            (gaussians, looking, notes),
            lambda: choose_first_view(gaussians, looking, notes, report, moments=moments),
        )
    cameras: Sequence[Camera] = []
    path, film, view = None, None, config.view
    if isinstance(views, PathConfig):
        if clip is not None and views.orbit is not None and views.fps is None:
            views = replace(views, fps=CLIP_FPS)
        path = plan_views(first_view or known_first_view(gaussians, notes), config.view, views, report)
        if clip is not None:
            film = clip.film(fps=path.fps, num_frames=len(path.cameras))
            path = replace(path, is_loop=path.is_loop and film.is_loop)
        cameras = path.cameras
    elif needs_view:
        is_composed = view.size == "auto" and is_framed and growing is None and clip is None
        if is_composed and first_view is not None:
            from brushgs.cameras.composition import composed

            view = composed(first_view, view, _lamp(first_view, config))
        camera = memory.of(
            "camera",
            (first_view, view, views),
            lambda: choose_camera(first_view, view, report, camera=views, is_composed=is_composed),
        )
        cameras = [camera]
    frames = path
    if path is None and cameras and (growing is not None or clip is not None):
        from brushgs.cameras.paths import standing

        if growing is not None:
            frames = standing(cameras[0], growing.num_frames, growing.rate)
        elif clip is not None:
            film = clip.film()
            frames = replace(standing(cameras[0], len(film.times), film.fps), is_loop=film.is_loop)
    if frames is not None and check_path is not None:
        check_path(frames)
    return Plan(cameras, frames, film, first_view, is_path=path is not None, is_framed=is_framed, view=view)


def _lamp(first_view: FirstView, config: PaintConfig) -> "F64 | None":
    """[3] direction toward the light of a stage, world axes; None where nothing throws a shadow."""
    if not config.ground.stage or config.ground.shadow == 0 or config.painted is not None:
        return None
    import numpy as np

    from brushgs.cameras.framing import camera_axes
    from brushgs.painting.lamp import towards_lamp
    from brushgs.passes.stage.place import lamp_direction

    axes = camera_axes(first_view.up, first_view.azimuth, 0.0)
    right, down, away = axes
    towards = towards_lamp(config.light, first_view, axes)
    return np.asarray(lamp_direction() @ np.stack([right, -down, away])) if towards is None else towards


def _with_up_of_views(
    gaussians: Gaussians,
    config: ViewConfig,
    notes: "LoadNotes | None",
    views: Camera | PathConfig | None,
) -> ViewConfig:
    """The view with the up axis of given cameras, where neither flags nor the file state it."""
    is_known = notes is not None and (notes.up is not None or notes.first_view is not None)
    if config.up is not None or is_known or isinstance(views, PathConfig) or len(gaussians) == 0:
        return config
    from brushgs.first_view.photographed import up_of_views

    if isinstance(views, Camera):
        cameras = [views]
    elif config.camera_file is not None:
        from brushgs.io.cameras.read import read_cameras

        cameras = list(read_cameras(config.camera_file).cameras)
    else:
        return config
    up = up_of_views(gaussians, cameras)
    return replace(config, up=(float(up[0]), float(up[1]), float(up[2])))


def _without_floaters(
    clip: Clip, gaussians: Gaussians, notes: "LoadNotes | None", config: CleanConfig
) -> Callable[[Gaussians], Gaussians]:
    """What is painted of a moment of a clip.

    Args:
        clip: the moving scene.
        gaussians: that stand for it, cleaned.
        notes: of its files.
        config: what a floater is.
    """
    if clip.scene.has_rows and len(gaussians):
        assert gaussians.ids is not None, "they are rows of a moving scene"
        return methodcaller("take", gaussians.ids)
    is_strokes = notes is not None and notes.is_strokes
    return lambda moment: clean_scene(moment, config, Report(), is_strokes=is_strokes)


def _is_framed(views: Camera | PathConfig | None, config: PaintConfig, *, needs_view: bool) -> bool:
    if views is None:
        return needs_view and config.view.camera_file is None
    return not isinstance(views, Camera) and views.orbit is not None
