"""Writes moving_still_life.mp4: the example scene, painted while the camera moves to both sides and back.

python examples/moving_still_life.py [-o FILE] [--stroke NAME] [--strokes COUNT] [--frames COUNT]
                                     [--size WIDTH HEIGHT]
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

DISTANCE = 10.6  # from the camera to the fruit, world units


def swaying(camera: bg.Camera, num_frames: int, *, degrees: float = 20) -> list[bg.Camera]:
    """Views from an arc to both sides, around the vertical through the point that the camera looks at.

    A wall is behind the still life, so the camera stays in front: up to 40 degrees to each side.
    """
    middle = camera.position + DISTANCE * camera.viewmat[2, :3]
    cameras = []
    for angle in np.radians(degrees) * np.sin(np.linspace(0, 2 * np.pi, num_frames)):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        viewmat = camera.viewmat.copy()
        viewmat[:3, :3] = camera.viewmat[:3, :3] @ turn
        viewmat[:3, 3] += camera.viewmat[:3, :3] @ (middle - turn @ middle)
        cameras.append(replace(camera, viewmat=viewmat))
    return [*cameras[:-1], cameras[0]]  # the last equals the first: a closed path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("moving_still_life.mp4"))
    parser.add_argument("--stroke", default="dry_brush", help="name or image file")
    parser.add_argument("--strokes", type=int, default=4000, help="strokes, 1 or more")
    parser.add_argument("--frames", type=int, default=97, help="3 or more")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480), help="pixels")
    args = parser.parse_args()
    print(f"writes {args.output}: {args.frames - 1} frames")

    strokes = bg.cluster(bg.prune(still_life()), args.strokes)
    cameras = swaying(still_life_camera(width=args.size[0], height=args.size[1]), args.frames)
    texture = bg.StrokeTexture.open(args.stroke)
    frames = list(bg.render_sequence(strokes, cameras, texture, depth=False))[:-1]
    bg.save_video(frames, args.output, fps=24, background=(0.18, 0.13, 0.07), loops=True)


if __name__ == "__main__":
    main()
