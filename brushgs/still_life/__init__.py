"""The example scene: a still life in the form of a trained 3D Gaussian Splatting scene, built in code.

A blue jug, a nearly black bottle, a brass bowl of oranges and grapes, an apple, a pear and a lemon on a white
cloth, and a knife whose edge consists of needles a hundred times as long as thick. Flat Gaussians lie on the
surfaces; lamp, shadow and ambient light are baked into their colours; highlights move with the viewer by
spherical harmonics of degree 3. Up is -y, lengths are in decimetres.
"""

import numpy as np
from numpy.random import Generator

from brushgs.arrays import F64
from brushgs.quats import quats_of
from brushgs.scene import Camera, Gaussians
from brushgs.sh import C0
from brushgs.still_life.bodies import Body, bodies
from brushgs.still_life.light import (
    LAMP,
    TO_LAMP,
    Blockers,
    ambient,
    encode,
    fit_views,
    lamp_visibility,
    view_dome,
)
from brushgs.still_life.surfaces import unit

NUM_GAUSSIANS = 50_000
COVER = 0.67  # standard deviation over point spacing: the surface is closed, but not blurred
FLATNESS = 0.12  # thickness over width of a Gaussian
JITTER = 0.25  # along the surface, over point spacing: a regular pattern would be visible
SIZE_SPREAD = 0.28  # log-normal spread of sizes, as training leaves it


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
    blockers = _blockers(parts)
    columns = [_gaussians_of(body, number, blockers, rng) for number, body in enumerate(parts)]
    means, quats, scales, opacities, sh = (
        np.concatenate(column).astype(np.float32) for column in zip(*columns, strict=True)
    )
    visible = opacities > 1 / 255
    return Gaussians(means[visible], quats[visible], scales[visible], opacities[visible], sh[visible])


def still_life_camera(*, width: int = 960, height: int = 720) -> Camera:
    """The view the scene is composed for: wall and table fill the picture."""
    return Camera.look_at(
        (1.2, -3.35, -10.2), (0.12, -1.42, 0.2), width=width, height=height, fov_y=float(np.radians(29.0))
    )


def _blockers(parts: list[Body]) -> Blockers:
    rows = [(number, body) for number, body in enumerate(parts) if body.blockers is not None]
    ellipsoids = np.concatenate([body.blockers for _, body in rows if body.blockers is not None])
    counts = [len(body.blockers) for _, body in rows if body.blockers is not None]
    return Blockers(
        centers=ellipsoids[:, :3],
        radii=ellipsoids[:, 3:],
        bodies=np.repeat([number for number, _ in rows], counts),
        albedos=np.repeat([body.albedo.mean(axis=0) for _, body in rows], counts, axis=0),
    )


def _gaussians_of(body: Body, number: int, blockers: Blockers, rng: Generator) -> tuple[F64, ...]:
    """Columns means, quats, scales, opacities and sh of one lit body."""
    patch = body.patch
    own = np.full(len(patch), number)
    facing = patch.normals @ TO_LAMP
    lamp = LAMP * (np.maximum(facing, 0) * lamp_visibility(patch.points, own, blockers))[:, None]
    light = lamp + ambient(patch.points, patch.normals, own, blockers)
    wobble = np.exp(rng.normal(0, 0.045, (len(patch), 1)))  # trained neighbours differ in colour
    sh = _view_dependent(body, body.albedo * light * wobble, lamp)
    size = COVER * body.size * patch.spacing * np.exp(rng.normal(0, SIZE_SPREAD, len(patch)))
    scales = size[:, None] * np.array([np.sqrt(body.stretch), 1 / np.sqrt(body.stretch), FLATNESS])
    opacities = np.broadcast_to(body.opacity, len(patch)) * rng.uniform(0.93, 1.0, len(patch))
    across = np.cross(patch.normals, patch.tangents)
    shifts = JITTER * patch.spacing[:, None] * rng.normal(size=(len(patch), 2))
    means = patch.points + shifts[:, :1] * patch.tangents + shifts[:, 1:] * across
    return means, _frames(patch.normals, patch.tangents), scales, opacities, sh


def _view_dependent(body: Body, matt: F64, lamp: F64) -> F64:
    """Spherical harmonics [n, 16, 3] of the colour: diffuse light and the highlight of the lamp."""
    sh = np.zeros((len(matt), 16, 3))
    sh[:, 0] = (encode(matt) - 0.5) / C0
    shiny = np.flatnonzero((lamp.max(axis=1) > 1e-3) & (body.gloss > 0))
    if len(shiny):
        dome = view_dome()
        halfway = unit(dome + TO_LAMP)  # Blinn 1977
        lobe = np.maximum(body.patch.normals[shiny] @ halfway.T, 0) ** body.shininess  # [n, V]
        mirror = body.gloss * lobe.T[:, :, None] * lamp[shiny]
        sh[shiny] = fit_views(encode(matt[shiny] + mirror), dome)
    return sh


def _frames(normals: F64, tangents: F64) -> F64:
    """[n, 4] quaternions w, x, y, z whose axes are the tangent, its perpendicular, and the normal."""
    z = unit(normals)
    x = unit(tangents - (tangents * z).sum(axis=1, keepdims=True) * z)
    return quats_of(np.stack([x, np.cross(z, x), z], axis=2))
