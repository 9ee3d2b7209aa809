"""`brushgs looks`: the looks, as a list, as a file to change, or as a sheet of pictures."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from brushgs.cli import flags, values
from brushgs.cli.configs import paint_config
from brushgs.cli.console import output_beside, reported
from brushgs.io.pictures.formats import PICTURE_SUFFIXES, PICTURES_WRITTEN
from brushgs.io.scenes.formats import SCENES_READ
from brushgs.options.choices import LOOKS


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.add_argument(
        "looks",
        nargs="*",
        metavar="look",
        help="a look by name, or a file; without -o it is printed, to be changed in a file of your own: "
        "brushgs looks oil > mine.toml; default all",
    )
    group = parser.add_argument_group("sheet", "a picture of each look, with its name")
    group.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=f"picture, {PICTURES_WRITTEN}; default none, with --scene SCENE-looks{PICTURE_SUFFIXES[0]} in "
        "the current folder",
    )
    group.add_argument(
        "--scene",
        type=Path,
        nargs="+",
        metavar="FILE",
        help=f"what is painted, a trained 3D Gaussian scene: {SCENES_READ}; default the example still life",
    )
    flags.add_time(group)
    flags.add_no_cameras(group)
    flags.ConfigFlags(group, "view").add(
        "--size",
        type=values.picture_size,
        metavar="WxH",
        help="size of one picture in pixels, default 640x480",
    )
    flags.add_threads(group)
    flags.add_report(parser)


def run(args: Namespace) -> None:
    """Print the list or one look, or paint the sheet.

    Raises:
        ValueError: if several looks are to be printed, or a flag of the sheet is given without one.
    """
    if args.scene is None:
        for flag in ("time", "moments_per_second"):
            if getattr(args, flag) is not None:
                raise ValueError(f"--{flag.replace('_', '-')} needs --scene; the example still life rests")
    if args.output is None and args.scene is None:
        for step in ("view", "draw"):
            for name in flags.given(args, step):
                raise ValueError(f"--{name} needs -o, the sheet to paint")
        _print(args)
        return
    from brushgs.options.look import Look
    from brushgs.options.scene_source import SceneSource

    looks = [Look.open(name) for name in args.looks or LOOKS]
    scene = None
    if args.scene is not None:
        scene = SceneSource(
            tuple(args.scene),
            time=args.time,
            moments_per_second=args.moments_per_second,
            seeks_cameras=getattr(args, "seeks_cameras", True),
        )
    output = args.output
    if output is None and scene is not None:
        output = output_beside(scene, "looks", PICTURE_SUFFIXES[0])
    config = paint_config(args)
    with reported(args) as report:
        from brushgs.outlets.looks_sheet import paint_looks

        paint_looks(looks, output, scene=scene, view=config.view, threads=config.draw.threads, report=report)


def _print(args: Namespace) -> None:
    from brushgs.options.look import Look

    if len(args.looks) > 1:
        raise ValueError(f"looks prints one look at a time, got {len(args.looks)}; add -o to paint them all")
    looks = [Look.open(name) for name in args.looks or LOOKS]
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
        width = max(map(len, LOOKS))
        for look in looks:
            count = look.config.cluster.strokes
            strokes = "strokes counted for it" if isinstance(count, str) else f"{count} strokes"
            print(f"{look.name:{width}}  {look.title}, {strokes}: {look.good_for}")
