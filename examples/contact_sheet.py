"""Writes contact_sheet.png: one row for each built-in stroke, with more strokes from left to right.

python examples/contact_sheet.py [-o FILE] [--width PIXELS] [--counts COUNT ...] [--strokes NAME ...]
"""

import argparse
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.brushes.texture import builtin_names
from brushgs.still_life import still_life, still_life_camera


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("contact_sheet.png"))
    parser.add_argument("--width", type=int, default=320, help="of one picture, pixels")
    parser.add_argument("--counts", type=int, nargs="+", default=[300, 1500, 7000], help="strokes, 1 or more")
    parser.add_argument("--strokes", nargs="+", default=builtin_names(), help="names")
    args = parser.parse_args()
    print(f"writes {args.output}: {len(args.strokes)} strokes x {len(args.counts)} counts")

    scene = bg.prune(still_life())
    camera = still_life_camera(width=args.width, height=args.width * 3 // 4)
    columns = []
    for count in args.counts:
        strokes = bg.cluster(scene, count)
        frames = [
            bg.render(strokes, camera, bg.StrokeTexture.open(name), depth=False) for name in args.strokes
        ]
        columns.append(np.concatenate([frame.over((0.18, 0.13, 0.07)) for frame in frames]))
    sheet = np.concatenate(columns, axis=1)
    bg.save(bg.Frame(sheet, np.ones_like(sheet[..., 0])), args.output)


if __name__ == "__main__":
    main()
