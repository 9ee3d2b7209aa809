"""`brushgs info`: the contents of a scene file."""

import warnings
from argparse import ArgumentParser, Namespace
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import scene_source, where_config
from brushgs.cli.fitting_words import table_of_words
from brushgs.errors import SceneWarning
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """The options of this command alone; `words` are those of the command line."""

    # fmt: off
    json: Annotated[bool, option("print a JSON object")] = False
    in_words: Annotated[bool, option("say in words what is seen of the scene, or of the strokes of a file: "
        "colours, light, marks, each with its figure; computed from colours and shapes by thresholds, not "
        "by a model of language", flag="--words")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add_where(parser, "how many Gaussians lie in a part of the scene, and where, is told too")


def run(args: Namespace) -> None:
    """Print the facts, one a line."""
    import json

    from brushgs.doctor.describe import describe

    scene, where = scene_source(args), where_config(args)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SceneWarning)
        facts = describe(scene, where, words=args.in_words)
    notes = [str(warning.message) for warning in caught]
    if args.json:
        print(json.dumps(facts | {"notes": notes}, indent=2))
        return
    words = facts.pop("words", [])
    for name, value in [*facts.items(), *(("note", note) for note in notes)]:
        print(f"{name.replace('_', ' '):16} {_text(value)}")
    for line in table_of_words(words):
        print(line)


def _text(value: object) -> str:
    if isinstance(value, list):
        return "  ".join(_text(item) for item in value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int) else str(value)
