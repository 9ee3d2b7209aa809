"""`brushgs strokes`: the names of the built-in strokes."""

from argparse import ArgumentParser, Namespace


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    parser.add_argument("--json", action="store_true", help="print a JSON list")


def run(args: Namespace) -> None:
    """Print the names."""
    import json

    from brushgs.brushes.texture import builtin_names

    print(json.dumps(builtin_names()) if args.json else "\n".join(builtin_names()))
