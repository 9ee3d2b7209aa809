"""`brushgs.save`: scenes and frames go to the formats of `brushgs.io`, strokes that are painted to a page."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.io import save as save_file
from brushgs.options.page import PAGE_SUFFIXES

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brush
    from brushgs.scene import Camera, Frame, Gaussians


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
    """Write Gaussians (.ply), a frame (.png, .jpg, .webp, .tif, .exr), or a page of strokes (.html).

    The suffix decides the format, and the file appears when it is complete. A frame keeps its transparency,
    and a JPEG, which holds none, is on white. The arguments by name are those of a page: one file that a
    browser opens without a server, and in which the strokes can be turned.

    Args:
        value: what is written.
        path: the name of the file.
        texture: what strokes are painted with, see `render`; a page needs it.
        camera: the first view of the page; None frames the strokes.
        title: of the page, any text; None for the name of the file.
        background: of the page, the name of a colour, "#rrggbb" or "transparent"; None for white.
        **options: of the page: `lock`, `filter`, `num_sigmas`, `low_pass`, `underpaint`, `streaks` and
            `relief`, see `render`. Where there is relief, the default `Lamp` shines on it.

    Raises:
        TypeError: if `value` is something else, or an argument is not known.
        ValueError: if the suffix does not suit the value, or an argument of a page is given for another file.
        SceneError: if the file cannot be written.

    Example:
        >>> bg.save(strokes, "strokes.ply")
        >>> frame = bg.render(strokes, camera, "flat")
        >>> bg.save(frame, "painting.png")
        >>> bg.save(strokes, "painting.html", texture="flat", underpaint=True)
    """
    if Path(path).suffix.lower() not in PAGE_SUFFIXES:
        of_a_page = {"texture": texture, "camera": camera, "title": title, "background": background} | options
        if given := [name for name, argument in of_a_page.items() if argument is not None]:
            raise ValueError(f"save: only a page (.html) has {', '.join(given)}, got {str(path)!r}")
        save_file(value, path)
        return
    from brushgs.scene import Gaussians

    if not isinstance(value, Gaussians) or texture is None:
        what = "Gaussians and a texture"
        raise ValueError(f"save: a page needs {what}, got {type(value).__name__} and texture={texture!r}")
    _save_page(value, Path(path), texture, camera, title, background or "white", options)


def _save_page(
    strokes: "Gaussians",
    path: Path,
    texture: "Brush",
    camera: "Camera | None",
    title: str | None,
    background: str,
    options: dict[str, Any],
) -> None:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.options.painting import ViewConfig
    from brushgs.page.view import PageView
    from brushgs.page.write import write_page
    from brushgs.painting.background import open_background
    from brushgs.painting.report import Report
    from brushgs.painting.views import choose_camera, choose_first_view
    from brushgs.rendering.coats import Coat, Painting
    from brushgs.rendering.light import Lamp
    from brushgs.rendering.options import RenderOptions
    from brushgs.rendering.relief import Relief

    brush_set = BrushSet.of(texture)
    relief = Relief.of(options.pop("relief", None))
    coat = Coat("strokes", strokes, brush_set, RenderOptions.of(brush_set, relief=relief, **options))
    first_view = choose_first_view(strokes, ViewConfig(), None, Report())
    camera = choose_camera(first_view, ViewConfig(), Report(), camera=camera)
    write_page(
        Painting((coat,), lamp=None if relief is None else Lamp()),
        camera,
        path,
        view=PageView.of(first_view, camera),
        title=path.stem if title is None else title,
        command=(f"{path.stem}.ply", ["--look", "plain", "--stroke", ",".join(brush_set.names)]),
        background=open_background(background, camera.width, camera.height),
    )
