"""The stages that choose where pictures are seen from: one camera, or the cameras of a path."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.cameras.framing import DEFAULT_UP, default_elevation, direction_of, frame_scene, subject
from brushgs.errors import SceneError
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.painting.report import Report, Stage
from brushgs.scene import Camera, Gaussians

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.options.sequence import PathConfig


def choose_camera(
    gaussians: Gaussians,
    config: ViewConfig,
    report: Report,
    *,
    file_up: str | None = None,
    camera: Camera | None = None,
) -> Camera:
    """Take the camera that is given, or one of the camera file, or frame the scene."""
    with report.stage("camera") as stage:
        if camera is not None:
            stage.did = "given"
            if config.size is not None:
                camera = camera.resized(*config.size)
        elif config.camera_file is not None:
            camera = _camera_of_file(config.camera_file, config, stage)
        else:
            camera = _framed_camera(gaussians, config, file_up, stage)
        stage.did += f", {camera.width}x{camera.height}"
        stage.counts |= {"width": camera.width, "height": camera.height}
    return camera


def plan_views(
    gaussians: Gaussians, view: ViewConfig, path_config: "PathConfig", report: Report, *, file_up: str | None
) -> "CameraPath":
    """Place the cameras along a path, one per frame."""
    with report.stage("path") as stage:
        from brushgs.cameras.paths import plan_path

        path = plan_path(gaussians, view, path_config, file_up=file_up)
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


def _camera_of_file(path: Path, config: ViewConfig, stage: Stage) -> Camera:
    from brushgs.io import load_cameras

    cameras = load_cameras(path)
    if config.view >= len(cameras):
        raise SceneError(
            path, f"has {len(cameras)} views, 0 to {len(cameras) - 1}; there is no view {config.view}"
        )
    stage.did = f"view {config.view} of {len(cameras)} in {path.name}"
    stage.counts = {"source": str(path), "view": config.view, "views": len(cameras)}
    camera = cameras[config.view]
    if config.size is not None:
        return camera.resized(*config.size)
    if broken := file_size_rule(camera.width, camera.height):
        raise SceneError(path, broken)
    return camera


def _framed_camera(gaussians: Gaussians, config: ViewConfig, file_up: str | None, stage: Stage) -> Camera:
    """Frame the scene; report which way is up, and how that is known."""
    up = config.up or file_up or DEFAULT_UP
    source = "as given" if config.up else "from the file" if file_up else "assumed; change it with --up"
    direction = direction_of(up)
    points, has_surroundings = subject(gaussians)
    elevation = default_elevation(points, direction) if config.elevation is None else config.elevation
    width, height = config.size or DEFAULT_SIZE
    camera = frame_scene(
        gaussians,
        width=width,
        height=height,
        fov_y=config.fov_y,
        up=direction,
        azimuth=config.azimuth,
        elevation=elevation,
        zoom=config.zoom,
    )
    azimuth_deg, elevation_deg = (float(np.degrees(angle)) for angle in (config.azimuth, elevation))
    up_text = up if isinstance(up, str) else ",".join(f"{x:g}" for x in up)
    stage.did = (
        f"framed from azimuth {azimuth_deg:g}, elevation {elevation_deg:g}; up is {up_text} ({source})"
    )
    stage.counts = {
        "source": "framed",
        "up": up_text,
        "up_from": "flag" if config.up else "header" if file_up else "assumed",
        "azimuth_deg": round(azimuth_deg, 6),
        "elevation_deg": round(elevation_deg, 6),
        "has_surroundings": has_surroundings,
    }
    if has_surroundings:
        stage.details.append("the view is framed on the middle of the scene; its surroundings are drawn too")
    return camera
