"""The first view of each scene: python -m tests.bench.first_view [--scenes NAME ...] [--draw first.png].

Tables in Markdown. Scenes: the estimate, and the time of one processor. Turns: how sure and how right the up
axis of all 24 turns of each scene onto its axes is, from the evidence of one, which turns with the scene.
Rules: how often two rules take the right axis, a turn counted as often as scenes have such an axis up; with
the weights as they are, and for each scene with weights that are fitted on all others.
--draw paints the first picture of every scene, plain, on one sheet. Missing scenes are skipped; the still
life is always there.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import brushgs as bg
from brushgs.cameras.framing import AXES, DEFAULT_UP, frame_scene
from brushgs.core.threads import at_most
from brushgs.first_view import find_first_view
from brushgs.first_view.sample import take_sample
from brushgs.first_view.up import EVIDENCE, PRIORS, SURE, Ups, believed_up, measure_up, ranked
from brushgs.formats.pictures.images import write_frame
from brushgs.values.arrays import F64
from brushgs.values.frame import Frame
from tests.bench.doctor import SCENES as PLY_SCENES
from tests.bench.doctor import print_row, scenes
from tests.bench.machine import describe
from tests.first_view.scenes import ROTATIONS

SCENES = PLY_SCENES | {"plant.splat": "-y", "guitar.ksplat": "-y"}
COMMON = 0.15  # prior of the axes that most scenes have up
BINS = ((SURE, "0.85 and more"), (0.7, "0.70 to 0.85"), (0.0, "below 0.70"))
USUAL, HOLD = 0.5, 0.3  # weight that fitted weights are held to, and how strongly
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


def turns(name: str, evidence: F64) -> Iterator[tuple[str, Ups]]:
    """The true axis and the estimate in all turns of a scene onto its axes, from its [6] log odds."""
    names, directions = list(AXES), np.array(list(AXES.values()))
    for rotation in ROTATIONS:
        turned = [int(np.argmax(directions @ (rotation @ axis))) for axis in directions]
        odds = np.log([PRIORS[axis] for axis in names])
        odds[turned] += evidence
        chances = np.exp(odds) / np.exp(odds).sum()
        yield (
            names[turned[names.index(SCENES[name])]],
            ranked(dict(zip(names, chances.tolist(), strict=True))),
        )


def count_turns(name: str, evidence: F64, counts: dict[tuple[bool, str], list[int]]) -> None:
    for true, ups in turns(name, evidence):
        label = next(text for least, text in BINS if ups[0][1] >= least)
        count = counts.setdefault((PRIORS[true] >= COMMON, label), [0, 0])
        count[0] += 1
        count[1] += int(ups[0][0] == true)


def default_unless_sure(ups: Ups) -> str:
    return ups[0][0] if ups[0][1] >= SURE else DEFAULT_UP


def share_right(rule: Callable[[Ups], str], evidence: dict[str, F64]) -> float:
    """Of all scenes in all turns, counted as often as scenes have such an axis up."""
    copies = len(ROTATIONS) / len(AXES)
    rights = [
        PRIORS[true] / copies * (rule(ups) == true)
        for name, odds in evidence.items()
        for true, ups in turns(name, odds)
    ]
    return sum(rights) / len(evidence) / sum(PRIORS.values())


def scores_of(values: dict[str, F64]) -> F64:
    """[6, kinds] log odds of the values of each kind, were its weight 1 or -1."""
    return np.stack([EVIDENCE[kind].score(values[kind]) / abs(EVIDENCE[kind].weight) for kind in EVIDENCE], 1)


def fitted_weights(scores: dict[str, F64]) -> F64:
    """[kinds] weights under which the true axes of scenes are most probable, without the priors."""
    true = [list(AXES).index(SCENES[name]) for name in scores]

    def loss(weights: F64) -> float:
        odds = np.array([rows @ weights for rows in scores.values()])
        missed = np.logaddexp.reduce(odds, axis=1) - odds[np.arange(len(true)), true]
        return float(missed.sum() + HOLD * ((weights - USUAL) ** 2).sum())

    start = np.full(len(EVIDENCE), USUAL)
    return np.asarray(minimize(loss, start, bounds=[(0, None)] * len(start)).x)


def print_rules(measured: dict[str, dict[str, F64]]) -> None:
    scores = {name: scores_of(values) for name, values in measured.items()}
    weights = np.array([abs(kind.weight) for kind in EVIDENCE.values()])
    as_they_are = {name: rows @ weights for name, rows in scores.items()}
    left_out = {
        name: rows @ fitted_weights({other: scores[other] for other in scores if other != name})
        for name, rows in scores.items()
    }
    print_row("rule", "weights as they are", "fitted on all other scenes")
    print_row(*["---"] * 3)
    rules: dict[str, Callable[[Ups], str]] = {
        "the best axis, but -y where it is half as probable": lambda ups: believed_up(ups)[0],
        "the best axis at 0.85 and more, else -y": default_unless_sure,
        "the best axis": lambda ups: ups[0][0],
    }
    for words, rule in rules.items():
        print_row(words, *(f"{100 * share_right(rule, odds):.0f} %" for odds in (as_they_are, left_out)))


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
    measured = {}
    with at_most(1):
        for name, gaussians in scenes(args.scenes, SCENES):
            scene_row(name, gaussians)
            sample = take_sample(gaussians)
            assert sample is not None
            measured[name] = measure_up(sample)
            odds = sum(EVIDENCE[kind].score(values) for kind, values in measured[name].items())
            count_turns(name, np.asarray(odds), counts)
    print()
    print_row("probability of the best axis", "turns to -y, +z, +y", "right", "to other axes", "right")
    print_row(*["---"] * 5)
    for _, label in BINS:
        cells = [number for is_common in (True, False) for number in counts.get((is_common, label), [0, 0])]
        print_row(label, *cells)
    print()
    print_rules(measured)


if __name__ == "__main__":
    main()
