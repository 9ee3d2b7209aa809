"""Paintings of needles, discs and blobs of any aspect: how near few strokes come to the plain picture.

    python -m tests.bench.stiff_shapes [--page examples/measured/stiff_shapes.md]

Writes the table of stiff_shapes.md, between its two marks. Five minutes. The scenes are those of
`tests/stiff/shapes.py`, each alone and among ordinary Gaussians, painted at 480x360 with the flat brush on
nothing, in the default way and by `--preset paper`.
"""

import argparse
from pathlib import Path

from tests.bench.machine import describe
from tests.stiff.shapes import SHAPES, ball, coverage, painted, plain, psnr

ASPECTS = (1, 1e1, 1e2, 1e3, 1e4, 1e6, 1e8)
SHARES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
PAPER = (0.05, 0.2)  # shares that are also painted by the published method
BEGIN, END = "<!-- table: python -m tests.bench.stiff_shapes -->\n", "<!-- end of table -->\n"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--page", type=Path, default=Path("examples/measured/stiff_shapes.md"))
    path = parser.parse_args().page
    titles = [f"{share:.0%}" for share in SHARES] + [f"published, {share:.0%}" for share in PAPER]
    lines = ["| | aspect | " + " | ".join(titles) + " |\n", "|---" * (2 + len(titles)) + "|\n"]
    for among_others in (False, True):
        for shape in SHAPES:
            for aspect in ASPECTS:
                cells = measure(shape, aspect, among_others)
                where = f"{shape}s{' among others' * among_others}"
                lines.append(f"| {where} | {aspect:.0e} | " + " | ".join(cells) + " |\n")
                print(lines[-1], end="", flush=True)
    page = path.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    table = f"\n{describe()}.\n\n{''.join(lines)}\n"
    path.write_text(before + BEGIN + table + END + rest.split(END)[1], encoding="utf-8")


def measure(shape: str, aspect: float, among_others: bool) -> list[str]:
    """PSNR in dB, and coverage over that of the plain picture, of each painting."""
    scene = ball(shape, aspect, among_others=among_others)
    expected = plain(scene)
    frames = [painted(scene, share) for share in SHARES]
    frames += [painted(scene, share, preset="paper") for share in PAPER]
    return [f"{psnr(frame, expected):.1f}, {coverage(frame, expected):.0%}" for frame in frames]


if __name__ == "__main__":
    main()
