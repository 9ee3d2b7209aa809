"""`brushgs compare`: measure how near paintings are to the scene, to each other and to a style image."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Annotated

from brushgs.cli import flags
from brushgs.options.table import Options, option


class Own(Options, frozen=True):
    """What is compared."""

    # fmt: off
    painted: Annotated[Path, option("picture, or folder with the pictures of a film: {pictures}",
        flag="painted", metavar="PAINTED", read=Path)]
    plain: Annotated[Path | None, option("picture, or folder with pictures in the same order, of the scene "
        "itself in these views (`brushgs render --look plain --stroke gaussian`)", metavar="FILE|FOLDER",
        read=Path)] = None
    style: Annotated[Path | None, option("style image, for measures that take pictures of any size",
        metavar="FILE", read=Path)] = None
    weights: Annotated[Path | None, option("folder with weights of networks, which add LPIPS, DISTS, CLIP, "
        "DINO and CLIP-IQA; what is missing in it is said, nothing is downloaded", metavar="FOLDER",
        read=Path)] = None
    json: Annotated[bool, option("print a JSON object")] = False
    # fmt: on


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)


def run(args: Namespace) -> None:
    """Print the measures, one per line.

    Raises:
        ValueError: if there are weights and no PyTorch.
    """
    import importlib.util
    import json
    from dataclasses import asdict

    from brushgs.refine.compare import Pictures, compare_pictures

    if args.weights is not None and importlib.util.find_spec("torch") is None:
        raise ValueError("--weights needs PyTorch, which is not installed; pip install torch")
    pictures = Pictures.read(args.painted, args.plain, args.style)
    found = compare_pictures(pictures, args.weights, _told if sys.stderr.isatty() else lambda name: None)
    if args.json:
        print(json.dumps(asdict(found), indent=2))
        return
    names = {"alone": "", "plain": "to plain", "next": "to next", "style": "to style"}
    for figure in found.figures:
        values = "  ".join(f"{names[to]} {_text(value)}".strip() for to, value in figure.values.items())
        print(f"{figure.name:10} {values:48} {figure.words}")
    for name, digest in found.weights.items():
        print(f"weights    {name}, {digest}")
    for name, sentence in found.missing.items():
        print(f"{name:10} not measured: {sentence}")


def _text(value: float | None) -> str:
    return "infinite" if value is None else f"{value:.4f}"


def _told(name: str) -> None:
    print(f"brushgs: measuring {name}", file=sys.stderr)
