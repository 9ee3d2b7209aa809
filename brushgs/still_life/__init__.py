"""The example scene: a still life in the form of a trained 3D Gaussian Splatting scene, built in code.

A blue jug, a nearly black bottle, a brass bowl of oranges and grapes, an apple, a pear and a lemon on a white
cloth, and a knife whose edge consists of needles a hundred times as long as thick. Flat Gaussians lie on the
surfaces; lamp, shadow and ambient light are baked into their colors; highlights move with the viewer by
spherical harmonics of degree 3. Up is -y, lengths are in decimeters.
"""

import numpy as np

from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import blockers_of, cast_of, joined
from brushgs.still_life.light import TO_LAMP, baked
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

NUM_GAUSSIANS = 50_000


def still_life(num_gaussians: int = NUM_GAUSSIANS, seed: int = 0) -> Gaussians:
    """Build the example scene.

    Args:
        num_gaussians: approximate count, >= 1000; the result differs by some percent.
        seed: of all random choices; equal seeds give equal scenes.

    Returns:
        Float32 Gaussians with spherical harmonics of degree 3.

    Raises:
        ValueError: if `num_gaussians` is less than 1000.
    """
    if num_gaussians < 1000:
        raise ValueError(f"still_life: num_gaussians must be at least 1000, got {num_gaussians}")
    rng = np.random.default_rng(seed)
    parts = list(bodies(num_gaussians, rng))
    blockers = blockers_of(parts)
    casts = [cast_of(body, number, rng) for number, body in enumerate(parts)]
    sh = [baked(cast.surface, blockers, TO_LAMP) for cast in casts]
    cast = joined(casts)
    return cast.gaussians(np.concatenate(sh)).take(cast.opacities > 1 / 255)


def still_life_camera(*, width: int = 960, height: int = 720) -> Camera:
    """The view the scene is composed for: wall and table fill the picture."""
    return Camera.look_at(
        (1.2, -3.35, -10.2), (0.12, -1.42, 0.2), width=width, height=height, fov_y=float(np.radians(29.0))
    )
