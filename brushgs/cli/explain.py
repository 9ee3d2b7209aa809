"""`--explain`: the graph of a job as a table, as JSON, or drawn."""

import json
from argparse import Namespace
from collections.abc import Sequence
from html import escape
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.pipeline.clip import Clip
    from brushgs.pipeline.estimate import Estimate
    from brushgs.pipeline.explain import Explained
    from brushgs.pipeline.runner import Job

SUFFIXES = (".svg", ".dot")
COLORS = {"yes": "#d6e9d0", "no": "#eeeeee", "undecided": "#fbe9b7"}
WORDS = {"yes": "runs", "no": "-", "undecided": "perhaps"}
WIDTH, HEIGHT, GAP = 150, 22, 30  # of a box of a drawing, and between boxes, pixels


def show(job: "Job", source: "SceneSource | Clip", config: "PaintConfig", args: Namespace) -> None:
    """Print or draw the steps of a job.

    Raises:
        ValueError: if the drawing has an unknown suffix.
        SceneError: if the header of a file cannot be read.
    """
    output = Path(args.output) if args.output else None
    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise ValueError(f"--explain draws {' or '.join(SUFFIXES)}, got {output}; omit -o to print it")
    steps, cost, num = _explained(job, source, config)
    if output is not None:
        from brushgs.formats.files import replacing

        with replacing(output) as path:
            path.write_text(_dot(steps) if output.suffix.lower() == ".dot" else _svg(steps), encoding="utf-8")
        print(output)
    elif args.json:
        print(json.dumps({"steps": [one.as_dict() for one in steps], "estimate": cost._asdict()}, indent=2))
    else:
        _print(steps, cost, num, is_verbose=args.verbose)


def expected_seconds(job: "Job", source: "SceneSource | Clip", config: "PaintConfig") -> float:
    """Seconds that a job will take on this machine if no other program uses it; kept results make it faster.

    Raises:
        SceneError: if the header of a file cannot be read.
    """
    from brushgs.pipeline.estimate import slowness

    return _explained(job, source, config)[1].seconds * slowness()


def _explained(
    job: "Job", source: "SceneSource | Clip", config: "PaintConfig"
) -> "tuple[list[Explained], Estimate, int]":
    """The steps of a job, its cost, and the number of Gaussians."""
    num, num_terms, is_strokes = _header(source)
    steps = job.explain({"is_strokes": is_strokes, "is_empty": num == 0})
    return steps, _estimate(job, steps, config, num, num_terms), num


def _header(source: "SceneSource | Clip") -> tuple[int, int, bool]:
    """Gaussians, spherical-harmonic terms of each, and whether they are strokes."""
    from brushgs.formats.scenes.read import open_files
    from brushgs.pipeline.clip import Clip

    if isinstance(source, Clip):
        first = source.scene.at(source.ends()[0])
        return len(first), first.sh.shape[1], False
    files = open_files(source, source.lod)
    num = sum(file.num_rows for file in files)
    return num, max(file.num_terms for file in files), all(file.stored.is_strokes for file in files)


def _estimate(
    job: "Job", steps: "Sequence[Explained]", config: "PaintConfig", num: int, num_terms: int
) -> "Estimate":
    from brushgs.core.threads import num_threads_or_default
    from brushgs.options.painting import DEFAULT_SIZE
    from brushgs.pipeline.clip import Clip
    from brushgs.pipeline.estimate import estimate, strokes_of
    from brushgs.pipeline.look import MOST_PIXELS
    from brushgs.pipeline.strips import OF_WHOLE

    views, source = job.inputs["views"], job.inputs["source"]
    num_frames = len(source.film().times) if isinstance(source, Clip) else 1
    for name in ("orbit", "num_frames", "frames"):
        num_frames = getattr(views, name, None) or num_frames
    crop = config.output.crop
    size = (config.view.fixed_size or DEFAULT_SIZE) if crop is None else crop[2:]
    is_still = num_frames == 1 and config.media.kind not in OF_WHOLE
    return estimate(
        steps,
        num,
        num_terms,
        size,
        num_frames,
        num_strokes=strokes_of(config.cluster, num),
        num_threads=num_threads_or_default(config.draw.threads),
        is_for_view=config.cluster.strokes_for == "view",
        most_held=MOST_PIXELS if is_still else inf,
    )


def _print(steps: "Sequence[Explained]", cost: "Estimate", num: int, *, is_verbose: bool) -> None:
    """Print a table of the main steps; with `is_verbose` of all."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 120
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for name in ("step", "", "what it makes, or why not", "takes"):
        table.add_column(name)
    shown = [one for one in steps if is_verbose or one.is_work]
    known = {"source", *(value for one in shown for value in one.makes)}
    for one in shown:
        takes = ", ".join(value for value in one.takes if is_verbose or value in known)
        table.add_row(one.name, WORDS[one.runs], one.why or one.does, takes)
    console.print(table, markup=False)
    counts = [sum(one.runs == runs for one in steps) for runs in ("yes", "no", "undecided")]
    console.print(
        f"{num:,} Gaussians; {counts[0]} steps run, {counts[1]} do not, {counts[2]} perhaps; {cost.words}; "
        "nothing was painted",
        markup=False,
    )


def _dot(steps: "Sequence[Explained]") -> str:
    lines = ["digraph painting {", "  rankdir=LR; node [shape=box, style=filled, fontsize=10];"]
    for one in steps:
        lines.append(f'  "{one.name}" [fillcolor="{COLORS[one.runs]}", tooltip="{one.why or one.does}"];')
    lines += [f'  "{start}" -> "{end}";' for start, end in _edges(steps)]
    return "\n".join([*lines, "}", ""])


def _edges(steps: "Sequence[Explained]") -> list[tuple[str, str]]:
    """Edges from each step to the steps that take its values."""
    maker = {value: one.name for one in steps for value in one.makes}
    starts = {one.name: dict.fromkeys(maker[value] for value in one.takes if value in maker) for one in steps}
    return [(start, end) for end, found in starts.items() for start in found]


def _svg(steps: "Sequence[Explained]") -> str:
    """Columns of boxes; each step stands to the right of its inputs."""
    edges, column = _edges(steps), dict.fromkeys((one.name for one in steps), 0)
    for one in steps:  # in topological order
        column[one.name] = 1 + max((column[start] for start, end in edges if end == one.name), default=-1)
    place: dict[str, tuple[int, int]] = {}
    used: dict[int, int] = {}
    for one in steps:
        x = column[one.name]
        place[one.name] = GAP + x * (WIDTH + GAP), GAP + used.get(x, 0) * (HEIGHT + GAP)
        used[x] = used.get(x, 0) + 1
    width = GAP + (1 + max(used)) * (WIDTH + GAP)
    height = GAP + max(used.values()) * (HEIGHT + GAP)
    parts: list[Any] = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif"',
        ' font-size="11"><rect width="100%" height="100%" fill="white"/>',
    ]
    for start, end in edges:
        (x0, y0), (x1, y1) = place[start], place[end]
        y0, y1 = y0 + HEIGHT // 2, y1 + HEIGHT // 2
        parts.append(
            f'<path d="M{x0 + WIDTH} {y0}C{x0 + WIDTH + GAP} {y0} {x1 - GAP} {y1} {x1} {y1}" fill="none" '
            'stroke="#999" stroke-width="0.7"/>'
        )
    for one in steps:
        x, y = place[one.name]
        parts.append(
            f'<g><title>{escape(one.why or one.does)}</title><rect x="{x}" y="{y}" width="{WIDTH}" '
            f'height="{HEIGHT}" rx="3" fill="{COLORS[one.runs]}" stroke="#666"/>'
            f'<text x="{x + 6}" y="{y + 15}">{escape(one.name)}</text></g>'
        )
    return "\n".join([*parts, "</svg>", ""])
