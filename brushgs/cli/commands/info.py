"""`brushgs info`: print the contents of a scene file, or how a picture was painted."""

import warnings
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.cli.configs import scene_source, where_config
from brushgs.cli.fitting_words import table_of_words
from brushgs.errors import SceneWarning
from brushgs.formats.files import is_dir
from brushgs.formats.registry import (
    DRAWING_SUFFIXES,
    LAYERED_SUFFIXES,
    PICTURE_SUFFIXES,
    VIDEO_SUFFIXES,
)
from brushgs.options.table import Options, option

_SHOWN = (*PICTURE_SUFFIXES, *DRAWING_SUFFIXES, *LAYERED_SUFFIXES, *VIDEO_SUFFIXES)


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    json: Annotated[bool, option("print a JSON object")] = False
    formats: Annotated[bool, option("list the formats of files that are read and written, also those that "
        "other packages add; no file is needed #plugin #types", action="formats")] = False
    in_words: Annotated[bool, option("say in words what is seen of the scene, or of the strokes of a file: "
        "colors, light, marks, each with its figure; computed from colors and shapes by thresholds, not "
        "by a language model", flag="--words")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser, ", or a picture or film that brushgs painted")
    flags.add(parser, Own)
    flags.add_where(parser, "also print the number and place of Gaussians in a part of the scene")


def run(args: Namespace) -> None:
    """Print the facts, one per line."""
    import json

    from brushgs.doctor.describe import describe

    scene, where = scene_source(args), where_config(args)
    if (picture := _picture(args)) is not None:
        _print_metadata(picture, as_json=args.json)
        return
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


def _picture(args: Namespace) -> Path | None:
    """The picture or film to describe; None for a scene.

    Raises:
        ValueError: if a flag for scenes is given with it.
    """
    [path, *others] = args.scene
    if others or path.suffix.lower() not in _SHOWN or is_dir(path):
        return None
    if args.in_words or flags.given(args, "where"):
        flag = "--words" if args.in_words else "--where"
        raise ValueError(f"{flag} needs a scene, and {path} is a picture; omit it, or name the scene")
    return Path(path)


def _print_metadata(path: Path, *, as_json: bool) -> None:
    import json

    import msgspec

    from brushgs.formats.pictures.metadata import read_metadata

    found = read_metadata(path)
    facts = {} if found is None else msgspec.to_builtins(found)
    if as_json:
        print(json.dumps({"file": str(path), "painted": facts or None}, indent=2))
        return
    print(f"{'file':16} {path}")
    if found is None:
        print(f"{'painted by':16} not recorded in the file")
        return
    print(f"{'painted by':16} {_printable(found.command)}")
    print(f"{'brushgs':16} {_printable(found.brushgs)}")
    if (camera := found.camera) is not None:
        print(f"{'size':16} {camera.width} x {camera.height}")
        print(f"{'lens':16} {'  '.join(f'{number:.6g}' for number in camera.K)}")
        print(f"{'view':16} {'  '.join(f'{number:.6g}' for number in camera.viewmat)}")


def _printable(text: str) -> str:
    return "".join(character if character.isprintable() else "?" for character in text)


def _text(value: object) -> str:
    if isinstance(value, list):
        return "  ".join(_text(item) for item in value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int) else str(value)
