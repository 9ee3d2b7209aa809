"""Writes plain_0.png, plain_1.png ...: a 3D Gaussian Splatting scene from all sides, without strokes.

brushgs is also a CPU renderer of trained scenes. The scene is the still life or a PLY of your own.

python examples/plain_3dgs.py [SCENE.ply] [--up -y] [-o FOLDER] [--frames COUNT] [--size WIDTH HEIGHT]
"""

import argparse
import time
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import frame_scene, up_vector
from brushgs.still_life import still_life


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("plain"), help="folder")
    parser.add_argument("--up", default="-y", help="axis, such as --up=+z")
    parser.add_argument("--frames", type=int, default=4, help="1 or more")
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720), help="pixels")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    print(f"writes {args.frames} pictures into {args.output}")

    gaussians = still_life() if args.scene is None else bg.load(args.scene)
    texture, up = bg.StrokeTexture.open("gaussian"), up_vector(args.up)
    for i in range(args.frames):
        azimuth = np.radians(30 + 360 * i / args.frames)
        camera = frame_scene(gaussians, width=args.size[0], height=args.size[1], up=up, azimuth=azimuth)
        start = time.perf_counter()
        frame = bg.render(gaussians, camera, texture, depth=False)
        milliseconds = 1000 * (time.perf_counter() - start)
        path = args.output / f"plain_{i}.png"
        bg.save(frame, path)
        print(f"{path}: {len(gaussians):,} Gaussians in {milliseconds:.0f} ms")


if __name__ == "__main__":
    main()
