"""Work for the tests of `parallel_map`, in a module of its own: other processes must be able to import it."""

import os
import signal
import time
import warnings
from pathlib import Path

import brushgs as bg
from brushgs.core.threads import num_threads_or_default


def square(x):
    return x * x


def process_id(_):
    return os.getpid()


def slow_process_id(_):
    time.sleep(0.03)
    return os.getpid()


def num_threads(_):
    return num_threads_or_default(None)


def identity(x):
    return x


def die(_):
    os.kill(os.getpid(), signal.SIGKILL)


def fail_at_3(x):
    if x == 3:
        raise bg.SceneError("a.ply", "is bad")
    return x


def warn(x):
    warnings.warn(bg.SceneWarning(f"item {x} is odd"), stacklevel=1)
    return x


class Painter:
    """A small picture of a scene of its own, seen from an item's camera.

    Attributes:
        kills: item whose process is killed in the middle of its work, once.
        marker: file that says it happened.
    """

    def __init__(self, strokes, texture, kills=None, marker=None):
        self.strokes, self.texture, self.kills, self.marker = strokes, texture, kills, marker

    def __call__(self, camera_index):
        camera = bg.Camera.look_at((camera_index / 4, -1, -4), (0, 0, 0), width=160, height=120)
        frame = bg.render(self.strokes, camera, self.texture)
        if camera_index == self.kills and not Path(self.marker).exists():
            Path(self.marker).touch()
            die(None)
        return frame.rgb.tobytes() + frame.alpha.tobytes() + frame.depth.tobytes()
