"""`brushgs looks`: list the looks, print one to change, or paint a sheet of them."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated, ClassVar

from brushgs.cli import flags
from brushgs.cli.configs import paint_config, scene_source
from brushgs.cli.console import output_beside, reported
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.choices import LOOKS
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """Which looks."""

    # fmt: off
    looks: Annotated[tuple[str, ...], option("look to print, by name or file, to change in a file of your "
        "own: brushgs looks oil > mine.toml; with -o looks to paint; or a scene, as with --scene",
        flag="looks", default="all", metavar="look|scene", read=str, nargs="*")] = ()
    # fmt: on


class Sheet(Options, frozen=True):
    """A picture of looks."""

    GROUP: ClassVar = "sheet"
    ABOUT: ClassVar = "a picture of each look, with its name"
    # fmt: off
    output: Annotated[Path | None, option("picture, {written}", flag="-o --output", default=
        f"none; with --scene SCENE-looks{PICTURE_SUFFIXES[0]} in the current folder")] = None
    scene: Annotated[tuple[Path, ...] | None, option("trained 3D Gaussian scene to paint: {scenes}",
        default="the example still life", metavar="FILE", read=Path, nargs="+")] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    group = (Sheet.GROUP, Sheet.ABOUT)
    flags.add(parser, Own)
    flags.add(parser, Sheet)
    flags.add(parser, flags.NoClobberFlag, group=group)
    flags.add(parser, flags.NoMetadataFlag, group=group)
    flags.add(parser, "source", "time", "moments_per_second", group=group)
    flags.add_no_cameras(parser, group)
    flags.add_size(parser, "640x480", group=group)
    flags.add(parser, "draw", "threads", group=group)
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Print the list or one look, or paint the sheet.

    Raises:
        ValueError: if several looks are to be printed, or a flag of the sheet is given without one.
    """
    args = _with_scene(args)
    if args.scene is None:
        for flag in flags.given(args, "source"):
            raise ValueError(f"--{flag.replace('_', '-')} needs --scene; the example still life rests")
    if args.output is None and args.scene is None:
        for step in ("view", "draw"):
            for name in flags.given(args, step):
                raise ValueError(f"--{name} needs -o, the sheet to paint")
        _print(args)
        return
    from brushgs.options.look import Look

    looks = [Look.open(name) for name in args.looks or LOOKS]
    scene = None if args.scene is None else scene_source(args)
    config = paint_config(args)
    with reported(args) as report:
        from brushgs.cli.origin import origin_of, output_of
        from brushgs.outlets.looks_sheet import paint_looks
        from brushgs.pipeline.outputs import scene_inputs

        files = [*scene_inputs(scene), *map(Path, args.looks)]
        origin = None if args.no_metadata else origin_of(args, files)
        default = Path() if scene is None else output_beside(scene, "looks", PICTURE_SUFFIXES[0])
        paint_looks(
            looks,
            output_of(args, default, origin),
            scene=scene,
            view=config.view,
            threads=config.draw.threads,
            report=report,
            origin=origin,
        )


def _with_scene(args: Namespace) -> Namespace:
    """The namespace with files and folders that are not looks moved to `scene`."""
    scene = [
        name
        for name in args.looks
        if name not in LOOKS and not name.endswith(".toml") and Path(name).exists()
    ]
    if not scene:
        return args
    looks = tuple(name for name in args.looks if name not in scene)
    return Namespace(**vars(args) | {"looks": looks, "scene": (*(args.scene or ()), *map(Path, scene))})


def _print(args: Namespace) -> None:
    from brushgs.options.look import Look, added_looks

    if len(args.looks) > 1:
        raise ValueError(f"looks prints one look at a time, got {len(args.looks)}; add -o to paint them all")
    names = args.looks or (*LOOKS, *added_looks())
    looks = [Look.open(name) for name in names]
    if args.json:
        import json

        print(
            json.dumps(
                [{name: getattr(look, name) for name in ("name", "title", "good_for")} for look in looks]
            )
        )
    elif args.looks:
        sys.stdout.write(looks[0].text)
    else:
        width = max(map(len, names))
        for look in looks:
            count = look.config.cluster.strokes
            strokes = "strokes counted for it" if isinstance(count, str) else f"{count} strokes"
            print(f"{look.name:{width}}  {look.title}, {strokes}: {look.good_for}")
