"""`brushgs strokes`: list the built-in strokes, or draw a chart of them."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.table import Options, option

DEFAULT_SHEET = f"strokes{PICTURE_SUFFIXES[0]}"


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    json: Annotated[bool, option("print the names as a JSON list", alone="form")] = False
    sheet: Annotated[Path | None, option("draw a chart of them to a picture",
        default=f"{DEFAULT_SHEET} in the current folder", nargs="?", const=Path(DEFAULT_SHEET), alone="form"
    )] = None
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)
    flags.add(parser, flags.NoClobberFlag)


def run(args: Namespace) -> None:
    """Print the names, each with what it is good for, or draw the chart and print its path."""
    if args.sheet is not None:
        from brushgs.cli.origin import check_kept, origin_of
        from brushgs.outlets.stroke_chart import write_stroke_chart
        from brushgs.pipeline.outputs import free_name

        origin, sheet = origin_of(args), args.sheet
        if sheet == Path(DEFAULT_SHEET):
            sheet = free_name(sheet, origin)
        check_kept(args, sheet)
        write_stroke_chart(sheet, origin)
        print(sheet)
        return
    from brushgs.brushes.builtin import stroke_notes

    notes = stroke_notes()
    if args.json:
        import json

        print(json.dumps([note.name for note in notes]))
        return
    width = max(len(note.name) for note in notes)
    for note in notes:
        print(f"{note.name:{width}}  {note.what}: {note.good_for}" if note.what else note.name)
