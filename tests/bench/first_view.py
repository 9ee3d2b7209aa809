"""The first view of each scene: python -m tests.bench.first_view [--scenes NAME ...] [--draw first.png].

Tables in Markdown. Scenes: the estimate, and the time of one processor. Turns: how sure and how right the up
axis of all 24 turns of each scene onto its axes is, from the evidence of one, which turns with the scene.
--draw paints the first picture of every scene, plain, on one sheet. Missing scenes are skipped; the still
life is always there.
"""

import argparse
import time
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import AXES, frame_scene
from brushgs.first_view import find_first_view
from brushgs.first_view.sample import take_sample
from brushgs.first_view.up import PRIORS, SURE, up_evidence
from brushgs.io.pictures.images import write_frame
from brushgs.scene import Frame
from brushgs.threads import at_most
from tests.bench.doctor import SCENES as PLY_SCENES
from tests.bench.doctor import print_row, scenes
from tests.bench.machine import describe
from tests.first_view.scenes import ROTATIONS

SCENES = PLY_SCENES | {"plant.splat": "-y", "guitar.ksplat": "-y"}
COMMON = 0.15  # prior of the axes that most scenes have up
BINS = ((SURE, "0.85 and more"), (0.7, "0.70 to 0.85"), (0.0, "below 0.70"))
WIDTH, HEIGHT, COLUMNS = 320, 240, 4


def scene_row(name: str, gaussians: bg.Gaussians) -> None:
    start = time.process_time()
    view = find_first_view(gaussians)
    seconds = time.process_time() - start
    assert view.probability is not None
    ranking = ", ".join(f"{axis} {chance:.2f}" for axis, chance in view.ups[:3])
    angles = (f"{np.degrees(angle):.0f}" for angle in (view.front, view.azimuth, view.elevation))
    kind = "inside" if view.eye is not None else "surroundings" if view.has_surroundings else "object"
    verdict = "sure" if view.probability >= SURE else "not sure"
    print_row(name, f"{len(gaussians):,}", SCENES[name], ranking, verdict, *angles, kind, f"{seconds:.2f}")


def count_turns(name: str, gaussians: bg.Gaussians, counts: dict[tuple[bool, str], list[int]]) -> None:
    sample = take_sample(gaussians)
    assert sample is not None
    evidence, names = up_evidence(sample), list(AXES)
    directions = np.array(list(AXES.values()))
    for rotation in ROTATIONS:
        turned = [int(np.argmax(directions @ (rotation @ axis))) for axis in directions]
        odds = np.log([PRIORS[axis] for axis in names])
        odds[turned] += evidence
        chances = np.exp(odds) / np.exp(odds).sum()
        true = turned[names.index(SCENES[name])]
        label = next(text for least, text in BINS if chances.max() >= least)
        count = counts.setdefault((PRIORS[names[true]] >= COMMON, label), [0, 0])
        count[0] += 1
        count[1] += int(chances.argmax() == true)


def draw(path: Path, wanted: list[str] | None) -> None:
    texture, pictures = bg.StrokeTexture.open("gaussian"), []
    for _, gaussians in scenes(wanted, SCENES):
        camera = frame_scene(find_first_view(gaussians), width=WIDTH, height=HEIGHT)
        pictures.append(bg.render(gaussians, camera, texture, depth=False).over((1.0, 1.0, 1.0)))
    rows = -(-len(pictures) // COLUMNS)
    blank = np.ones((HEIGHT, WIDTH, 3), np.float32)
    pictures += [blank] * (rows * COLUMNS - len(pictures))
    sheet = [np.concatenate(pictures[row * COLUMNS : (row + 1) * COLUMNS], axis=1) for row in range(rows)]
    rgb = np.concatenate(sheet)
    write_frame(Frame(rgb, np.ones(rgb.shape[:2], rgb.dtype)), path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", nargs="*", help="parts of names; all of them if not given")
    parser.add_argument("--draw", type=Path, help="a picture file; nothing else is done then")
    args = parser.parse_args()
    if args.draw:
        draw(args.draw, args.scenes)
        return
    print(describe() + "\n")
    print_row("scene", "Gaussians", "true up", "up", "", "front", "azimuth", "elevation", "kind", "CPU s")
    print_row(*["---"] * 10)
    counts: dict[tuple[bool, str], list[int]] = {}
    with at_most(1):
        for name, gaussians in scenes(args.scenes, SCENES):
            scene_row(name, gaussians)
            count_turns(name, gaussians, counts)
    print()
    print_row("probability of the best axis", "turns to -y, +z, +y", "right", "to other axes", "right")
    print_row(*["---"] * 5)
    for _, label in BINS:
        cells = [number for is_common in (True, False) for number in counts.get((is_common, label), [0, 0])]
        print_row(label, *cells)


if __name__ == "__main__":
    main()
