"""Light of the example scene: one warm lamp, shadow, ambient occlusion, and view-dependent highlights.

Light that does not depend on the viewpoint is baked into one color per Gaussian. Highlights are evaluated
for a dome of views, as photographs of a capture would show them, and fitted by least squares to spherical
harmonics of degree 3, as training would.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from brushgs.still_life.surfaces import GOLDEN_ANGLE, unit
from brushgs.values.arrays import F64, Mask, Rows, smoothstep
from brushgs.values.sh import C0, sh_basis

TO_LAMP = unit((-0.62, -0.68, -0.52))  # from the upper left, in front of the picture plane
LAMP = np.array([1.0, 0.84, 0.60]) * 3.0  # linear RGB
SKY = np.array([0.105, 0.12, 0.17])  # ambient light from above, cooler than the lamp
BOUNCE = np.array([0.10, 0.06, 0.032])  # ambient light from below: reflected by the table
PENUMBRA = 0.16  # half width of the lamp as seen from the table, radians
MAX_VIEW_ELEVATION = 65.0  # degrees; the dome of views runs from 10 degrees below the horizon to here
NUM_VIEWS = 56
RIDGE = 0.02  # bounds the fit where the dome has no view


@dataclass(frozen=True, eq=False)
class Blockers:
    """K ellipsoids that approximate the bodies as occluders of light.

    Attributes:
        centers: [K, 3] world units.
        radii: [K, 3] along x, y, z, world units.
        bodies: [K] number of the body; a body casts no shadow on itself.
        albedos: [K, 3] linear RGB reflectance.
    """

    centers: F64
    radii: F64
    bodies: NDArray[np.int64]
    albedos: F64


@dataclass(frozen=True, eq=False)
class Surface:
    """n points of surfaces, ready to be lit.

    Attributes:
        points: [n, 3] world units.
        normals: [n, 3] unit, out of the body.
        albedos: [n, 3] linear RGB.
        wobble: [n, 1] factor on the matt color.
        gloss: [n] strength of the highlight, see `Body`.
        shininess: [n] exponent of the highlight.
        bodies: [n] number of the body.
    """

    points: F64
    normals: F64
    albedos: F64
    wobble: F64
    gloss: F64
    shininess: F64
    bodies: NDArray[np.int64]

    def take(self, rows: Rows | Mask) -> "Surface":
        """Some of the points."""
        return Surface(*(getattr(self, f.name)[rows] for f in fields(self)))


def baked(surface: Surface, blockers: Blockers, to_lamp: F64) -> F64:
    """Spherical harmonics [n, 16, 3] of the color: diffuse light and the highlight of the lamp.

    Args:
        surface: n points.
        blockers: occluders.
        to_lamp: [3] unit direction to the lamp, or [n, 3] that of each point.
    """
    lamp = lamp_light(surface, blockers, to_lamp)
    matt = matt_light(surface, blockers, lamp)
    sh = np.zeros((len(matt), 16, 3))
    sh[:, 0] = (encode(matt) - 0.5) / C0
    shiny = np.flatnonzero((lamp.max(axis=1) > 1e-3) & (surface.gloss > 0))
    if len(shiny):
        dome = view_dome()
        own = to_lamp if to_lamp.ndim == 1 else to_lamp[shiny, None]
        halfway = unit(dome + own)  # [V, 3] or [n, V, 3]; Blinn 1977
        facing = (
            surface.normals[shiny] @ halfway.T
            if own.ndim == 1
            else _dots(halfway, surface.normals[shiny, None])
        )
        lobe = np.maximum(facing, 0) ** surface.shininess[shiny, None]  # [n, V]
        mirror = surface.gloss[shiny, None] * lobe.T[:, :, None] * lamp[shiny]
        sh[shiny] = fit_views(encode(matt[shiny] + mirror), dome)
    return sh


def lamp_light(surface: Surface, blockers: Blockers, to_lamp: F64) -> F64:
    """[n, 3] linear light that arrives from the lamp; `to_lamp` [3] or [n, 3]."""
    facing = np.maximum(_dots(surface.normals, to_lamp), 0)
    visible = lamp_visibility(surface.points, surface.bodies, blockers, to_lamp)
    return np.asarray(LAMP * (facing * visible)[:, None])


def matt_light(surface: Surface, blockers: Blockers, lamp: F64) -> F64:
    """[n, 3] linear color without highlights, for arriving lamp light `lamp` [n, 3]."""
    light = lamp + ambient(surface.points, surface.normals, surface.bodies, blockers)
    return np.asarray(surface.albedos * light * surface.wobble)


def lamp_visibility(
    points: F64, bodies: NDArray[np.int64], blockers: Blockers, to_lamp: F64 = TO_LAMP
) -> F64:
    """[n] visible share of the lamp from `points` [n, 3] of `bodies` [n], with soft edges, 0 to 1.

    Args:
        points: [n, 3] world units.
        bodies: [n] number of the body of each.
        blockers: occluders.
        to_lamp: [3] unit direction to the lamp, or [n, 3] that of each point.
    """
    shadows: dict[int, F64] = {}
    for center, radii, body in zip(blockers.centers, blockers.radii, blockers.bodies, strict=True):
        ray = to_lamp / radii  # in the space where the ellipsoid is a unit ball
        to_center = (center - points) / radii
        nearest = np.maximum(_dots(to_center, ray) / _dots(ray, ray), 0)  # along the ray, world units
        miss = np.linalg.norm(to_center - nearest[:, None] * ray, axis=1) - 1
        width = np.maximum(nearest * PENUMBRA / radii.mean(), 0.04)
        shadow = 1 - smoothstep(miss / width * 0.5 + 0.5)
        shadow[(bodies == body) | (nearest == 0)] = 0
        shadows[int(body)] = np.maximum(shadows.get(int(body), np.zeros(len(points))), shadow)
    visible = np.ones(len(points))
    for shadow in shadows.values():
        visible *= 1 - shadow
    return visible


def ambient(points: F64, normals: F64, bodies: NDArray[np.int64], blockers: Blockers) -> F64:
    """[n, 3] linear ambient light: sky above, table below, reduced and tinted near other bodies."""
    up = (0.5 - 0.5 * normals[:, 1])[:, None]
    light = SKY * up + BOUNCE * (1 - up)
    for center, radii, body, albedo in zip(
        blockers.centers, blockers.radii, blockers.bodies, blockers.albedos, strict=True
    ):
        to_center = center - points
        distance = np.linalg.norm(to_center, axis=1) + 1e-9
        facing = np.maximum((normals * to_center).sum(axis=1) / distance + 0.25, 0) / 1.25
        share = np.minimum(facing * radii.prod() ** (2 / 3) / distance**2, 0.85)  # of the hemisphere
        share[bodies == body] = 0
        light = light * (1 - share[:, None]) + share[:, None] * albedo * SKY * 1.6
    return np.asarray(light)


def encode(linear: F64) -> F64:
    """Linear light to display-encoded color, 0 to 1, with soft highlights (Reinhard)."""
    mapped = np.maximum(linear, 0)
    mapped = mapped * (1 + mapped / 9) / (1 + mapped)  # white at 3
    return np.asarray(np.clip(mapped * 1.22, 0, 1) ** (1 / 2.2))


def view_dome() -> F64:
    """[V, 3] unit directions from the scene to the cameras of a virtual capture."""
    i = np.arange(NUM_VIEWS)
    low, high = np.sin(np.radians([-10.0, MAX_VIEW_ELEVATION]))
    up = low + (high - low) * (i + 0.5) / NUM_VIEWS
    around = np.sqrt(1 - up**2)
    return np.stack([around * np.cos(i * GOLDEN_ANGLE), -up, around * np.sin(i * GOLDEN_ANGLE)], axis=1)


def fit_views(colors: F64, dome: F64) -> F64:
    """Spherical harmonics [n, 16, 3] of degree 3 of colors [V, n, 3] seen from `dome` [V, 3].

    Ridge regression over the dome, without a penalty on the constant term. The basis takes the direction from
    the camera, which is minus the direction of the dome.
    """
    basis = sh_basis(-dome, degree=3)
    penalty = RIDGE * len(dome) * np.eye(16) / (4 * np.pi)
    penalty[0, 0] = 0
    solve = np.linalg.solve(basis.T @ basis + penalty, basis.T)  # [16, V]
    return np.asarray(np.einsum("kv,vnc->nkc", solve, colors - 0.5, optimize=True))


def _dots(vectors: F64, others: F64) -> F64:
    """Inner products along the last axis; a single vector [3] is used for all."""
    return np.asarray(vectors @ others if others.ndim == 1 else (vectors * others).sum(axis=-1))
