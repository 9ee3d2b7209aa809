"""`brushgs adopt`: make marks of what was painted over a picture of a scene."""

import shlex
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, scene_source
from brushgs.cli.console import reported
from brushgs.errors import SceneError
from brushgs.options.table import Options, option


class Picture(Options, frozen=True):
    """The paint."""

    # fmt: off
    picture: Annotated[Path | None, option("paint over a frame: a picture with transparency, the frame "
        "painted over (with --on), or a layer of an .ora or .psd file", flag="picture", default="")] = None
    # fmt: on


class Own(Options, frozen=True):
    """The other files of a painter, and the output."""

    # fmt: off
    on: Annotated[Path | None, option("frame that was painted over, as `brushgs render` wrote it: it states "
        "the camera, as does the file of `render --sidecar` beside it", default="the picture itself",
        metavar="FRAME")] = None
    layer: Annotated[str, option("layer of an .ora or .psd file that holds the paint; its layer 'erase' "
        "erases", metavar="NAME")] = "marks"
    erase: Annotated[Path | None, option("picture whose opaque pixels, or white ones, erase the strokes of "
        "the front surface below", default="none", metavar="PICTURE")] = None
    output: Annotated[Path | None, option("file of marks", flag="-o --output",
        default="SCENE.marks in the current folder", metavar="FILE.marks")] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Picture)
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)
    flags.add_view(parser, size="that of the picture")
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Write the marks."""
    scene = scene_source(args)
    view = paint_config(args).view if flags.given(args, "view") else None
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.formats.marks import MARKS_SUFFIX
        from brushgs.outlets.adopt import Painted, adopt_file

        painted = Painted(args.picture, args.on, args.layer, args.erase)
        output = output_of(args, Path(f"{scene.name}{MARKS_SUFFIX}"))
        adopt_file(painted, scene, output, view, report, has_stage=_has_stage(args.on or args.picture))


def _has_stage(frame: Path) -> bool:
    """Whether a frame was painted with a table and a wall, as its command says; False where that is lost."""
    from brushgs.cli.parser import parse
    from brushgs.formats.pictures.metadata import metadata_of

    try:
        found = metadata_of(frame)
        words = [] if found is None else shlex.split(found.command)[1:]
        return bool(words) and paint_config(parse([*words, "--quiet"])).ground.stage
    except (ValueError, SceneError):
        return False
