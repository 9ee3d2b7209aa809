"""`brushgs cache`: the results that commands keep on disk."""

from argparse import ArgumentParser, Namespace
from typing import Annotated

from brushgs.cli import flags
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """The options of this command alone."""

    # fmt: off
    clear: Annotated[bool, option("remove all results")] = False
    json: Annotated[bool, option("print a JSON object")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)


def run(args: Namespace) -> None:
    """Print the folder, and the number and size of results."""
    import json

    from brushgs.pipeline.kept import FOLDER, MOST_BYTES, default_store

    store = default_store()
    if store is None:
        raise ValueError(f"{FOLDER}=off: nothing is kept on disk; unset it, or set it to a folder")
    if args.clear:
        store.clear()
    sizes = [found.st_size for _, found in store.files()]
    facts = {
        "folder": str(store.folder),
        "results": len(sizes),
        "bytes": sum(sizes),
        "most_bytes": MOST_BYTES,
    }
    if args.json:
        print(json.dumps(facts, indent=2))
        return
    most = f"at most {MOST_BYTES / 1e9:.1f} GB"
    print(f"folder   {store.folder}\nresults  {len(sizes)}, {sum(sizes) / 1e6:,.0f} MB ({most})")
