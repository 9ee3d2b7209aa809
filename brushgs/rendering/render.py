"""Gaussians and a camera or camera path -> frames: `render` and `render_sequence`."""

from collections.abc import Iterator, Sequence
from typing import get_args

from brushgs.brushes.brush_set import Brush, BrushSet, Sigmas
from brushgs.options.choices import Filter, Lock, Order, ViewLock
from brushgs.rendering.options import RenderOptions, check_arguments, render_with
from brushgs.rendering.project import LOW_PASS, Directions
from brushgs.rendering.relief import Relief
from brushgs.rendering.track import track_directions
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians


def render(
    gaussians: Gaussians,
    camera: Camera,
    texture: Brush,
    *,
    lock: ViewLock | Directions = "anchor",
    order: Order = "depth",
    filter: Filter = "mip",
    num_sigmas: Sigmas | None = None,
    low_pass: float = LOW_PASS,
    depth: bool = True,
    underpaint: bool | Underpaint = False,
    streaks: float = 0.0,
    relief: bool | Relief = False,
    layers: Sequence[str] = (),
    next_camera: Camera | None = None,
    num_threads: int | None = None,
) -> Frame:
    """Paint Gaussians in one view: `project`, then `rasterize`.

    Strokes fade where they would otherwise appear or vanish, see `project`. The built-in kernels
    ("gaussian", "ellipse") fill the ellipse itself: they are drawn along its axes for any lock, and do not
    fade.

    Args:
        gaussians: N Gaussians in world space; each becomes a stroke.
        camera: one pinhole camera; its size is the size of the picture.
        texture: the brush, or its name or path as for `BrushSet.open`, read on each call; "gaussian" gives
            the plain 3DGS picture. With a `BrushSet` each stroke uses the brush of its row in `brushes`, see
            `choose_brushes`, and a box size that suits it.
        lock: direction of strokes: "anchor", "off" (as published), or `Directions` found by
            `track_directions` for this view of a path; see `project`.
        order: "depth": strokes hide what lies behind them, and swap abruptly when one passes another. "soft":
            they fade into each other while their depths are close, see `project` and `rasterize`, so that
            sequences do not jump. The built-in kernels always use depth.
        filter: see `rasterize`.
        num_sigmas: half length of a box in standard deviations, > 0, or one for each brush of a set; None
            takes `texture.fitted_sigmas`, fitted to the painted area of the Gaussian. The published method
            uses 2.
        low_pass: variance in px^2 added to every projected Gaussian, >= 0.
        depth: whether the frame has a depth.
        underpaint: draw a soft copy behind each stroke, which closes the gaps between strokes; or its
            options, see `rasterize`. It lies behind by the size of the stroke, and with `num_sigmas` None
            strokes over it are drawn at 0.88 of their reach. The built-in kernels have none.
        streaks: amplitude of bristle streaks along strokes, 0 to 0.5, see `rasterize`. The built-in kernels
            have none.
        relief: whether the frame has a height, or its options, see `Relief` and `light`.
        layers: layers to compute, in `Frame.layers`: "depth" [H, W], camera z; "normal" [H, W, 3], normals of
            stroke planes, camera axes; "uv" [H, W, 2], position on the most visible stroke, 0 to 1 along and
            across it; "motion" [H, W, 2], pixels right and down to the same paint in `next_camera`; "stroke",
            a `Matte` of single strokes; "id", `Matte`s "brush", "region" (if Gaussians have regions) and
            "layer"; "height" [H, W], with `relief`; "unlit" [H, W, 4], the picture without a lamp.
        next_camera: the view of the next frame, for "motion"; None omits that layer.
        num_threads: None takes the processors available to this process. The picture does not depend on it.

    Returns:
        The frame, in the dtype of the Gaussians.

    Raises:
        ValueError: if an option is out of range.

    Example:
        >>> bg.render(strokes, camera, "flat", underpaint=True)
        Frame(320x240, depth)
        >>> plain = bg.render(gaussians, camera, "gaussian")
    """
    check_arguments("render", gaussians, [camera], layers, streaks=streaks, low_pass=low_pass)
    brush_set = BrushSet.of(texture)
    options = RenderOptions.of(
        brush_set,
        lock=lock,
        order=order,
        filter=filter,
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        relief=Relief.of(relief),
        num_threads=num_threads,
    )
    if not layers:
        return render_with(gaussians, camera, brush_set, options)
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.wanted import Following, Wanted

    painting = Painting((Coat("strokes", gaussians, brush_set, options),))
    following = None if next_camera is None else Following(painting.coats, next_camera)
    return painting.frame(camera, wanted=Wanted(tuple(layers), following=following))


def render_sequence(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    texture: Brush,
    *,
    lock: Lock = "track",
    order: Order = "soft",
    filter: Filter = "mip",
    num_sigmas: Sigmas | None = None,
    low_pass: float = LOW_PASS,
    depth: bool = True,
    underpaint: bool | Underpaint = False,
    streaks: float = 0.0,
    relief: bool | Relief = False,
    num_threads: int | None = None,
) -> Iterator[Frame]:
    """Paint Gaussians along a camera path, one frame per camera, lazily.

    Args:
        gaussians: N Gaussians in world space; each becomes a stroke.
        cameras: the views in order, all of one size; the path is closed if the last equals the first.
        texture: see `render`.
        lock: direction of strokes: "track": chosen over the whole path before the first frame, see
            `track_directions`; "anchor" or "off": by each view alone, see `project`.
        order: see `render`.
        filter: see `rasterize`.
        num_sigmas: see `render`.
        low_pass: see `render`.
        depth: whether frames have a depth.
        underpaint: see `render`.
        streaks: see `render`.
        relief: see `render`.
        num_threads: see `render`.

    Raises:
        ValueError: if there is no camera, sizes differ, or an option is out of range.

    Example:
        >>> cameras = bg.orbit(gaussians, 12, width=160, height=120)
        >>> frames = bg.render_sequence(strokes, cameras, "flat")
        >>> next(frames)
        Frame(160x120, depth)
    """
    if lock not in get_args(Lock):
        raise ValueError(f"render_sequence: lock must be one of {', '.join(get_args(Lock))}, got {lock!r}")
    if isinstance(cameras, Camera):
        raise TypeError("render_sequence: cameras must be a list of Cameras, got a Camera; render takes one")
    check_arguments("render_sequence", gaussians, cameras, streaks=streaks, low_pass=low_pass)
    brush_set = BrushSet.of(texture)
    options = RenderOptions.of(
        brush_set,
        lock=lock,
        order=order,
        filter=filter,
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        relief=Relief.of(relief),
        num_threads=num_threads,
    )
    track = None
    if options.lock == "track":
        track = track_directions(gaussians, cameras, low_pass=low_pass, num_threads=num_threads)
    for index, camera in enumerate(cameras):
        of_view = options if track is None else options.in_direction(track.directions(index))
        yield render_with(gaussians, camera, brush_set, of_view)
