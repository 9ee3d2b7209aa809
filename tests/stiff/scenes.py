"""Stiff and hostile scenes by name: small, made here, within float32, each with a path of cameras."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

WIDTH, HEIGHT = 60, 45
FLOAT = np.finfo(np.float32)
LARGEST, SMALLEST = float(FLOAT.max), float(FLOAT.smallest_subnormal)
EYE = (0.3, -0.4, -3.0)


@dataclass(frozen=True)
class Stiff:
    """A scene, the views along a closed path, and what must come of it.

    `outcome` "drawn": the first view shows it. "dropped": no box is left, all are counted. "finite":
    whatever is shown has no NaN; what that is hangs on rounding or on the pass.
    """

    scene: Gaussians
    cameras: Sequence[Camera]
    outcome: str = "drawn"


def random_scene(n: int = 60, *, degree: int = 1, seed: int = 0) -> Gaussians:
    g = np.random.default_rng([seed, n])
    means, quats = g.normal(size=(n, 3)) * 0.6, g.normal(size=(n, 4))
    scales, opacities = np.exp(g.uniform(np.log(0.02), np.log(0.3), (n, 3))), g.uniform(0.3, 1, n)
    sh = g.normal(size=(n, (degree + 1) ** 2, 3)) * 0.4
    return Gaussians(means, quats, scales, opacities, sh).astype(np.float32).astype(np.float64)


BASE = random_scene()


def scene(**columns) -> Gaussians:
    """`BASE` with other columns: each a value for all rows or a function of the column; within float32."""
    changed = {}
    for name, value in columns.items():
        old = getattr(BASE, name)
        new = value(old) if callable(value) else value
        # Single values lie just below the largest float32: they must survive the way to float32 and back.
        new = np.clip(np.broadcast_to(np.asarray(new, np.float64), old.shape), -LARGEST, LARGEST)
        changed[name] = new.astype(np.float32).astype(np.float64)
    return replace(BASE, **changed)


def some(value, each: int = 5):
    """A function of a column that sets every so many rows to a value."""
    return lambda old: np.where(
        (np.arange(len(old)) % each == 0).reshape(-1, *[1] * (old.ndim - 1)), value, old
    )


def orbit(eye=EYE, target=(0, 0, 0), *, views: int = 5, **camera) -> list[Camera]:
    """A closed path around the target, at the height of the eye."""
    away, size = np.subtract(eye, target), {"width": WIDTH, "height": HEIGHT, **camera}
    cameras = []
    for angle in np.linspace(0, 2 * np.pi, views, endpoint=False):
        c, s = np.cos(angle), np.sin(angle)
        turned = (c * away[0] + s * away[2], away[1], c * away[2] - s * away[0])
        cameras.append(Camera.look_at(np.add(target, turned), target, **size))
    return [*cameras, cameras[0]]


def resized(unit: float, **camera) -> Stiff:
    near = camera.pop("near", 0.01 * unit)
    changed = scene(means=lambda m: m * unit, scales=lambda s: s * unit)
    return Stiff(changed, orbit(np.multiply(EYE, unit), near=near, **camera))


def of_shape(ratios, quat=None) -> Gaussians:
    quats = {} if quat is None else {"quats": np.array(quat, float)}
    return scene(scales=lambda s: s * ratios, **quats)


END_ON, ALONG_X, ALONG_Y = (1, 0, -1, 0), (1, 0, 0, 0), (1, 0, 0, 1)  # what the own x axis becomes
FRONT = orbit((0, 0, -3))
FAR = np.random.default_rng(3).uniform(-2e7, 2e7, BASE.means.shape)
AT_EYE = np.add(EYE, np.random.default_rng(4).normal(size=BASE.means.shape) * 0.02)

SCENES: dict[str, Stiff] = {
    "quaternions of any length": Stiff(
        scene(quats=lambda q: np.sign(q) * np.geomspace(1e-38, 1e37, q.size).reshape(q.shape)), orbit()
    ),
    "opacity 1, scale 0": Stiff(scene(opacities=1, scales=lambda s: s * (1, 1, 0)), orbit()),
    "discs of ratio 1e7": Stiff(of_shape((1, 1e-7, 1)), orbit()),
    "needles of ratio 1e7": Stiff(of_shape((10, 1e-6, 1e-6)), orbit()),
    "needles across": Stiff(of_shape((3, 1e-5, 1e-5), ALONG_X), FRONT),
    "needles end-on": Stiff(of_shape((1, 1e-5, 1e-5), END_ON), FRONT),
    "needles through the near plane": Stiff(of_shape((100, 0.01, 0.01), END_ON), orbit((0, 0, -0.5))),
    "Gaussians around the camera": Stiff(scene(means=some(AT_EYE), scales=some(2.0)), orbit()),
    "the camera in a mean": Stiff(scene(means=some(np.array(EYE))), orbit()),
    "the camera inside": Stiff(BASE, orbit((0.05, 0.02, 0.01), (1, 0.2, 0.3))),
    "strokes that fill the screen 100 times": Stiff(scene(scales=some(30.0)), orbit()),
    "extents of 2e7": Stiff(
        scene(means=lambda m: np.where(np.arange(len(m))[:, None] % 2, FAR, m), scales=some(1e6, 3)), orbit()
    ),
    "1e-4 wide": resized(1e-4),
    "1e4 wide": resized(1e4),
    "1e5 from the origin": Stiff(scene(means=lambda m: m + 1e5), orbit(np.add(EYE, 1e5), (1e5, 1e5, 1e5))),
    "isotropic": Stiff(scene(scales=0.1), orbit()),
    "horizontal": Stiff(of_shape((3, 0.1, 0.1), ALONG_X), FRONT),
    "vertical": Stiff(of_shape((3, 0.1, 0.1), ALONG_Y), FRONT),
    "sub-pixel strokes": Stiff(scene(scales=lambda s: s * 0.03, means=lambda m: m * 0.3), orbit()),
    # The kernels draw dots; strokes without length have faded.
    "points": Stiff(scene(scales=0), orbit(), "finite"),
    "equal depths": Stiff(scene(means=lambda m: m * (1, 1, 0)), FRONT),
    "N = 0": Stiff(BASE.take(slice(0, 0)), orbit(), "dropped"),
    "N = 1": Stiff(scene(means=0).take(slice(0, 1)), orbit()),
    "N = 2": Stiff(scene(means=0).take(slice(0, 2)), orbit()),
    "all colors equal": Stiff(scene(sh=0), orbit()),
    "all positions equal": Stiff(scene(means=0), orbit()),
    **{f"degree {d}": Stiff(random_scene(degree=d), orbit()) for d in range(4)},
    # More of the kind
    "all rows equal": Stiff(BASE.take(np.zeros(60, int)), orbit()),
    "means on a line": Stiff(scene(means=lambda m: m * (1, 0, 0)), orbit()),
    "means on a plane": Stiff(scene(means=lambda m: m * (1, 0, 1)), orbit()),
    "opacity 0": Stiff(scene(opacities=0), orbit(), "dropped"),
    "opacity of the smallest float": Stiff(scene(opacities=SMALLEST), orbit(), "dropped"),
    "all black": Stiff(scene(sh=-9), orbit()),
    "scales of the smallest float": Stiff(scene(scales=SMALLEST), orbit(), "finite"),
    "scales of the largest float": Stiff(scene(scales=LARGEST), orbit(), "finite"),
    "some scales of the largest float": Stiff(scene(scales=some(LARGEST)), orbit()),
    "means of the largest float": Stiff(scene(means=lambda m: np.sign(m) * LARGEST), orbit(), "finite"),
    "some means of the largest float": Stiff(scene(means=some(LARGEST)), orbit()),
    "colors of the largest float": Stiff(scene(sh=lambda s: np.sign(s) * LARGEST), orbit(), "finite"),
    "quaternions of the smallest float": Stiff(scene(quats=lambda q: np.sign(q) * SMALLEST), orbit()),
    "quaternions of the largest float": Stiff(scene(quats=lambda q: np.sign(q) * LARGEST), orbit()),
    "1e-30 wide": resized(1e-30),
    "1e30 wide": resized(1e30),
    "below the normal floats": Stiff(
        scene(means=lambda m: m * 1e-40, scales=lambda s: s * 1e-40), orbit(), "finite"
    ),
    "the camera 1e9 away": Stiff(BASE, orbit(np.multiply(EYE, 1e9)), "finite"),
    "the camera 1e9 away, in close-up": Stiff(BASE, orbit(np.multiply(EYE, 1e9), fov_y=1e-9)),
    "a field of view of 0.01 degrees": Stiff(BASE, orbit(fov_y=np.radians(0.01)), "finite"),
    "a field of view of 179 degrees": Stiff(BASE, orbit(fov_y=np.radians(179))),
    "a field of view of 179.9999 degrees": Stiff(BASE, orbit(fov_y=np.radians(179.9999)), "finite"),
    "a near plane at 1e-30": Stiff(BASE, orbit((0.05, 0.02, 0.01), (1, 0.2, 0.3), near=1e-30)),
    "a near plane behind everything": Stiff(BASE, orbit(near=1e30), "dropped"),
    "a picture of 1x1": Stiff(BASE, orbit(width=1, height=1)),
}
