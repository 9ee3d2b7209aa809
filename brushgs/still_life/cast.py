"""Convert bodies of the example scene to unlit Gaussians; all random choices are made here."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.random import Generator

from brushgs.still_life.bodies import Body
from brushgs.still_life.light import Blockers, Surface
from brushgs.still_life.surfaces import unit
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of

COVER = 0.67  # standard deviation over point spacing: the surface is closed, but not blurred
FLATNESS = 0.12  # thickness over width of a Gaussian
JITTER = 0.25  # along the surface, over point spacing: a regular pattern would be visible
SIZE_SPREAD = 0.28  # log-normal spread of sizes, as training leaves it


@dataclass(frozen=True, eq=False)
class Cast:
    """n Gaussians without colors, float64, and their surface for lighting.

    Attributes:
        surface: the lit points, one per Gaussian.
        means: [n, 3] world units.
        quats: [n, 4] w, x, y, z: the axes are the tangent, its perpendicular, and the normal.
        scales: [n, 3] world units.
        opacities: [n] 0 to 1.
    """

    surface: Surface
    means: F64
    quats: F64
    scales: F64
    opacities: F64

    def gaussians(self, sh: F64) -> Gaussians:
        """Float32 Gaussians in the colors `sh` [n, 16, 3]."""
        columns = self.means, self.quats, self.scales, self.opacities, sh
        return Gaussians(*(column.astype(np.float32) for column in columns))

    def take(self, rows: Rows | Mask) -> "Cast":
        """Some of the rows."""
        return Cast(self.surface.take(rows), *(getattr(self, f.name)[rows] for f in fields(self)[1:]))


def cast_of(body: Body, number: int, rng: Generator) -> Cast:
    """The Gaussians of body `number` of the scene."""
    patch = body.patch
    n = len(patch)
    wobble = np.exp(rng.normal(0, 0.045, (n, 1)))  # trained neighbors differ in color
    size = COVER * body.size * patch.spacing * np.exp(rng.normal(0, SIZE_SPREAD, n))
    scales = size[:, None] * np.array([np.sqrt(body.stretch), 1 / np.sqrt(body.stretch), FLATNESS])
    opacities = np.broadcast_to(body.opacity, n) * rng.uniform(0.93, 1.0, n)
    across = np.cross(patch.normals, patch.tangents)
    shifts = JITTER * patch.spacing[:, None] * rng.normal(size=(n, 2))
    means = patch.points + shifts[:, :1] * patch.tangents + shifts[:, 1:] * across
    surface = Surface(
        points=patch.points,
        normals=patch.normals,
        albedos=body.albedo,
        wobble=wobble,
        gloss=np.full(n, body.gloss),
        shininess=np.full(n, body.shininess),
        bodies=np.full(n, number),
    )
    return Cast(surface, means, _frames(patch.normals, patch.tangents), scales, opacities)


def joined(casts: Sequence[Cast]) -> Cast:
    """Concatenate casts in order."""

    def column(name: str) -> F64:
        return np.concatenate([getattr(cast, name) for cast in casts])

    surfaces = [cast.surface for cast in casts]
    surface = Surface(*(np.concatenate([getattr(s, f.name) for s in surfaces]) for f in fields(Surface)))
    return Cast(surface, *(column(f.name) for f in fields(Cast)[1:]))


def blockers_of(parts: Sequence[Body]) -> Blockers:
    """The bodies as occluders of light."""
    rows = [(number, body, body.blockers) for number, body in enumerate(parts) if body.blockers is not None]
    ellipsoids = np.concatenate([balls for _, _, balls in rows])
    counts = [len(balls) for _, _, balls in rows]
    return Blockers(
        centers=ellipsoids[:, :3],
        radii=ellipsoids[:, 3:],
        bodies=np.repeat([number for number, _, _ in rows], counts),
        albedos=np.repeat([body.albedo.mean(axis=0) for _, body, _ in rows], counts, axis=0),
    )


def _frames(normals: F64, tangents: F64) -> F64:
    """[n, 4] quaternions w, x, y, z whose axes are the tangent, its perpendicular, and the normal."""
    z = unit(normals)
    x = unit(tangents - (tangents * z).sum(axis=1, keepdims=True) * z)
    return quats_of(np.stack([x, np.cross(z, x), z], axis=2))
