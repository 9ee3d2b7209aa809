"""`brushgs export`: write a painted scene as one file: a page, textured rectangles, or strokes."""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import paint_config, painting_name, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.cli.words import NOT_PAINTED, words_of
from brushgs.formats.registry import STROKE_SUFFIXES
from brushgs.options.page import PAGE_SUFFIXES, QUAD_SUFFIXES
from brushgs.options.table import Options, option

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.pipeline.report import Report


class Request(NamedTuple):
    """An export: the scene, the output file, the painting options, and the flags."""

    scene: "SceneSource"
    output: Path
    config: "PaintConfig"
    args: Namespace


class Export(NamedTuple):
    """A kind of export.

    Attributes:
        name: in words, for help and messages.
        suffixes: in lower case, the usual one first; they select the kind.
        takes: namespace fields of flags that only some exports have.
        write: writes the file.
    """

    name: str
    suffixes: tuple[str, ...]
    takes: tuple[str, ...]
    write: "Callable[[Request, Report], object]"


def _write_page(request: Request, report: "Report") -> None:
    from brushgs.outlets.page.export import export_file
    from brushgs.outlets.page.html import Preview

    scene, output, config, args = request
    options = words_of(_parser(), args.words, _paints)
    preview = Preview(args.caption or "", args.address or "")
    more: Any = {"preview": preview, "stops": args.stops, "report": report}
    of_scene = open_clip(args, scene) or scene
    export_file(of_scene, output, config, title=args.title, options=options, **more)


def _write_gallery(request: Request, report: "Report") -> None:
    from brushgs.outlets.page.gallery import export_gallery

    scene, output, config, args = request
    export_gallery(
        scene,
        output,
        config,
        title=args.title,
        caption=args.caption or "",
        address=args.address or "",
        options=words_of(_parser(), args.words, _paints),
        report=report,
    )


def _write_quads(request: Request, report: "Report") -> None:
    from brushgs.outlets.glb.export import export_quads

    scene, output, config, args = request
    export_quads(scene, output, config, title=args.title, for_view=args.for_view, report=report)


def _write_strokes(request: Request, report: "Report") -> None:
    from brushgs.outlets.export_strokes import export_strokes

    export_strokes(request.scene, request.output, request.config, report=report)


# To add an export, add a line here. The first is the default.
EXPORTS = (
    Export("a page", PAGE_SUFFIXES, ("title", "caption", "address", "stops"), _write_page),
    Export("textured rectangles for 3D programs", QUAD_SUFFIXES, ("title", "for_view"), _write_quads),
    Export("the strokes as Gaussians", STROKE_SUFFIXES, (), _write_strokes),
)


def web_address(text: str) -> str:
    """An address that begins with https:// or http://."""
    if not text.startswith(("https://", "http://")) or any(letter <= " " for letter in text):
        raise ValueError(f"must begin with https:// or http://, got {text!r:.80}")
    return text


GALLERY = Export("a gallery", ("/",), ("title", "caption", "address", "gallery"), _write_gallery)


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    output: Annotated[Path | None, option(
        ", ".join(f"{' '.join(kind.suffixes)} ({kind.name})" for kind in EXPORTS), flag="-o --output",
        default=f"SCENE-LOOK{EXPORTS[0].suffixes[0]} in the current folder, "
        f"SCENE-STROKE{EXPORTS[0].suffixes[0]} with --stroke")] = None
    title: Annotated[str | None, option("title of the page or model", default="the name of the scene",
        metavar="TEXT")] = None
    caption: Annotated[str | None, option("a line over the picture of a page", default="none",
        metavar="TEXT")] = None
    address: Annotated[str | None, option("where the page will lie on the web, such as "
        "https://example.org/truck.html: links to it show a picture, which is written beside it as .jpg "
        "#preview #share", default="none", read=web_address, metavar="URL")] = None
    stops: Annotated[Path | None, option("camera file of views that a page leads through, by buttons, keys "
        "and swipes; names of pictures are their titles: {cameras} #tour #views #slides", default="none",
        action="camera file")] = None
    gallery: Annotated[bool, option("a page for each of several scenes, in a folder, and an index.html that "
        "shows their pictures; -o names the folder #several #portfolio")] = False
    for_view: Annotated[bool, option(f"make the rectangles ({QUAD_SUFFIXES[0]}) for the camera of the "
        "picture: from there they match the painted boxes; default: in the plane of each stroke's two "
        "longest axes")] = False
    # fmt: on


OWN_FLAGS = ("title", "caption", "address", "stops", "gallery", "for_view")  # which some exports take


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)
    flags.add_painting(parser)
    flags.add(parser, "draw", "lock", group=("drawing", ""))
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Write the file, and report the stages."""
    config, scene = paint_config(args), scene_source(args)
    from brushgs.cli.origin import output_of

    default = output_beside(scene, painting_name(args, config), EXPORTS[0].suffixes[0])
    kind = GALLERY if args.gallery else _export_of(args.output or default, args)
    if args.gallery:
        default = Path("gallery")
        _refuse_others(kind, args, "--gallery")
    with reported(args) as report:
        output = output_of(args, default)
        if config.is_by_hand:
            report.tell("hold, boil and redraw belong to films, and this file leaves them out")
        kind.write(Request(scene, output, config, args), report)


def _export_of(output: Path, args: Namespace) -> Export:
    """The export of a suffix. Raises ValueError if it is unknown, or a flag belongs to another export."""
    suffix = output.suffix.lower()
    kind = next((kind for kind in EXPORTS if suffix in kind.suffixes), None)
    if kind is None:
        known = ", ".join(suffix for kind in EXPORTS for suffix in kind.suffixes)
        raise ValueError(
            f"output must end in {known}, got {str(output)!r}; the suffix decides what is written"
        )
    _refuse_others(kind, args, repr(str(output)))
    return kind


def _refuse_others(kind: Export, args: Namespace, got: str) -> None:
    """Raise ValueError for a flag of other exports."""
    for name in OWN_FLAGS:
        if getattr(args, name) and name not in kind.takes:
            suits = " or ".join(other.suffixes[0] for other in EXPORTS if name in other.takes)
            flag = "--" + name.replace("_", "-")
            raise ValueError(f"{flag} needs -o FILE{suits}, got {got}")


def _parser() -> ArgumentParser:
    parser = ArgumentParser()
    add_flags(parser)
    return parser


def _paints(dest: str) -> bool:
    """Whether a flag changes the painting itself; flags of the view and of the scene source do not count."""
    return dest not in NOT_PAINTED and dest not in OWN_FLAGS and not dest.startswith(("view.", "source."))
