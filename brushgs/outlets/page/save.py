"""`brushgs.save`: scenes and frames go to `brushgs.formats`, painted strokes to a page or model."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.formats import save as save_file
from brushgs.options.page import PAGE_SUFFIXES, QUAD_SUFFIXES

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brush, BrushSet
    from brushgs.rendering.canvas import Painting
    from brushgs.values.camera import Camera, FirstView
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians

NOT_IN_QUADS = ("background", "filter", "streaks", "relief")  # arguments of a page


def save(
    value: "Gaussians | Frame",
    path: str | Path,
    *,
    texture: "Brush | None" = None,
    camera: "Camera | None" = None,
    title: str | None = None,
    background: str | None = None,
    **options: Any,
) -> None:
    """Write Gaussians, a frame (.png, .jpg, .webp, .avif, .tif, .exr), or painted strokes (.html, .glb).

    The suffix decides the format; the file appears when it is complete. Gaussians are stored exactly in .ply,
    .glb and .usd, rounded in .spz, .sog, .splat and .compressed.ply. A frame keeps its transparency unless it
    gets a background; JPEG and AVIF, which have none, use white. An .exr contains the layers.

    The other arguments are for painted strokes. A page (.html) is one file to turn the strokes in a browser,
    without a server. A model (.glb) has one textured rectangle per stroke, for 3D programs: in the plane of
    the stroke's two longest axes or, with a camera, the box that `render` paints in that view.

    Args:
        value: Gaussians or a frame.
        path: output file.
        texture: brush of painted strokes, see `render`; required for these.
        camera: the first view; None frames the strokes.
        title: any text; None for the name of the file.
        background: of a frame or page: a color name, "#rrggbb" or "transparent"; None keeps a frame's
            transparency and is white for a page.
        **options: `lock`, `num_sigmas`, `low_pass` and `underpaint`, for a page also `filter`, `streaks` and
            `relief`, see `render`. Relief is lit by the default `Lamp`.

    Raises:
        TypeError: if `value` has another type, or an argument is unknown.
        ValueError: if the suffix does not suit the value, or an argument does not suit the suffix.
        SceneError: if the file cannot be written, or a model would have no stroke.

    Example:
        >>> bg.save(strokes, "strokes.ply")
        >>> frame = bg.render(strokes, camera, "flat")
        >>> bg.save(frame, "painting.png", background="white")
        >>> bg.save(strokes, "painting.html", texture="flat", underpaint=True)
    """
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians

    suffix = Path(path).suffix.lower()
    given = {"texture": texture, "camera": camera, "title": title, "background": background} | options
    given = {name: argument for name, argument in given.items() if argument is not None}
    if isinstance(value, Frame) and given.keys() == {"background"}:
        save_file(value, path, background=background)
        return
    if suffix not in PAGE_SUFFIXES and not (suffix in QUAD_SUFFIXES and given):
        if given:
            names = ", ".join(given)
            raise ValueError(f"save: only a page (.html) or a model (.glb) has {names}, got {str(path)!r}")
        save_file(value, path)
        return
    what = "a page" if suffix in PAGE_SUFFIXES else "a model of strokes"
    if not isinstance(value, Gaussians) or texture is None:
        got = f"{type(value).__name__} and texture={texture!r}"
        raise ValueError(f"save: {what} needs Gaussians and a texture, got {got}")
    if suffix in PAGE_SUFFIXES:
        _save_page(value, Path(path), texture, camera, title, background or "white", options)
        return
    if wrong := [name for name in NOT_IN_QUADS if given.get(name)]:
        raise ValueError(
            f"save: a model of strokes (.glb) has no {', '.join(wrong)}; omit it, or write .html"
        )
    _save_quads(value, Path(path), texture, camera, title, options)


def _save_page(
    strokes: "Gaussians",
    path: Path,
    texture: "Brush",
    camera: "Camera | None",
    title: str | None,
    background: str,
    options: dict[str, Any],
) -> None:
    from brushgs.outlets.page.view import PageView
    from brushgs.outlets.page.write import write_page
    from brushgs.pipeline.background import open_background
    from brushgs.rendering.light import Lamp

    painting, brush_set = _painting_of(strokes, texture, options)
    if painting.coats[0].options.relief is not None:
        painting = replace(painting, lamp=Lamp())
    first_view, camera = _views_of(strokes, camera)
    write_page(
        painting,
        camera,
        path,
        view=PageView.of(first_view, camera),
        title=path.stem if title is None else title,
        command=(f"{path.stem}.ply", ["--look", "plain", "--stroke", ",".join(brush_set.names)]),
        background=open_background(background, camera.width, camera.height),
    )


def _save_quads(
    strokes: "Gaussians",
    path: Path,
    texture: "Brush",
    camera: "Camera | None",
    title: str | None,
    options: dict[str, Any],
) -> None:
    from brushgs.outlets.glb.write import write_quads
    from brushgs.outlets.page.view import PageView

    painting, _ = _painting_of(strokes, texture, options)
    first_view, first_camera = _views_of(strokes, camera)
    write_quads(
        painting,
        first_camera,
        path,
        view=PageView.of(first_view, first_camera),
        title=path.stem if title is None else title,
        for_view=camera is not None,
    )


def _painting_of(
    strokes: "Gaussians", texture: "Brush", options: dict[str, Any]
) -> "tuple[Painting, BrushSet]":
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.options import RenderOptions
    from brushgs.rendering.relief import Relief

    brush_set = BrushSet.of(texture)
    relief = Relief.of(options.pop("relief", None))
    coat = Coat("strokes", strokes, brush_set, RenderOptions.of(brush_set, relief=relief, **options))
    return Painting((coat,)), brush_set


def _views_of(strokes: "Gaussians", camera: "Camera | None") -> "tuple[FirstView, Camera]":
    from brushgs.options.painting import ViewConfig
    from brushgs.pipeline.report import Report
    from brushgs.pipeline.views import choose_camera, choose_first_view

    first_view = choose_first_view(strokes, ViewConfig(), None, Report())
    return first_view, choose_camera(first_view, ViewConfig(), Report(), camera=camera)
