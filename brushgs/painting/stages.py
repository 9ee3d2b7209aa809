"""The single stages of a painting: each does its work, and adds to a `Report` what it did and left out.

A stage takes all it needs as arguments and imports what is heavy only when it runs. Their order is
`pipeline`'s business.
"""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.cameras.framing import DEFAULT_UP, default_elevation, direction_of, frame_scene, subject
from brushgs.errors import SceneError, SceneWarning
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import (
    DEFAULT_SIZE,
    ClusterConfig,
    DrawConfig,
    PaletteConfig,
    PruneConfig,
    ViewConfig,
)
from brushgs.options.sequence import PathConfig
from brushgs.painting.background import Ground, open_background
from brushgs.painting.count import choose, make
from brushgs.painting.report import Report, Stage
from brushgs.scene import Boxes, Camera, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.cameras.paths import CameraPath
    from brushgs.io.scenes.notes import LoadNotes
    from brushgs.passes.recolor import Palette
    from brushgs.rendering.options import RenderOptions
    from brushgs.stroke_count.view_model import ViewModel

NOTHING_SEEN = "no stroke is in the picture; check that the camera and the scene belong together"
CULLED = {  # field of ProjectCounts -> words
    "behind_near": "at or behind the near plane of the camera",
    "outside": "outside the picture",
    "faint": "with an opacity under 1/255",
    "not_finite": "too large for the arithmetic",
}


def open_stroke(config: DrawConfig, report: Report) -> "StrokeTexture":
    """The stroke image or kernel."""
    with report.stage("stroke") as stage:
        from brushgs.brushes.texture import StrokeTexture

        texture = StrokeTexture.open(config.stroke)
        height, width = texture.coverage.shape
        size = f"{width} x {height} texels" if texture.kind == "image" else "a kernel, no image"
        stage.did = f"{texture.name}: {size}"
        stage.counts = {"name": texture.name, "kind": texture.kind, "width": width, "height": height}
    return texture


def load_scene(path: str | Path, report: Report) -> "tuple[Gaussians, LoadNotes]":
    """The Gaussians of a file, and what else it says."""
    with report.stage("load") as stage:
        from brushgs.io import read_scene

        gaussians, notes = read_scene(path)
        dropped = f", {notes.rows_dropped:,} rows dropped" if notes.rows_dropped else ""
        degree = f"SH degree {notes.sh_degree_used}"
        what = "strokes" if notes.is_strokes else "Gaussians"
        stage.did = f"{len(gaussians):,} {what}, {degree}, {notes.format}{dropped}"
        stage.counts = {
            "gaussians": len(gaussians),
            "rows_read": notes.rows_read,
            "rows_dropped": notes.rows_dropped,
            "sh_degree_stored": notes.sh_degree_stored,
            "sh_degree_used": notes.sh_degree_used,
            "format": notes.format,
            "is_strokes": notes.is_strokes,
        }
        if notes.sh_degree_used < notes.sh_degree_stored:
            bands = _band_words(notes.sh_degree_used, notes.sh_degree_stored)
            stage.skipped.append(f"{bands}: zero in every row")
    return gaussians, notes


def choose_camera(
    gaussians: Gaussians,
    config: ViewConfig,
    report: Report,
    *,
    file_up: str | None = None,
    camera: Camera | None = None,
) -> Camera:
    """The camera given, or one from the file that is named, or one framed on the scene."""
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
    gaussians: Gaussians, view: ViewConfig, path_config: PathConfig, report: Report, *, file_up: str | None
) -> "CameraPath":
    """The cameras along a path, one per frame."""
    with report.stage("path") as stage:
        from brushgs.cameras.paths import plan_path

        path = plan_path(gaussians, view, path_config, file_up=file_up)
        count, camera = len(path.cameras), path.cameras[0]
        size, kind = f"{camera.width}x{camera.height}", "a loop" if path.is_loop else "open"
        stage.did = f"{count:,} frames, {path.fps:g} a second, {kind}, {size}: {path.source}"
        stage.counts = {
            "source": path.source,
            "frames": count,
            "fps": path.fps,
            "loop": path.is_loop,
            "width": camera.width,
            "height": camera.height,
        }
    return path


def prune_scene(
    gaussians: Gaussians, config: PruneConfig, report: Report, *, is_strokes: bool = False
) -> Gaussians:
    """Fewer Gaussians: those of highest weight. Of strokes, all, unless a share is asked for."""
    with report.stage("prune") as stage:
        num_before, keep = len(gaussians), config.share(is_strokes=is_strokes)
        if keep < 1:
            from brushgs.passes.prune import prune

            gaussians = prune(gaussians, keep, weight=config.weight)
            stage.did = f"kept {len(gaussians):,} of {num_before:,} by {config.weight}"
        else:
            stage.did = f"kept all {num_before:,}"
            reason = "they are strokes already" if config.keep is None else "keep = 1"
            stage.skipped.append(f"choosing: all are kept ({reason})")
        stage.counts = {"before": num_before, "after": len(gaussians), "weight": config.weight}
    return gaussians


def cluster_scene(
    gaussians: Gaussians,
    config: ClusterConfig,
    report: Report,
    *,
    num_loaded: int,
    view_model: "ViewModel | None" = None,
) -> Gaussians:
    """Fewer and larger Gaussians: the strokes in space.

    Args:
        gaussians: the scene, pruned.
        config: how many, and how.
        report: where the stages are told.
        num_loaded: of how many Gaussians a share is one.
        view_model: what `look` gave: the view that an aim is for.
    """
    choice = None if view_model is None else choose(gaussians, config, view_model, report)
    with report.stage("cluster") as stage:
        num_before = len(gaussians)
        num_strokes = config.num_strokes(num_loaded) if choice is None else choice.strokes
        stage.counts = {"before": num_before, "asked": num_strokes, "after": num_before, "method": None}

        def into(count: int) -> Gaussians:
            return _clustered(gaussians, count, config, stage)

        if config.strokes is None:
            stage.did = f"{num_before:,} strokes, one per Gaussian"
            stage.skipped.append("clustering: every Gaussian is a stroke")
            return gaussians
        if choice is None or view_model is None:
            return into(num_strokes)
        return make(gaussians, config, view_model, choice, into, stage)


def _clustered(gaussians: Gaussians, num_strokes: int, config: ClusterConfig, stage: Stage) -> Gaussians:
    num_before = len(gaussians)
    stage.skipped.clear()
    if num_before <= num_strokes:
        stage.did = f"{num_before:,} strokes, one per Gaussian"
        stage.skipped.append(f"clustering: {num_before:,} Gaussians are not above {num_strokes:,} strokes")
        return gaussians
    from brushgs.passes.cluster import group
    from brushgs.passes.merge import merge_clusters

    grouping = group(gaussians, num_strokes, features=config.features, method=config.method, seed=config.seed)
    strokes = merge_clusters(gaussians, grouping.labels, merge=config.merge, visible=grouping.visible)
    by = f"{grouping.method}, {grouping.num_steps} steps ({grouping.reason})"
    stage.did = f"{num_before:,} into {len(strokes):,} strokes by {by}"
    stage.counts |= {
        "asked": num_strokes,
        "after": len(strokes),
        "method": grouping.method,
        "steps": grouping.num_steps,
        "inertia": grouping.inertia,
    }
    return strokes


def open_palette(config: PaletteConfig | None, report: Report) -> "Palette | None":
    """The colours of a painting; a stage only where one is asked for."""
    if config is None:
        return None
    with report.stage("palette") as stage:
        from brushgs.io.pictures.images import read_image
        from brushgs.passes.recolor import Palette

        image = read_image(config.file)
        try:
            palette = Palette.of_image(image, space=config.space)
        except ValueError as error:
            raise SceneError(
                config.file, f"has no colours to take ({error}); choose another picture"
            ) from None
        height, width = image.shape[:2]
        stage.did = f"{config.file}, {width}x{height} pixels"
        stage.counts = {"path": str(config.file), "width": width, "height": height}
    return palette


def recolor_scene(
    gaussians: Gaussians, palette: "Palette | None", config: PaletteConfig | None, report: Report
) -> Gaussians:
    """The strokes in the colours of the palette; a stage only where there is one."""
    if palette is None or config is None:
        return gaussians
    with report.stage("recolor") as stage:
        from brushgs.passes.recolor import recolor

        gaussians = recolor(gaussians, palette, config.strength)
        stage.did = f"{len(gaussians):,} strokes, {config.strength:.0%} of the way in {config.space}"
        stage.counts = {"strokes": len(gaussians), "strength": config.strength, "space": config.space}
        if config.strength == 0:
            stage.skipped.append("recolouring: the strength is 0")
    return gaussians


def render_options(draw: DrawConfig, texture: "StrokeTexture", *, along_path: bool) -> "RenderOptions":
    """How strokes of a texture become a frame: one picture, or each frame along a path.

    Raises:
        ValueError: if the lock is "track" and there is no path.
    """
    from brushgs.rendering.options import RenderOptions

    return RenderOptions.of(
        texture,
        lock=draw.lock_of(along_path=along_path),
        order=draw.order_of(along_path=along_path),
        filter=draw.filter,
        num_sigmas=texture.fitted_sigmas if draw.extent == "fitted" else texture.num_sigmas,
        num_threads=draw.threads,
    )


def project_scene(
    strokes: Gaussians, camera: Camera, texture: "StrokeTexture", options: "RenderOptions", report: Report
) -> Boxes:
    """Strokes in space to boxes on the picture, nearest first."""
    with report.stage("project") as stage:
        from brushgs.rendering.options import project_with
        from brushgs.sh import used_sh_degree

        boxes, culled = project_with(strokes, camera, options)
        stage.did = f"{len(boxes):,} of {len(strokes):,} strokes in the picture"
        stage.counts = {
            "before": len(strokes),
            "after": len(boxes),
            "sigmas": round(options.num_sigmas, 4),
            "lock": options.lock,
            "order": options.order,
        }
        for reason, words in CULLED.items():
            count = getattr(culled, reason)
            stage.counts[reason] = count
            if count:
                stage.skipped.append(f"{count:,} strokes {words}")
        if not texture.is_directed:
            stage.skipped.append("lock, fading and soft order: a kernel fills the ellipse and has none")
        if len(boxes) == 0:
            warnings.warn(SceneWarning(NOTHING_SEEN), stacklevel=2)
        degree = used_sh_degree(strokes)
        stage.counts["sh_degree"] = degree
        if degree < strokes.sh_degree:
            stage.skipped.append(f"{_band_words(degree, strokes.sh_degree)}: zero in every row")
    return boxes


def rasterize_boxes(
    boxes: Boxes, camera: Camera, texture: "StrokeTexture", options: "RenderOptions", report: Report
) -> Frame:
    """Boxes to a picture."""
    with report.stage("rasterise") as stage:
        from brushgs.rendering.options import rasterize_with

        frame = rasterize_with(boxes, camera, texture, options)
        painted = float(np.mean(frame.alpha, dtype=np.float64))
        stage.did = f"{len(boxes):,} strokes cover {painted:.1%} of the picture"
        stage.counts = {"strokes": len(boxes), "painted": round(painted, 6), "filter": options.filter}
        _tell_levels(boxes, texture, options.filter, stage)
        if not options.depth:
            stage.skipped.append("depth: this kind of file does not hold it")
    return frame


def open_ground(config: DrawConfig, camera: Camera, report: Report) -> Ground:
    """The background of a picture; a stage of its own only where an image is read."""
    if not Path(config.background).is_file():
        return open_background(config.background, camera.width, camera.height)
    with report.stage("background") as stage:
        ground = open_background(config.background, camera.width, camera.height)
        stage.did = f"{config.background}, scaled to fill the picture"
        stage.counts = {"path": config.background}
    return ground


def write_picture(frame: Frame, path: Path, ground: Ground, config: DrawConfig, report: Report) -> None:
    """A picture to a file, on its background."""
    with report.stage("write") as stage:
        from brushgs.io.pictures.images import write_frame

        write_frame(frame, path, background=ground)
        stage.did = f"{path}, on {config.background}"
        stage.counts = {"path": str(path), "bytes": path.stat().st_size, "background": config.background}


def write_scene(
    gaussians: Gaussians, output: str | Path, report: Report, *, is_strokes: bool = False
) -> Report:
    """Gaussians to a scene file, which says of strokes that they are; ends the report."""
    with report.stage("write") as stage:
        from brushgs.io.scenes import write

        write.write_scene(gaussians, output, is_strokes=is_strokes)
        size = Path(output).stat().st_size
        stage.did = f"{output}, {size_words(size)}"
        stage.counts = {"path": str(output), "bytes": size, "gaussians": len(gaussians)}
    report.output = str(output)
    return report


def size_words(num_bytes: int) -> str:
    """The size of a file, as a table says it."""
    return f"{num_bytes / 1e6:,.1f} MB" if num_bytes >= 1e6 else f"{num_bytes / 1e3:,.0f} kB"


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
    """A camera framed on the scene; says which way is up and how that is known."""
    up = config.up or file_up or DEFAULT_UP
    source = "as asked" if config.up else "as its header says" if file_up else "assumed, change it with --up"
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
        stage.skipped.append("surroundings: drawn, but the frame is fitted to the middle of the scene")
    return camera


def _tell_levels(boxes: Boxes, texture: "StrokeTexture", filter: str, stage: Stage) -> None:
    """How many filtered copies of the stroke image no stroke reaches: they are not made."""
    if texture.kind != "image":
        stage.skipped.append("texture filter: a kernel is computed, not sampled")
        return
    if filter != "mip" or len(boxes) == 0:
        return
    from brushgs.rendering.rasterize import count_levels

    used, total = count_levels(boxes, texture)
    stage.counts |= {"mip_levels": total, "mip_levels_used": used}
    if used < total:
        stage.skipped.append(f"{total - used} of {total} mip levels: no stroke is of their size")


def _band_words(used: int, stored: int) -> str:
    low, high = used + 1, stored
    return f"SH band {low}" if low == high else f"SH bands {low} to {high}"
