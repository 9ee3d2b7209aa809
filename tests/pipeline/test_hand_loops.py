"""Films made by hand close where the path of their camera does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.options.hand import HandConfig
from brushgs.options.sequence import PathConfig
from tests.kit.for_each import for_each
from tests.pipeline.test_cameras_beside import write_cameras
from tests.pipeline.test_sequence import config, paint, read_image

NUM_FRAMES, FPS = 24, 12
SWAY = PathConfig(orbit=NUM_FRAMES, sway=0.05, fps=FPS)  # small steps: what changes is what is made by hand
FILE = Path("closed.json")


pytestmark = pytest.mark.usefixtures("folder")


def film(scene, path, **hand):
    """The frames [F, H, W, 3] of a film, 0 to 1."""
    folder = Path("closed" if path.loop or path.orbit else "open")
    paint(scene, f"{folder}/", path, replace(config(), hand=HandConfig(**hand)))
    return np.stack([read_image(file)[..., :3] for file in sorted(folder.glob("*.png"))])


def changes(frames):
    """Rms of the change of each frame to the next; of the last one to the first one."""
    return np.sqrt(np.square(np.roll(frames, -1, axis=0) - frames).mean(axis=(1, 2, 3)))


def closed_file(scene):
    """A file of cameras on a small circle, whose last view is its first one."""
    cameras = bg.orbit(read_scene(scene)[0], 40 * NUM_FRAMES, width=48, height=36)
    away = np.rint(NUM_FRAMES / 4 * np.sin(2 * np.pi * np.arange(NUM_FRAMES + 1) / NUM_FRAMES)).astype(int)
    write_cameras(FILE.resolve(), [cameras[step] for step in away])


@for_each("of_file", [False, True])
@for_each("hand", [{"boil": 0.5}, {"redraw": 2.0}, {"redraw": 2.0, "redraw_from": Path("left")}])
def test_a_film_closes_where_the_path_of_its_camera_closes(of_file, hand, scene):
    if of_file:
        closed_file(scene)
    path = PathConfig(file=FILE, loop=True, fps=FPS) if of_file else SWAY
    found = changes(film(scene, path, **hand))
    assert len(found) == NUM_FRAMES
    if "boil" in hand:
        found = found[2::3]  # from drawing to drawing: the last one is over when the film begins again
    assert 0.9 * found[:-1].min() < found[-1] < 1.05 * found[:-1].max()  # 0 where the first frame comes twice
