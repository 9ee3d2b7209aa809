"""Writes one picture for each stroke into a folder: the example scene, painted with different brushes.

python examples/paint_still_life.py [-o FOLDER] [--strokes COUNT] [--size WIDTH HEIGHT] [STROKE ...]
"""

import argparse
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("stroke", nargs="*", default=["filbert", "dry_brush", "palette_knife", "swirl"])
    parser.add_argument("-o", "--output", type=Path, default=Path("still_life"), help="folder")
    parser.add_argument("--strokes", type=int, default=5000, help="strokes, 1 or more")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 720), help="pixels")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    print(f"writes {len(args.stroke)} pictures into {args.output}")

    strokes = bg.cluster(bg.prune(still_life()), args.strokes)
    camera = still_life_camera(width=args.size[0], height=args.size[1])
    for name in args.stroke:
        frame = bg.render(strokes, camera, bg.StrokeTexture.open(name), depth=False)
        path = args.output / f"{Path(name).stem}.png"
        # A toned background, as painters use it: gaps between strokes stay warm and dark.
        bg.save(bg.Frame(frame.over((0.18, 0.13, 0.07)), np.ones_like(frame.alpha)), path)
        print(path)


if __name__ == "__main__":
    main()
