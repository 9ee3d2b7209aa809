"""Steps that choose the view of a scene, its painted part, and the ground."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import radians
from operator import methodcaller
from typing import TYPE_CHECKING

from brushgs.options.choices import CLIP_FPS, Canvas
from brushgs.options.look_parts import GroundConfig, LightConfig
from brushgs.options.output import OutputConfig
from brushgs.options.painting import CleanConfig, DrawConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import GrowConfig, PathConfig
from brushgs.options.where import WhereConfig
from brushgs.pipeline.backdrop import needs_place
from brushgs.pipeline.background import Background
from brushgs.pipeline.clean import clean_scene, drop_crumbs
from brushgs.pipeline.clip import Clip, Film
from brushgs.pipeline.count import open_view_model
from brushgs.pipeline.drawing import open_picture_background, render_options
from brushgs.pipeline.look import open_surface
from brushgs.pipeline.regions import Regions
from brushgs.pipeline.report import Report
from brushgs.pipeline.rigs import leveled, open_rig, views_of
from brushgs.pipeline.runner import Later, costly, makes, unless
from brushgs.pipeline.steps.opening import Views
from brushgs.pipeline.styling import Styles
from brushgs.pipeline.views import choose_camera, choose_first_view, known_first_view, plan_views, with_up_of
from brushgs.pipeline.where import Rest, part, split_where
from brushgs.rendering.rigs import Rig
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.cameras.paths import CameraPath
    from brushgs.rendering.surface import Surface
    from brushgs.stroke_count.view_model import ViewModel
    from brushgs.values.arrays import F64
    from brushgs.values.notes import LoadNotes

SPHERE_FOV = radians(90.0)  # that a subject fills; sets the distance of the camera of a sphere


def is_moving(source: SceneFiles | Gaussians | Clip) -> bool:
    """Whether the scene moves."""
    return isinstance(source, Clip)


def is_framed(views: Views, view_config: ViewConfig) -> bool:
    """Whether the view is framed on the scene, not given by a camera or a file."""
    if views is None or isinstance(views, GrowConfig):
        return view_config.camera_file is None
    return not isinstance(views, Camera) and views.orbit is not None


def is_placed(
    is_framed: bool,
    styles: Styles | None,
    regions: Regions | None,
    painted_config: WhereConfig | None,
    on_background: bool,
    ground_config: GroundConfig,
    cleaned: Later[Gaussians],
    views: Views,
) -> bool:
    """Whether the position of the scene in the picture matters, not only its light."""
    named = any(one is not None and one.needs_first_view for one in (styles, regions, painted_config))
    if is_framed or named:
        return True
    if not on_background or not isinstance(views, Camera):
        return on_background and ground_config.stage
    return needs_place(ground_config, cleaned(), views)


def standing_config(view_config: ViewConfig) -> ViewConfig:
    """The options of the view that decide how the scene is oriented."""
    given = view_config
    return ViewConfig(
        camera_file=given.camera_file,
        up=given.up,
        azimuth=given.azimuth,
        elevation=given.elevation,
        side=given.side,
    )


@costly
def first_view(
    cleaned: Gaussians,
    notes: "LoadNotes | None",
    standing_config: ViewConfig,
    views: Views,
    is_framed: bool,
    clip: Clip | None,
    clean_config: CleanConfig,
    report: Report,
) -> FirstView:
    """The orientation of the scene, and where it is seen from first."""
    gaussians = cleaned
    moments: Iterable[Gaussians] = ()
    if clip is not None and (notes is None or notes.first_view is None):
        clean = _without_floaters(clip, gaussians, notes, clean_config)
        if not clip.scene.has_rows or len(gaussians) == 0:
            gaussians = clean(clip.first_seen())
        moments = map(clean, clip.moments())
    looking = standing_config
    if not is_framed and not isinstance(views, PathConfig):
        looking = with_up_of(gaussians, standing_config, notes, views if isinstance(views, Camera) else None)
    return choose_first_view(gaussians, looking, notes, report, moments=moments)


def is_stance_seen(is_placed: bool, lighting: LightConfig, on_background: bool) -> bool:
    """Whether the painting depends on the orientation of the scene."""
    return is_placed or (on_background and lighting.is_in_scene)


@unless(lambda is_stance_seen: None if is_stance_seen else "it does not show how the scene stands")
def stance(first_view: FirstView) -> FirstView:
    """The orientation of the scene; None if nothing depends on it."""
    return first_view


@makes("view", "is_composed")
def composed_view(
    view_config: ViewConfig,
    stance: FirstView | None,
    is_framed: bool,
    views: Views,
    clip: Clip | None,
    cast_light: "Later[F64 | None]",
) -> tuple[ViewConfig, bool]:
    """The options of the view, with the size and position of a composed picture."""
    is_composed = view_config.is_composable and is_framed and views is None and clip is None
    if not is_composed or stance is None or stance.photograph is not None:
        return view_config, False
    from brushgs.cameras.composition import composed

    return composed(stance, view_config, cast_light()), is_composed


def cast_light(
    stance: FirstView | None, ground_config: GroundConfig, painted_config: WhereConfig | None
) -> "F64 | None":
    """[3] direction toward the light whose shadow a picture has room for, world axes; None without shadows.

    It is that of the usual lamp, so that another lamp keeps the composition, and its strokes.
    """
    if not ground_config.stage or ground_config.shadow == 0 or painted_config is not None or stance is None:
        return None
    from brushgs.pipeline.lamp import usual_light

    return usual_light(stance)


@makes("frame_cameras", "path", "film")
def planned(
    stance: FirstView | None,
    cleaned: Gaussians,
    notes: "LoadNotes | None",
    views: Views,
    view: ViewConfig,
    is_composed: bool,
    is_framed: bool,
    projection_config: ProjectionConfig,
    clip: Clip | None,
    output_config: OutputConfig,
    check_path: "Callable[[CameraPath], None] | None",
    report: Report,
) -> "tuple[Sequence[Camera], CameraPath | None, Film | None]":
    """The cameras; the path, one camera per frame; and the moments of a clip."""
    if projection_config.is_spherical:
        view = replace(view, fov_y=SPHERE_FOV)
    up = stance.up if stance is not None and projection_config.is_spherical and is_framed else None
    film: Film | None = None
    path: CameraPath | None = None
    if isinstance(views, PathConfig):
        if clip is not None and views.orbit is not None and views.fps is None:
            views = replace(views, fps=CLIP_FPS)
        path = plan_views(stance or known_first_view(cleaned, notes), view, views, report)
        if clip is not None:
            film = clip.film(fps=path.fps, num_frames=len(path.cameras))
            path = replace(path, is_loop=path.is_loop and film.is_loop)
        path = replace(path, cameras=_leveled(path.cameras, up))
        cameras = path.cameras
    else:
        given = views if isinstance(views, Camera) else None
        cameras = _leveled([choose_camera(stance, view, report, camera=given, is_composed=is_composed)], up)
        path, film = _held(cameras[0], views, clip)
    _check_crop(output_config.crop, cameras[0])
    if path is not None and check_path is not None:
        check_path(path)
    return cameras, path, film


def _leveled(cameras: list[Camera], up: "F64 | None") -> list[Camera]:
    return cameras if up is None else [leveled(camera, up) for camera in cameras]


def _held(camera: Camera, views: Views, clip: Clip | None) -> "tuple[CameraPath | None, Film | None]":
    """The frames of a camera that stands still, if there are several, and their moments."""
    if isinstance(views, GrowConfig):
        return _standing(camera, views.num_frames, views.rate), None
    if clip is None:
        return None, None
    film = clip.film()
    return replace(_standing(camera, len(film.times), film.fps), is_loop=film.is_loop), film


def _check_crop(crop: tuple[int, int, int, int] | None, camera: Camera) -> None:
    """Refuse a part that does not lie in the picture.

    Raises:
        ValueError: if it does not.
    """
    if crop is not None and not Part(*crop).is_in(camera.width, camera.height):
        size, text = f"{camera.width}x{camera.height}", ",".join(map(str, crop))
        raise ValueError(f"crop must lie in the picture of {size} pixels, got {text}")


def shown(frame_cameras: Sequence[Camera], path: "CameraPath | None") -> Sequence[Camera]:
    """One camera per frame."""
    return frame_cameras if path is None else path.cameras


def cameras(frame_cameras: Sequence[Camera], projection_config: ProjectionConfig) -> Sequence[Camera]:
    """The cameras that strokes are made for."""
    return views_of(projection_config, frame_cameras)


@unless(lambda projection_config: "one pinhole camera" if projection_config.is_plain else None)
def rig(
    projection_config: ProjectionConfig,
    cleaned: Gaussians,
    shown: Sequence[Camera],
    stance: FirstView | None,
    view: ViewConfig,
    is_framed: bool,
    report: Report,
) -> Rig:
    """The cameras of each frame, for spheres and two eyes."""
    return open_rig(projection_config, cleaned, shown[0], stance, view, report, is_framed=is_framed)


def _no_crumbs(is_moving: bool, clean_config: CleanConfig, is_strokes: bool) -> str | None:
    if is_moving:
        return "the rows of a clip are those of all moments"
    return None if clean_config.drops_crumbs and not is_strokes else "nothing is cleaned away"


@costly
@unless(_no_crumbs, "cleaned")
def whole(cleaned: Gaussians, stance: FirstView | None, report: Report) -> Gaussians:
    """The Gaussians without crumbs below an object."""
    return cleaned if stance is None or len(cleaned) == 0 else drop_crumbs(cleaned, stance, report)


def _no_gaps(notes: "LoadNotes | None", views: Views) -> str | None:
    if notes is None or notes.photograph is None:
        return "the scene was not predicted from one photograph"
    return None if isinstance(views, PathConfig) else "the camera does not move"


@unless(_no_gaps, "whole")
def filled(whole: Gaussians, first_view: FirstView, views: Views, report: Report) -> Gaussians:
    """The Gaussians with those behind edges, which gaps show as the camera moves."""
    with report.stage("gaps") as stage:
        from brushgs.first_view.from_photograph import ANGLES
        from brushgs.passes.add.behind import behind

        assert first_view.photograph is not None
        assert isinstance(views, PathConfig)
        angle = float(ANGLES[0]) if views.orbit is None else views.sway or first_view.photograph.cone
        added = behind(whole, first_view.photograph, angle)
        stage.did = f"{len(added):,} Gaussians behind edges"
        stage.counts = {"added": len(added)}
    return Gaussians.joined([whole, added])


@makes("inside", "plain")
@unless(lambda painted_config: "all is painted" if painted_config is None else None, "filled", None)
def parted(
    filled: Gaussians,
    painted_config: WhereConfig,
    stance: FirstView | None,
    threads: int | None,
    report: Report,
) -> tuple[Gaussians, Gaussians | None]:
    """The painted Gaussians, and the unpainted ones that are shown too."""
    return part(filled, painted_config, stance, report, num_threads=threads)


@unless(lambda rules_config: "no --rules" if rules_config is None else None, "inside")
def placed(
    inside: Gaussians, regions: Regions, stance: FirstView | None, threads: int | None, report: Report
) -> Gaussians:
    """The Gaussians with the labels of their parts."""
    return regions.place(inside, stance, report, num_threads=threads)


@makes("subject", "rest")
@unless(lambda where: "no --where" if where is None else None, "placed", None)
def split(
    numbered: Gaussians,
    placed: Gaussians,
    where: WhereConfig,
    clip: Clip | None,
    first_view: FirstView,
    report: Report,
) -> tuple[Gaussians, Rest]:
    """The Gaussians that become strokes, and the rest of the scene."""
    return split_where(numbered, placed, where, first_view, report, clip)


@unless(lambda on_background: None if on_background else "the picture has no background")
def background(draw_config: DrawConfig, cameras: Sequence[Camera], report: Report) -> Background:
    """The background behind the painting; None for transparent."""
    return open_picture_background(draw_config, cameras[0], report)


def _no_ground(ground_config: GroundConfig, canvas: tuple[Canvas, float]) -> str | None:
    return "no ground and no canvas" if ground_config.ground == canvas[0] == "none" else None


def canvas(light_config: LightConfig) -> tuple[Canvas, float]:
    """The canvas under the paint, and the strength of its grain."""
    return light_config.canvas, light_config.canvas_strength


@unless(_no_ground)
def ground(
    ground_config: GroundConfig,
    canvas: tuple[Canvas, float],
    background_name: str,
    whole: Gaussians,
    cameras: Sequence[Camera],
    view: ViewConfig,
    report: Report,
) -> "Surface | None":
    """The ground below the strokes, in its own color."""
    return open_surface(ground_config, canvas, background_name, whole, cameras[0], report, dpi=view.dpi)


@unless(lambda clustering: "the number of strokes is given" if clustering.target is None else None)
def view_model(
    subject: Gaussians,
    cameras: Sequence[Camera],
    texture: "BrushSet",
    draw_config: DrawConfig,
    on_background: bool,
    background: Background,
    ground: "Surface | None",
    report: Report,
) -> "ViewModel":
    """The view for which the number of strokes is chosen."""
    # The count is chosen for a still in the default order, whatever is painted, before strokes have fields.
    still = render_options(replace(draw_config, lock="anchor", order=None), texture, along_path=False)
    behind = background if on_background else open_picture_background(draw_config, cameras[0], report)
    behind = behind if ground is None or behind is None else ground.rgb
    return open_view_model(subject, cameras[0], texture, still, behind, report)


def _standing(camera: Camera, num_frames: int, fps: float) -> "CameraPath":
    from brushgs.cameras.paths import standing

    return standing(camera, num_frames, fps)


def _without_floaters(
    clip: Clip, gaussians: Gaussians, notes: "LoadNotes | None", config: CleanConfig
) -> Callable[[Gaussians], Gaussians]:
    """The painted Gaussians of a moment of a clip.

    Args:
        clip: the moving scene.
        gaussians: represent the clip, cleaned.
        notes: of its files.
        config: defines floaters.
    """
    if clip.scene.has_rows and len(gaussians):
        assert gaussians.ids is not None, "they are rows of a moving scene"
        return methodcaller("take", gaussians.ids)
    is_strokes = notes is not None and notes.is_strokes
    return lambda moment: clean_scene(moment, config, Report(), is_strokes=is_strokes)
