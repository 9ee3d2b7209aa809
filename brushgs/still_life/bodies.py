"""The objects of the still life: places, shapes, colors and highlights.

Lengths are in decimeters. The table top is y = 0 and y runs down, so a body stands at negative y.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from brushgs.still_life.surfaces import Patch, revolve, sheet, smooth, sphere, tube, turn, unit
from brushgs.values.arrays import F64

BLADE = np.array([[0.9, -0.06, -2.3], [2.05, -0.06, -1.62]])  # heel and tip of the knife


@dataclass(frozen=True, eq=False)
class Body:
    """One body, ready to be lit.

    Attributes:
        patch: its surface.
        albedo: [n, 3] linear RGB.
        gloss: strength of the highlight, from 0 (matt) to about 1.
        shininess: exponent of the highlight; higher is smaller.
        size: factor on the size of its Gaussians.
        stretch: length over width of its Gaussians, >= 1; the tangent is the long axis.
        opacity: [n] or one number.
        blockers: [K, 6] ellipsoids (center, radii) that approximate it as an occluder of light.
        name: of a body that `still_life_moving` moves.
    """

    patch: Patch
    albedo: F64
    gloss: float = 0.0
    shininess: float = 20.0
    stretch: float = 1.0
    size: float = 1.0
    opacity: float | F64 = 0.97
    blockers: NDArray[np.float64] | None = None
    name: str = ""


def bodies(num: int, rng: Generator) -> Iterator[Body]:
    """All bodies, with about `num` points together."""
    share = num / 50_000
    yield _wall(int(3200 * share), rng)
    yield _table(int(11000 * share), rng)
    yield _cloth(int(9000 * share), rng)
    yield from _jug(int(7000 * share), rng)
    yield _bottle(int(3800 * share))
    yield _bowl(int(4600 * share))
    for center, size, tint in (
        ((1.45, -0.78, 0.55), 0.50, 0.00),
        ((2.28, -0.80, 0.75), 0.48, 0.05),
        ((1.93, -0.84, 1.30), 0.47, -0.04),
        ((1.90, -1.35, 0.80), 0.45, 0.02),
    ):
        yield _orange(center, size, tint, int(1300 * share), rng)
    yield from _apple(int(2600 * share), rng)
    yield from _pear(int(2600 * share), rng)
    yield _lemon(int(1500 * share), rng)
    yield from _grapes(int(200 * share), rng)
    yield from _knife(int(280 * share), rng)


def ripple(coords: F64, rng: Generator, frequency: float, terms: int = 7) -> F64:
    """[n] smooth noise of about unit deviation over `coords` [n, d]: sines in random directions."""
    waves = unit(rng.normal(size=(terms, coords.shape[1]))) * frequency * rng.uniform(0.6, 1.6, (terms, 1))
    phases = rng.uniform(0, 2 * np.pi, terms)
    return np.asarray(np.sin(coords @ waves.T + phases).sum(axis=1) / np.sqrt(terms / 2))


def mix(a: ArrayLike, b: ArrayLike, t: F64) -> F64:
    """[n, 3] colors from `a` at t = 0 to `b` at t = 1; t [n] is clipped."""
    share = np.clip(t, 0, 1)[:, None]
    return np.asarray(np.asarray(a) * (1 - share) + np.asarray(b) * share)


def _wall(num: int, rng: Generator) -> Body:
    """A plastered wall behind the table: in shade on the left, lit on the right, with a ragged outline."""
    flat = sheet((-11.0, -8.0), (9.0, 1.2), lambda x, z: np.zeros_like(x), num)
    patch = flat.moved((0, 0, 4.2), turn((1, 0, 0), -np.pi / 2))
    patch = Patch(
        patch.points, np.tile([0.0, 0.0, -1.0], (num, 1)), patch.tangents, patch.spacing, patch.coords
    )
    x, y = patch.points[:, 0], patch.points[:, 1]
    pool = np.exp(-(((x - 2.6) / 4.2) ** 2) - ((y + 2.4) / 3.0) ** 2)
    mottle = 0.12 * ripple(patch.points[:, :2], rng, 1.3) + 0.08 * ripple(patch.points[:, :2], rng, 3.5)
    albedo = mix(
        (0.006, 0.006, 0.0055), (0.105, 0.082, 0.040), 0.05 + 1.05 * pool + 0.35 * mottle * (0.3 + pool)
    )
    rim = np.hypot((x + 1.0) / 9.6, (y + 2.5) / 5.6) + 0.05 * ripple(patch.points[:, :2], rng, 2.0)
    return Body(patch, albedo, stretch=1.5, size=1.7, opacity=np.clip((1.02 - rim) * 8, 0, 0.98))


def _table(num: int, rng: Generator) -> Body:
    """Dark planks, grain along x, fading out at a round outline."""
    patch = sheet((-8.0, -4.6), (7.4, 4.3), lambda x, z: np.zeros_like(x), num)
    x, z = patch.coords.T
    plank = np.floor((z + 10.15) / 1.45)
    hue = np.sin(plank * 12.9898) * 0.5 + 0.5
    grain = ripple(np.stack([0.5 * x + 3 * plank, 9.0 * z], axis=1), rng, 1.0)
    grain += 0.6 * ripple(np.stack([0.8 * x + plank, 24.0 * z], axis=1), rng, 1.0)
    albedo = mix((0.022, 0.009, 0.004), (0.120, 0.048, 0.018), 0.30 + 0.3 * hue + 0.2 * grain)
    gap = np.abs((z + 10.15) / 1.45 - np.round((z + 10.15) / 1.45)) * 1.45 < 0.035
    albedo[gap] *= 0.25
    rim = np.hypot((x + 0.3) / 7.4, z / 4.5) + 0.02 * ripple(patch.coords, rng, 3.0)
    return Body(patch, albedo, 0.16, 9.0, stretch=2.2, size=1.35, opacity=np.clip((1.0 - rim) * 14, 0, 0.97))


def _cloth(num: int, rng: Generator) -> Body:
    """A white cloth in folds at the front left."""
    phases = rng.uniform(0, 2 * np.pi, 6)

    def height(x: F64, z: F64) -> F64:
        along, across = 0.80 * x + 0.60 * z, -0.60 * x + 0.80 * z
        bend = along + 0.35 * np.sin(1.7 * across + phases[0])
        folds = np.abs(np.sin(2.1 * bend + phases[1])) ** 1.6 * (
            0.55 + 0.45 * np.sin(1.3 * across + phases[2])
        )
        small = 0.25 * np.abs(np.sin(4.7 * bend - 1.9 * across + phases[3])) ** 1.5
        away = np.clip(np.hypot((x + 1.5) / 1.6, (z + 0.75) / 0.9), 0, 1.6)  # flat under the fruit
        return np.asarray(0.05 + 0.36 * (folds + small) * np.clip(away - 0.35, 0, 1) ** 1.2)

    patch = sheet((-4.3, -2.9), (0.6, 1.0), height, num)
    x, z = patch.coords.T
    edge = np.hypot((x + 1.85) / 2.35, (z + 0.95) / 1.85) ** 2 + 0.10 * ripple(patch.coords, rng, 1.6)
    stripe = np.abs(edge - 0.80) < 0.035
    albedo = np.tile([0.80, 0.76, 0.68], (len(patch), 1))
    albedo[stripe] = (0.10, 0.16, 0.36)
    keep = edge < 1.0
    return _take(Body(patch, albedo, stretch=1.4, name="cloth"), keep)


def _jug(num: int, rng: Generator) -> Iterator[Body]:
    """A glazed stoneware jug with a handle: blue above, bare clay at the foot."""
    profile = _profile(
        [0.02, 0.55, 0.66, 0.98, 1.04, 0.86, 0.55, 0.45, 0.49, 0.58, 0.58, 0.53, 0.45, 0.4],
        [0.02, 0.0, 0.1, 0.7, 1.15, 1.75, 2.2, 2.5, 2.8, 2.98, 3.04, 3.03, 2.8, 2.4],
    )
    body = revolve(profile, num)
    azimuth, height = body.coords[:, 0], -body.points[:, 1]
    lip = np.exp(-((np.angle(np.exp(1j * (azimuth - 3.6))) / 0.45) ** 2)) * np.clip(
        (height - 2.5) / 0.5, 0, 1
    )
    body.points[:, [0, 2]] *= 1 + 0.55 * lip[:, None]
    body.points[:, 1] -= 0.12 * lip
    drip = 0.55 + 0.10 * np.sin(5 * azimuth) + 0.07 * np.sin(11 * azimuth + 1)
    glaze = mix((0.010, 0.048, 0.095), (0.040, 0.140, 0.190), 0.45 + 0.25 * ripple(body.points, rng, 3.0))
    glaze = mix(glaze, (0.40, 0.42, 0.36), (np.abs(height - 2.32) < 0.05).astype(float))
    albedo = np.where((height < drip)[:, None], (0.27, 0.125, 0.062), glaze)
    place = (-1.55, 0.0, 1.45)
    heights, radii = (
        np.array([0.35, 0.85, 1.35, 1.85, 2.35, 2.8]),
        np.array([0.7, 0.98, 0.98, 0.72, 0.45, 0.5]),
    )
    balls = [(place[0], -h, place[2], r, r, r) for h, r in zip(heights, radii, strict=True)]
    yield Body(body.moved(place), albedo, 0.8, 70.0, size=1.06, blockers=np.array(balls))
    curve = smooth(
        [(0.48, -2.72, 0), (0.95, -2.86, 0), (1.36, -2.35, 0.0), (1.28, -1.75, 0), (0.92, -1.42, 0)], 40
    )
    handle = tube(curve, np.linspace(0.13, 0.10, 40), num // 9)
    color = np.tile([0.022, 0.085, 0.135], (len(handle), 1))
    yield Body(handle.moved(place, turn((0, 1, 0), 0.35)), color, 0.75, 50.0, stretch=1.6)


def _bottle(num: int) -> Body:
    """A wine bottle, nearly black: pruning must not drop it for its darkness."""
    profile = _profile(
        [0.02, 0.5, 0.56, 0.56, 0.56, 0.5, 0.27, 0.2, 0.19, 0.24, 0.24, 0.17],
        [0.0, 0.0, 0.08, 1.2, 2.25, 2.6, 2.95, 3.25, 3.75, 3.8, 3.98, 4.0],
    )
    patch = revolve(profile, num)
    azimuth, height = patch.coords[:, 0], -patch.points[:, 1]
    albedo = np.tile([0.0035, 0.0055, 0.0030], (num, 1))
    place = (0.20, 0.0, 2.25)
    label = (np.abs(height - 1.25) < 0.42) & (np.abs(np.angle(np.exp(1j * (azimuth + 1.2)))) < 1.05)
    albedo[label] = (0.36, 0.29, 0.17)
    albedo[label & (np.abs(height - 1.48) < 0.05)] = (0.22, 0.03, 0.02)
    albedo[height > 3.35] = (0.075, 0.012, 0.010)  # wax
    balls = [(place[0], -h, place[2], 0.55, 0.45, 0.55) for h in (0.4, 1.0, 1.6, 2.2)]
    balls += [(place[0], -3.3, place[2], 0.2, 0.7, 0.2)]
    return Body(patch.moved(place), albedo, 1.0, 80.0, blockers=np.array(balls))


def _bowl(num: int) -> Body:
    """A brass bowl on a foot."""
    profile = _profile(
        [0.02, 0.55, 0.6, 0.52, 0.95, 1.3, 1.42, 1.41, 1.35, 1.22, 0.88, 0.02],
        [0.03, 0.0, 0.06, 0.16, 0.36, 0.66, 0.9, 0.95, 0.93, 0.7, 0.45, 0.32],
    )
    patch = revolve(profile, num).moved((1.9, 0.0, 0.85))
    albedo = np.tile([0.21, 0.105, 0.022], (num, 1))
    balls = np.array([(1.9, -0.45, 0.85, 1.25, 0.42, 1.25), (1.9, -0.1, 0.85, 0.55, 0.12, 0.55)])
    return Body(patch, albedo, 1.0, 30.0, stretch=1.3, blockers=balls)


def _orange(center: ArrayLike, radius: float, tint: float, num: int, rng: Generator) -> Body:
    patch = sphere(radius, num)
    pores = ripple(patch.points, rng, 26.0) + ripple(patch.points, rng, 4.0)
    albedo = mix((0.55, 0.110, 0.006), (0.80, 0.235 + tint, 0.012), 0.5 + 0.18 * pores)
    albedo[patch.points[:, 1] < -0.985 * radius] = (0.16, 0.17, 0.05)
    lean = turn(rng.normal(size=3), 0.9)
    return Body(patch.moved(center, lean), albedo, 0.30, 16.0, blockers=_ball(center, radius))


def _apple(num: int, rng: Generator) -> Iterator[Body]:
    profile = _profile(
        [0.02, 0.16, 0.34, 0.52, 0.58, 0.48, 0.3, 0.14, 0.02],
        [0.1, 0.02, 0.03, 0.28, 0.6, 0.9, 1.0, 0.94, 0.8],
    )
    patch = revolve(profile, num)
    azimuth, height = patch.coords[:, 0], -patch.points[:, 1]
    streak = (
        0.35 * np.sin(17 * azimuth + 2 * height) + 0.25 * np.sin(31 * azimuth) + ripple(patch.points, rng, 5)
    )
    blush = 0.72 + 0.45 * np.cos(azimuth - 3.9) + 0.12 * streak
    albedo = mix((0.50, 0.28, 0.03), (0.32, 0.006, 0.008), blush)
    albedo = mix(albedo, (0.40, 0.42, 0.08), np.exp(-((patch.points[:, [0, 2]] ** 2).sum(1)) / 0.02))
    lean, place = turn((0.4, 0, 1), 0.22), np.array((0.45, -0.03, -0.95))
    yield Body(
        patch.moved(place, lean), albedo, 0.62, 45.0, blockers=_ball(place - np.array((0, 0.52, 0)), 0.55)
    )
    yield _stalk([(0.0, -0.80, 0.0), (0.02, -1.0, 0.01), (0.10, -1.2, 0.05)], 0.028, num // 25, place, lean)


def _pear(num: int, rng: Generator) -> Iterator[Body]:
    profile = _profile(
        [0.02, 0.22, 0.5, 0.58, 0.47, 0.28, 0.22, 0.12, 0.02],
        [0.05, 0.0, 0.22, 0.52, 0.88, 1.18, 1.42, 1.56, 1.56],
    )
    patch = revolve(profile, num)
    azimuth, height = patch.coords[:, 0], -patch.points[:, 1]
    freckles = np.clip(ripple(patch.points, rng, 34.0) - 1.3, 0, 1)
    albedo = mix((0.30, 0.31, 0.025), (0.48, 0.27, 0.025), 0.5 + 0.3 * ripple(patch.points, rng, 3.0))
    albedo = mix(albedo, (0.55, 0.13, 0.04), 0.75 * np.cos(azimuth - 4.2) - 0.25 * height)
    albedo = mix(albedo, (0.15, 0.09, 0.02), freckles)
    lean, place = turn((0.2, 0, 1), -0.16), np.array((-0.75, -0.07, -0.45))
    low, high = place + np.array([(0.06, -0.5, 0), (0.2, -1.15, 0)])
    balls = np.concatenate([_ball(low, 0.56), _ball(high, 0.28)])
    yield Body(patch.moved(place, lean), albedo, 0.32, 22.0, blockers=balls, name="pear")
    yield _stalk(
        [(0.0, -1.52, 0.0), (-0.03, -1.72, 0.02), (-0.14, -1.95, 0.05)], 0.032, num // 25, place, lean, "pear"
    )


def _lemon(num: int, rng: Generator) -> Body:
    profile = _profile(
        [0.01, 0.1, 0.16, 0.34, 0.42, 0.34, 0.15, 0.08, 0.01],
        [-0.66, -0.6, -0.5, -0.3, 0.0, 0.3, 0.48, 0.56, 0.6],
    )
    patch = revolve(profile, num)
    albedo = mix((0.70, 0.38, 0.008), (0.86, 0.56, 0.02), 0.5 + 0.25 * ripple(patch.points, rng, 12.0))
    center = np.array((-1.85, -0.47, -1.05))
    lean = turn((0, 1, 0), 0.5) @ turn((0, 0, 1), 1.45)
    return Body(patch.moved(center, lean), albedo, 0.35, 20.0, blockers=_ball(center, 0.44))


def _grapes(num_each: int, rng: Generator) -> Iterator[Body]:
    """A bunch of black grapes that hangs from the bowl onto the table."""
    stem = smooth(
        [
            (1.05, -1.02, 0.25),
            (0.78, -1.0, -0.05),
            (0.72, -0.55, -0.22),
            (1.00, -0.22, -0.62),
            (1.45, -0.2, -0.85),
        ],
        22,
    )
    for i, center in enumerate(stem):
        for _ in range(2 if 3 < i < 18 else 1):
            place = center + rng.normal(0, 0.13, 3) * (1, 0.6, 1)
            radius = rng.uniform(0.15, 0.19)
            place[1] = min(place[1], -radius)
            patch = sphere(radius, num_each)
            bloom = 0.5 + 0.3 * ripple(patch.points, rng, 12.0)
            albedo = mix((0.014, 0.004, 0.018), (0.065, 0.032, 0.085), bloom * rng.uniform(0.4, 1.1))
            yield Body(patch.moved(place), albedo, 0.55, 50.0, blockers=_ball(place, radius))


def _knife(num: int, rng: Generator) -> Iterator[Body]:
    """A table knife: a bright blade whose edges are needles, and a horn handle."""
    heel, tip = BLADE
    along = unit(tip - heel)
    across = unit(np.cross(along, (0, 1, 0)))
    t, s = rng.uniform((0, -0.5), (1, 0.5), (num, 2)).T
    width = 0.16 * np.clip((1 - t) * 5, 0, 1) ** 0.5
    points = heel + t[:, None] * (tip - heel) + (s * width)[:, None] * across
    normals = unit(np.tile([0.0, -1.0, 0.0], (num, 1)) + 0.35 * s[:, None] * across)
    spacing = np.full(num, np.sqrt(0.14 * np.linalg.norm(tip - heel) / num))
    blade = Patch(points, normals, np.tile(along, (num, 1)), spacing, np.stack([t, s], axis=1))
    yield Body(blade, np.tile([0.30, 0.31, 0.33], (num, 1)), 1.1, 16.0, stretch=1.6)
    few = max(num // 20, 4)  # the edge: needles more than a hundred times as long as thick
    t = (np.arange(few) + 0.5) / few
    edge = heel + t[:, None] * 0.9 * (tip - heel) - 0.085 * across
    normals = np.tile(unit(-0.4 * across - (0, 1, 0)), (few, 1))
    needles = Patch(edge, normals, np.tile(along, (few, 1)), np.full(few, 0.012), np.stack([t, t], axis=1))
    yield Body(needles, np.tile([0.75, 0.74, 0.70], (few, 1)), 1.0, 12.0, stretch=200.0)
    curve = np.linspace(heel - 0.02 * along, heel - 0.95 * along, 20)
    handle = tube(curve, 0.085 + 0.03 * np.sin(np.linspace(0, 3, 20)), num)
    balls = np.array([(*heel - along * d, 0.14, 0.1, 0.14) for d in (0.15, 0.45, 0.75)])
    yield Body(handle, np.tile([0.055, 0.022, 0.010], (num, 1)), 0.6, 40.0, stretch=2.0, blockers=balls)


def _profile(radii: list[float], heights: list[float]) -> F64:
    """A smooth profile [p, 2] (radius, height) for a surface of revolution."""
    return smooth(np.stack([radii, heights], axis=1))


def _stalk(curve: ArrayLike, radius: float, num: int, place: F64, lean: F64, name: str = "") -> Body:
    patch = tube(smooth(curve, 12), np.full(12, radius), max(num, 30))
    albedo = np.tile([0.10, 0.055, 0.020], (len(patch), 1))
    return Body(patch.moved(place, lean), albedo, stretch=3.0, name=name)


def _ball(center: ArrayLike, radius: float) -> F64:
    return np.array([[*np.asarray(center, dtype=float), radius, radius, radius]])


def _take(body: Body, keep: NDArray[np.bool_]) -> Body:
    """The points of a body inside a mask."""
    p = body.patch
    patch = Patch(p.points[keep], p.normals[keep], p.tangents[keep], p.spacing[keep], p.coords[keep])
    return replace(body, patch=patch, albedo=body.albedo[keep])
