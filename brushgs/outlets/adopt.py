"""`brushgs adopt`: paint over a picture of a scene -> a file of marks in space."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.marks import MARKS_SUFFIX, write_marks
from brushgs.formats.pictures.images import read_image
from brushgs.formats.pictures.layered import LAYERED_READ, read_layer, with_alpha
from brushgs.formats.pictures.metadata import SIDECAR, camera_of
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.passes.marks.place import Below, erased_of_area, marks_of_paint
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.prepare import open_job
from brushgs.pipeline.report import Report
from brushgs.values.arrays import F32, F64, Mask
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Overpaint

if TYPE_CHECKING:
    from brushgs.passes.add.stage import Site

# A pixel of a frame that was painted over is paint where a channel differs by more: programs and files round.
CHANGED = 3.5 / 255
OPAQUE = 254.5 / 255  # a picture without alpha below this is a frame that was painted over
ERASER = "erase"  # the layer whose paint erases
HALF = 0.5
EDGE = 2.0  # px from the border of paint over a frame, where its pixels may be mixed with those of the frame
BESIDE = 2  # px in which the paint of an edge is sought
FITS = 0.04  # of a channel: by which a mixed pixel may be another
# What states the camera of a picture.
CAMERA = f"the frame (--on), with FRAME{SIDECAR} of `render --sidecar` beside it, or --camera-file and --size"


@dataclass(frozen=True)
class Painted:
    """The files that a painter gives.

    Attributes:
        picture: the paint: a picture with alpha, the frame painted over, or a file with layers.
        frame: the picture that was painted over; None if it is not at hand.
        layer: of a file with layers, the one that holds the paint; its layer `ERASER` erases.
        eraser: a picture whose opaque pixels erase; or None.
    """

    picture: Path
    frame: Path | None = None
    layer: str = "marks"
    eraser: Path | None = None

    @property
    def files(self) -> tuple[Path, ...]:
        """All that are read."""
        return tuple(path for path in (self.picture, self.frame, self.eraser) if path is not None)


def adopt_file(
    painted: Painted,
    scene: SceneSource,
    output: Path,
    view: ViewConfig | None,
    report: Report,
    *,
    has_stage: bool = False,
) -> Report:
    """Make marks of what was painted over a picture, and write them.

    Args:
        painted: the pictures.
        scene: that they show.
        output: a file *.marks.
        view: of the picture, where no file states its camera; None if it is not known.
        report: collects the stages.
        has_stage: whether the picture has a table and a wall, on which paint beside the scene then lies.

    Raises:
        ValueError: if the output has another suffix, or nothing is painted.
        SceneError: if a file cannot be read, or pictures and camera do not belong together.
    """
    check_output(output, (MARKS_SUFFIX,), inputs=(*scene.files(), *painted.files))
    camera = _stated_camera(painted)
    if camera is None and view is None:
        cure = f"give {CAMERA}"
        raise SceneError(painted.frame or painted.picture, f"states no camera; {cure}")
    config = PaintConfig(view=view if camera is None and view is not None else ViewConfig())
    config = replace(config, ground=replace(config.ground, stage=has_stage))
    found = open_job(
        scene, config, report, asks=("cameras", "scene", "site", "first_view"), views=camera
    ).run()
    camera, gaussians = found["shown"][0], found["whole"]
    stage_depth = _stage_depth(found["site"], found["first_view"], camera) if has_stage else None
    with report.stage("marks") as stage:
        paint, area = _paint(painted, camera), _erased(painted, camera)
        overpaint = overpaint_of(paint, area, gaussians, camera, time=_moment(scene), stage=stage_depth)
        if overpaint.marks is None and overpaint.erased is None:
            raise SceneError(painted.picture, "holds no paint; paint over the frame, or on a layer above it")
        write_marks(overpaint, output)
        num = 0 if overpaint.marks is None else len(overpaint.marks)
        patches = 0 if overpaint.erased is None else len(overpaint.erased)
        stage.did = f"{num:,} marks of {np.count_nonzero(paint[..., 3]):,} pixels"
        stage.did += f", {patches:,} erased patches" if patches else ""
        stage.counts = {"marks": num, "erased": patches, "path": str(output)}
    report.output = str(output)
    return report


def overpaint_of(
    paint: F32,
    area: Mask | None,
    gaussians: Gaussians,
    camera: Camera,
    *,
    time: float | None = None,
    stage: F64 | None = None,
) -> Overpaint:
    """What is painted over a view of a scene, and erased in it.

    Args:
        paint: [H, W, 4] straight alpha, 0 to 1, in the size of the camera.
        area: [H, W] what is erased; or None.
        gaussians: the scene, at the moment that it was painted over.
        camera: the view.
        time: of the moment, seconds; None for a scene that does not move.
        stage: [H, W] camera z of table and wall, infinite where there is none; None without a stage.
    """
    below = Below.in_view(camera, gaussians)
    if stage is not None:
        below = below.on_stage(stage)
    erased = None if area is None else erased_of_area(area, below)
    return Overpaint(marks_of_paint(paint, below), erased, time=time)


def _stage_depth(site: "Site | None", first_view: FirstView, camera: Camera) -> F64 | None:
    """The depth of the stage in a view, which encloses it; None where a scene gets none."""
    from brushgs.passes.add.backdrop import reason_for_none
    from brushgs.passes.add.stage_surface import depth_of, surface_around

    if site is None or reason_for_none(first_view, []) is not None:
        return None
    away = float(np.hypot(*site.place.local(camera.position[None])[0, [0, 2]]))
    return depth_of(surface_around(site.place, away, site.ground), site.place, camera)


def _moment(scene: SceneSource) -> float | None:
    """The moment of a scene that is shown, seconds; None if the scene does not move."""
    from brushgs.formats.moving import open_moving

    if scene.time is not None and scene.time.is_all:
        return None
    moving = open_moving(scene)
    if moving is None:
        return None
    return 0.0 if scene.time is None else min(scene.time.seconds(moving.duration), moving.duration)


def _stated_camera(painted: Painted) -> Camera | None:
    """The camera that a picture, or the file beside it, states."""
    for path in (painted.frame, painted.picture):
        if path is None or path.suffix.lower() == ".psd":
            continue
        if (found := camera_of(path)) is not None:
            return found
    return None


def _paint(painted: Painted, camera: Camera) -> F32:
    """[H, W, 4] the paint alone, straight alpha."""
    path = painted.picture
    if path.suffix.lower() in LAYERED_READ:
        pixels = read_layer(path, painted.layer)
        if pixels is None:
            cure = f"paint on a layer of that name, or name another one with --layer, not {ERASER!r}"
            if read_layer(path, ERASER) is None:
                raise SceneError(path, f"has no layer {painted.layer!r}; {cure}")
            pixels = np.zeros((camera.height, camera.width, 4), np.float32)
    else:
        pixels = with_alpha(read_image(path))
    _check_size(path, pixels, camera)
    is_layer = path.suffix.lower() in LAYERED_READ
    if is_layer or (painted.frame is None and pixels[..., 3].min() < OPAQUE):
        return pixels
    if painted.frame is None:
        fact = "has no transparency, so the paint on it is not known"
        raise SceneError(path, f"{fact}; give the frame that it was painted over too, --on FRAME")
    frame = with_alpha(read_image(painted.frame))
    _check_size(painted.frame, frame, camera)
    if pixels[..., 3].min() < OPAQUE and not _is_painted_over(pixels, frame):
        return pixels
    return paint_over(pixels, frame)


def _is_painted_over(pixels: F32, frame: F32) -> bool:
    """Whether a picture with transparency is the frame, which has too, with paint on it: not paint alone."""
    is_subject = frame[..., 3] > HALF
    same = (np.abs(_premultiplied(pixels) - _premultiplied(frame)) <= CHANGED).all(axis=2)
    return bool(frame[..., 3].min() < OPAQUE and same[is_subject].mean() > HALF)


def _premultiplied(pixels: F32) -> F32:
    return np.concatenate([pixels[..., :3] * pixels[..., 3:], pixels[..., 3:]], axis=2)


def paint_over(pixels: F32, frame: F32) -> F32:
    """[H, W, 4] the opaque paint by which two pictures [H, W, 4] differ, with soft edges.

    At an edge a pixel p = a c + (1 - a) f mixes the frame f with the paint c near it, that farthest from the
    edge: a is the share that fits best. Where none fits, the paint is p.

    Args:
        pixels: the frame painted over; straight alpha, 0 to 1, as all of these.
        frame: without the paint.
    """
    from scipy.ndimage import distance_transform_edt

    over, under = _premultiplied(pixels), _premultiplied(frame)
    changed = (np.abs(over - under) > CHANGED).any(axis=2)
    alpha = changed.astype(np.float32)
    found = np.concatenate([pixels[..., :3], alpha[..., None]], axis=2)
    inside = distance_transform_edt(np.pad(changed, 1))[1:-1, 1:-1]
    y, x = np.nonzero(changed & (inside <= EDGE))
    if not len(y):
        return found
    most, color = np.zeros(len(y)), over[y, x]
    height, width = changed.shape
    for dy, dx in np.ndindex(2 * BESIDE + 1, 2 * BESIDE + 1):
        rows, columns = np.clip(y + dy - BESIDE, 0, height - 1), np.clip(x + dx - BESIDE, 0, width - 1)
        away = 10 * inside[rows, columns] + np.linalg.norm(over[rows, columns] - under[rows, columns], axis=1)
        is_more = away > most
        most[is_more], color[is_more] = away[is_more], over[rows, columns][is_more]
    mixed, to_paint = over[y, x] - under[y, x], color - under[y, x]
    squares = np.maximum((to_paint**2).sum(axis=1), 1e-6)
    share = np.clip((mixed * to_paint).sum(axis=1) / squares, 0, 1)
    fits = np.abs(mixed - share[:, None] * to_paint).max(axis=1) <= FITS
    fits &= color[:, 3] > OPAQUE  # else the paint itself is thin
    rgb = np.where(fits[:, None], color[:, :3], found[y, x, :3])
    found[y, x] = np.concatenate([rgb, np.where(fits, share, 1)[:, None]], axis=1)
    return found


def _erased(painted: Painted, camera: Camera) -> Mask | None:
    """[H, W] what is erased; None without an eraser."""
    if painted.eraser is not None:
        pixels = with_alpha(read_image(painted.eraser))
        _check_size(painted.eraser, pixels, camera)
        opaque = pixels[..., 3].min() >= OPAQUE  # a mask in black and white
        return np.asarray((pixels[..., :3].mean(axis=2) if opaque else pixels[..., 3]) > HALF)
    if painted.picture.suffix.lower() in LAYERED_READ:
        found = read_layer(painted.picture, ERASER)
        return None if found is None else np.asarray(found[..., 3] > HALF)
    return None


def _check_size(path: Path, pixels: F32, camera: Camera) -> None:
    height, width = pixels.shape[:2]
    if (width, height) != (camera.width, camera.height):
        fact = f"has {width}x{height} pixels, and the camera of the frame {camera.width}x{camera.height}"
        cure = f"save it in that size, or give {CAMERA}"
        raise SceneError(path, f"{fact}; {cure}")
