"""Writes film.mp4: the example scene in motion, painted; the pear rolls, a draught lifts the cloth.

python examples/film.py [-o FILE] [--look NAME] [--seconds SECONDS] [--size WIDTH HEIGHT]
"""

import argparse
from pathlib import Path

import brushgs as bg
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("film.mp4"))
    parser.add_argument("--look", default="oil", help="name or TOML file")
    parser.add_argument("--seconds", type=float, default=4.0, help="of the scene, above 0 to 4")
    parser.add_argument("--size", type=int, nargs=2, default=(640, 480), help="pixels")
    args = parser.parse_args()

    scene = still_life_moving()  # or bg.load_moving("clip.splatv")
    print(f"{scene.duration:g} s, {len(scene.at(0.0)):,} Gaussians, {scene.resting.mean():.0%} rest")
    clip = bg.ClipConfig(end=bg.Moment(args.seconds), fps=24)
    camera = still_life_camera(width=args.size[0], height=args.size[1])
    report = bg.paint_film(scene, args.output, args.look, camera=camera, clip=clip)
    follow = next(stage for stage in report.stages if stage.name == "follow")
    print(f"{args.output}: {follow.did}")


if __name__ == "__main__":
    main()
