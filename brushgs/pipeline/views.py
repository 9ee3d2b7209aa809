"""The stages that choose the view: the first view of a scene, one camera, or a path.

Only `choose_first_view` examines a scene for its first view.
"""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.cameras.composition import format_name
from brushgs.cameras.first_view import flags_of, framed_camera, sayable, up_text
from brushgs.cameras.framing import AXES, DEFAULT_UP, plain_first_view, unit_of, with_up
from brushgs.errors import SceneError
from brushgs.formats.cameras.read import name_beside
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import CleanConfig, Up, ViewConfig
from brushgs.options.table import row_of
from brushgs.pipeline.cameras_beside import Beside, view_beside
from brushgs.pipeline.clean import clean_scene
from brushgs.pipeline.report import Report, Stage
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.options.sequence import PathConfig
    from brushgs.values.notes import LoadNotes


def choose_first_view(
    gaussians: Gaussians,
    config: ViewConfig,
    notes: "LoadNotes | None",
    report: Report,
    *,
    moments: Iterable[Gaussians] = (),
) -> FirstView:
    """The first view of a scene: from its file, from fitting cameras beside it, or estimated from the scene.

    Args:
        gaussians: the scene as loaded, N >= 1.
        config: `up` has precedence; no front is searched for if `azimuth` is given.
        notes: of the file; those of strokes hold the first view of their scene, used unchanged.
        report: gets the stage.
        moments: of a moving scene; the view must have room for all.

    Raises:
        ValueError: if there are no Gaussians, or `up` is zero.
    """
    with report.stage("first view") as stage:
        view, how, known, beside = (
            _stored_view(config, notes)
            or _photographed(gaussians, config, notes)
            or _found_view(gaussians, config, notes, moments)
        )
        _describe_first_view(stage, view, how, known)
        if view.photograph is not None:
            stage.did += (
                f", sound {np.degrees(view.photograph.cone):.0f} degrees to each side of its photograph"
            )
        if not view.is_front_sure and config.side is None:
            stage.did += ", the front is a guess (--from back shows the other side)"
        if beside is not None:
            stage.counts |= {"cameras": None if beside.path is None else str(beside.path)}
            report.tell(beside.note)
        if config.up is None and in_doubt(view):
            report.tell(_doubt_and_cure(view))
    return view


class _Found(NamedTuple):
    """A first view, its source, in words and for machines, and the result from cameras beside the scene."""

    view: FirstView
    how: str
    known: str
    beside: Beside | None = None


def _stored_view(config: ViewConfig, notes: "LoadNotes | None") -> _Found | None:
    """The first view of the scene of strokes, from their notes."""
    stored = None if notes is None else notes.first_view
    if stored is None:
        return None
    if config.up is None:
        return _Found(stored, "that of the scene", "strokes")
    view = stored if _is_up_of(stored, config.up) else with_up(stored, config.up)
    return _Found(view, "as given", "flag")


def _photographed(gaussians: Gaussians, config: ViewConfig, notes: "LoadNotes | None") -> _Found | None:
    """The view of the photograph that a scene was predicted from."""
    if notes is None or notes.photograph is None:
        return None
    from brushgs.first_view.from_photograph import view_of_photograph

    view = view_of_photograph(gaussians, notes.photograph, up=config.up)
    return _Found(
        view, "as given" if config.up else "from its photograph", "flag" if config.up else "photograph"
    )


def _found_view(
    gaussians: Gaussians, config: ViewConfig, notes: "LoadNotes | None", moments: Iterable[Gaussians]
) -> _Found:
    """The first view from cameras beside the scene, or estimated."""
    from brushgs.first_view import find_first_view, with_moments

    stated = config.up or (None if notes is None else notes.up)
    beside = view_beside(gaussians, config, notes, stated)
    view = None if beside is None else beside.view
    if view is None:
        azimuth = None if config.side is not None else config.azimuth
        view = find_first_view(gaussians, up=stated, azimuth=azimuth)
    view = sayable(with_moments(view, moments))
    if stated is not None:
        how, known = ("as given", "flag") if config.up else ("from the file", "header")
        return _Found(replace(view, up=unit_of(stated)), how, known, beside)
    if beside is not None and beside.path is not None:
        return _Found(view, f"from {name_beside(beside.path)}", "cameras", beside)
    how, known = ("not sure", "assumed") if in_doubt(view) else ("estimated", "estimate")
    return _Found(view, how, known, beside)


def with_up_of(
    gaussians: Gaussians,
    config: ViewConfig,
    notes: "LoadNotes | None",
    camera: Camera | None,
) -> ViewConfig:
    """The view with the up axis of a given camera or those of a file, unless flags or notes state one."""
    is_known = notes is not None and (notes.up is not None or notes.first_view is not None)
    is_known |= notes is not None and notes.photograph is not None
    if config.up is not None or is_known or len(gaussians) == 0:
        return config
    from brushgs.first_view.photographed import up_of_views

    if camera is not None:
        cameras = [camera]
    elif config.camera_file is not None:
        from brushgs.formats.cameras.read import read_cameras

        cameras = list(read_cameras(config.camera_file).cameras)
    else:
        return config
    up = up_of_views(gaussians, cameras)
    return replace(config, up=(float(up[0]), float(up[1]), float(up[2])))


def default_first_view(
    gaussians: Gaussians, notes: "LoadNotes | None", report: Report, *, up: Up | None = None
) -> FirstView:
    """The default first view of `render`, without floaters; for passes that need no view.

    A given `up` is used.
    """
    if notes is None or notes.first_view is None:
        is_strokes = notes is not None and notes.is_strokes
        gaussians = clean_scene(gaussians, CleanConfig(), Report(), is_strokes=is_strokes)
    return choose_first_view(gaussians, ViewConfig(up=up), notes, report)


def known_first_view(gaussians: Gaussians, notes: "LoadNotes | None") -> FirstView | None:
    """A first view for the position and size of the subject only; None if there are no Gaussians."""
    if notes is not None and notes.first_view is not None:
        return notes.first_view
    return plain_first_view(gaussians) if len(gaussians) else None


def choose_camera(
    first_view: FirstView | None,
    config: ViewConfig,
    report: Report,
    *,
    camera: Camera | None = None,
    is_composed: bool = False,
) -> Camera:
    """The given camera, or one of the camera file, or one framed on the scene.

    Args:
        first_view: of the scene; None only if a camera or a camera file is given.
        config: see `ViewConfig`.
        report: gets the stage.
        camera: used if given.
        is_composed: whether the options come from `composed`: then the report includes the size in the flags
            that reproduce the picture.
    """
    with report.stage("camera") as stage:
        if camera is not None:
            stage.did = "given"
            if config.fixed_size is not None:
                camera = camera.resized(*config.fixed_size)
        elif config.camera_file is not None:
            camera = _camera_of_file(config.camera_file, config, stage)
        else:
            assert first_view is not None, "choose a first view before framing"
            camera = framed_camera(first_view, config)
            flags = flags_of(first_view, config)
            stage.did = f"framed: {flags}, {camera.width}x{camera.height}"
            if is_composed:
                flags = f"--size {row_of(ViewConfig, 'size').text_of(config.size)} {flags}"
                stage.did = f"composed as a {format_name(camera.width, camera.height)}: {flags}"
            stage.counts = {"source": "framed", "flags": flags, "is_composed": is_composed}
            if first_view.has_surroundings and config.look_at in (None, "subject"):
                stage.details.append(
                    "the view is framed on the middle of the scene; --look-at scene shows all"
                )
        if stage.counts.get("source") != "framed":
            stage.did += f", {camera.width}x{camera.height}"
        stage.counts |= {"width": camera.width, "height": camera.height}
    return camera


def plan_views(
    first_view: FirstView | None, view: ViewConfig, path_config: "PathConfig", report: Report
) -> "CameraPath":
    """Place the cameras along a path, one per frame; see `plan_path`."""
    with report.stage("path") as stage:
        from brushgs.cameras.paths import plan_path

        path = plan_path(first_view, view, path_config)
        count, camera = len(path.cameras), path.cameras[0]
        size, kind = f"{camera.width}x{camera.height}", "a loop" if path.is_loop else "open"
        stage.did = f"{count:,} frames, {path.fps:g} per second, {kind}, {size}: {path.source}"
        stage.counts = {
            "source": path.source,
            "frames": count,
            "fps": path.fps,
            "loop": path.is_loop,
            "width": camera.width,
            "height": camera.height,
        }
    return path


def in_doubt(view: FirstView) -> bool:
    """Whether the up axis was estimated and may well be wrong."""
    from brushgs.first_view.up import SURE

    return view.probability is not None and view.probability < SURE


def doubt_in_words(view: FirstView) -> str:
    """The likely axes and the chosen one: "not sure which way is up (+z 0.41, -y 0.38): -y is taken"."""
    from brushgs.first_view.up import ranking_text

    taken = _axis_of(view)
    return f"not sure which way is up ({ranking_text(view.ups, taken)}): {taken} is taken"


def _axis_of(view: FirstView) -> str:
    """The up axis in words, perhaps tilted."""
    return max(AXES, key=lambda name: float(view.up @ AXES[name]))


def _is_up_of(view: FirstView, up: Up) -> bool:
    """Whether a given up axis is that of a view."""
    return bool(np.allclose(unit_of(up), view.up, rtol=0, atol=1e-12))


def _describe_first_view(stage: Stage, view: FirstView, how: str, known: str) -> None:
    tilt = float(np.degrees(np.arccos(min(float(np.abs(view.up).max()), 1.0))))
    if known == "estimate" and tilt > 0:
        stage.details.append(f"the ground leans by {tilt:.1f} degrees; up is perpendicular to it")
    up, sure = up_text(view.up), "" if view.probability is None else f", probability {view.probability:.2f}"
    kind = "seen from inside" if view.eye is not None else "seen from outside"
    if view.has_surroundings and view.eye is None:
        kind = "a subject in surroundings"
    stage.did = f"up is {up} ({how}{sure}), {kind}"
    stage.counts = {
        "up": up,
        "up_from": known,
        "probability": view.probability,
        "ups": dict(view.ups),
        "azimuth_deg": round(float(np.degrees(view.azimuth)), 6),
        "elevation_deg": round(float(np.degrees(view.elevation)), 6),
        "has_surroundings": view.has_surroundings,
        "is_inside": view.eye is not None,
    }


def _doubt_and_cure(view: FirstView) -> str:
    """A warning that the picture may be upside down, and the remedy."""
    taken = _axis_of(view)
    other = next((name for name, _ in view.ups if name != taken), DEFAULT_UP)
    cure = f"--up {other} turns it, and 'brushgs views' shows them all"
    return f"{doubt_in_words(view)}; {cure}"


def _camera_of_file(path: Path, config: ViewConfig, stage: Stage) -> Camera:
    from brushgs.formats.cameras.read import read_cameras

    file = read_cameras(path)
    cameras = file.cameras
    if config.view >= len(cameras):
        raise SceneError(
            path, f"has {len(cameras)} views, 0 to {len(cameras) - 1}; there is no view {config.view}"
        )
    stage.did = f"view {config.view} of {len(cameras)} in {path.name}{file.choice and ', ' + file.choice}"
    stage.counts = {"source": str(path), "view": config.view, "views": len(cameras)}
    camera = cameras[config.view]
    if config.fixed_size is not None:
        return camera.resized(*config.fixed_size)
    if broken := file_size_rule(camera.width, camera.height):
        raise SceneError(path, broken)
    return camera
