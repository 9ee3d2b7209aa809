"""A stage: a table and a wall around a subject, in contrasting tones, with the shadow of the subject.

    gaussians -> place -> ground, lamp -> surface, shadow -> tones -> strokes

It consists of strokes in space, so films, pages and 3D files contain it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.cameras.framing import camera_axes
from brushgs.core.native import core as _core
from brushgs.options.choices import StageTone
from brushgs.passes.add.backdrop import mean_lab
from brushgs.passes.add.ground_maps import Grid, blurred
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_place import Place, above_ground, lamp_direction
from brushgs.passes.add.stage_shadow import Shadow, cast_shadow
from brushgs.passes.add.stage_surface import Surface, surface_around
from brushgs.passes.add.stage_tones import Tones, choose_tones, outline_of
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import OKLAB, oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors

LOW = 0.3  # of the height of a stage: strokes below belong to the table


@dataclass(frozen=True, eq=False)
class Stage:
    """The surroundings of a subject, before they are painted.

    Attributes:
        place: where the subject stands.
        ground: of the scene itself, or None.
        surface: of table and wall.
        shadow: of the subject.
        tones: of table and wall.
        follows_light: whether the lamp is estimated from shadows in the scene.
        others: shadows of the subject at other times of a day.
    """

    place: Place
    ground: Ground | None
    surface: Surface
    shadow: Shadow
    tones: Tones
    follows_light: bool = False
    others: tuple[Shadow, ...] = ()

    def at(self, shadow: Shadow) -> "Stage":
        """The stage at the time of day of a shadow, one of `shadow` and `others`."""
        others = tuple(one for one in (self.shadow, *self.others) if one is not shadow)
        return replace(self, place=shadow.place, shadow=shadow, others=others)

    def normals_of(self, strokes: Gaussians) -> F64:
        """[N, 3] normals of strokes on the table and its cove, world axes; 0 for those of the wall."""
        normals = rotation_matrices(strokes.quats)[:, :, 2]
        normals *= np.sign(normals @ self.place.axes[1])[:, None]
        heights = self.place.local(strokes.means)[:, 1]
        return np.asarray(normals * (heights < LOW * self.surface.height[-1])[:, None])

    def table_color(self, strokes: Gaussians) -> F64:
        """[3] OKLab, the mean color of the strokes that lie on the level table; that of the tones without."""
        right, height, away = self.place.local(strokes.means).T
        rows = (np.hypot(right, away) < self.surface.table) & (height < 0.01 * self.surface.wall)
        if not rows.any():
            return self.tones.table
        lab = oklab_of(np.clip(base_colors(strokes.sh[rows]).astype(np.float64), 0, 1))
        return np.asarray(lab.mean(axis=0))


@dataclass(frozen=True, eq=False)
class Site:
    """Where a subject stands and how it is lit, before anything is painted.

    Attributes:
        place: where the subject stands.
        ground: of the scene itself, or None.
        points: [n, 3] local, of a sample of at most about 40,000 of the scene's Gaussians.
        weights: [n] the paint of each; 0 for those of a ground.
        lab: [n, 3] their OKLab.
        follows_light: whether the lamp is estimated from shadows in the scene.
    """

    place: Place
    ground: Ground | None
    points: F64
    weights: F64
    lab: F64
    follows_light: bool = False

    @property
    def towards(self) -> F64:
        """[3] unit vector toward the lamp, world axes."""
        return np.asarray(self.place.lamp @ self.place.axes)


def find_site(gaussians: Gaussians, first_view: FirstView, towards: F64 | None = None) -> Site:
    """Find the place of a scene, and its lamp.

    Args:
        gaussians: the scene, N >= 1 Gaussians, which cast the shadow.
        first_view: for the up axis and the usual lamp.
        towards: [3] unit vector toward the lamp, world axes; None estimates it from shadows in the scene, or
            takes the usual lamp.
    """
    right, down, away = camera_axes(first_view.up, first_view.azimuth, 0.0)
    axes = np.stack([right, -down, away])
    lamp = lamp_direction() if towards is None else above_ground(axes @ towards)
    found = _core.find_site(**gaussians.columns(), axes=axes, lamp=lamp, oklab=OKLAB)
    place, own, points, weights, lab = found
    site = Site(Place(*place), None, points.reshape(-1, 3), weights, lab.reshape(-1, 3))
    if own is None:
        return site
    _, coverage, colors, tone, extent = own
    square = _core.GROUND_SIDE, _core.GROUND_SIDE
    ground = Ground(site.place, coverage.reshape(square), colors.reshape(3, *square), tone, extent)
    site = replace(site, ground=ground)
    seen = found_lamp(site, ground) if towards is None else None
    if seen is None:
        return site
    return replace(site, place=site.place._replace(lamp=seen), follows_light=True)


def open_stage(
    site: Site,
    strokes: Gaussians,
    cameras: Sequence[Camera],
    tone: "StageTone | tuple[F64, F64]" = "auto",
    suns: Sequence[F64] = (),
    *,
    values: float = 0.0,
) -> Stage:
    """The stage of a scene.

    Args:
        site: where it stands.
        strokes: of the scene, in their painted colors, which the tones contrast with.
        cameras: of the job, at least one; the stage encloses them.
        tone: see `choose_tones`.
        suns: [3] unit vectors toward the lamp at other times of a day, world axes.
        values: see `choose_tones`.
    """
    place, ground = site.place, site.ground
    subject = strokes if ground is None else strokes.take(~ground.is_on(place.local(strokes.means)))
    farthest = max(float(np.hypot(*place.local(c.position[None])[0, [0, 2]])) for c in cameras)
    surface = surface_around(place, farthest, ground)
    outline = outline_of(subject, cameras, place, surface, ground)
    own_tone = None if ground is None else ground.tone
    tones = choose_tones(mean_lab(subject), outline, tone, ground=own_tone, values=values)
    places = [place, *(place._replace(lamp=above_ground(place.axes @ sun)) for sun in suns)]
    shadow, *others = (cast_shadow(site.points, site.weights, site.lab, one) for one in places)
    return Stage(place, ground, surface, shadow, tones, site.follows_light, tuple(others))


# Estimate the light of a scene from the shadows on its ground.
#
# Shadows are predicted for many lamps and compared with the darkness of the ground. A lamp is accepted if one
# direction explains it well, and the others do not.


SIDE, REACH = 64, 1.6  # cells of a map, and half its side in radii
_MOST_CASTERS = 3000  # of the objects that cast the shadow
AZIMUTHS = np.arange(0, 360, 20)  # degrees, from right to away
ELEVATIONS = np.array([30.0, 45.0, 62.0])  # degrees
BLUR = 0.06  # of shadows, in radii
FREE, INSIDE = 0.3, 0.7  # maximum shade of free ground, and minimum coverage inside it
FEWEST, EVEN = 60, 0.02  # minimum number of compared cells, and minimum OKLab deviation of a visible shadow
# Minimum correlation of an accepted shadow with the darkness of the ground, and its minimum lead over the
# best shadow 75 degrees or more away: under a truck it is always dark.
CORRELATION, MARGIN = 0.45, 0.15


def found_lamp(site: Site, ground: Ground) -> F64 | None:
    """[3] unit vector toward the light, local; None if shadows on the ground of a site do not show it."""
    weights = site.weights
    rows = np.flatnonzero(weights > 0)
    if len(rows) == 0:
        return None
    rows = rows[:: max(len(rows) // _MOST_CASTERS, 1)]
    place, points = site.place, site.points[rows]
    grid = Grid(SIDE, REACH * place.radius)
    paint = weights[rows] * (weights.sum() / weights[rows].sum())
    axis = (np.arange(SIDE) + 0.5) * grid.cell - grid.half
    cells = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=2).reshape(-1, 2)
    coverage, lab = ground.at(cells)
    standing = _shade(grid, points[:, [0, 2]], paint, place).ravel()
    free = (coverage > INSIDE) & (standing < FREE)
    if free.sum() < FEWEST:
        return None
    dark = -lab[free, 0]
    if dark.std() < EVEN:
        return None
    lamps = [_lamp(float(azimuth), float(elevation)) for azimuth in AZIMUTHS for elevation in ELEVATIONS]
    fits = np.array(
        [
            _correlation(
                dark, _shade(grid, place._replace(lamp=lamp).cast(points), paint, place).ravel()[free]
            )
            for lamp in lamps
        ]
    ).reshape(len(AZIMUTHS), len(ELEVATIONS))
    best = np.unravel_index(fits.argmax(), fits.shape)
    is_aside = np.cos(np.radians(AZIMUTHS - AZIMUTHS[best[0]])) < 0.3
    if fits[best] < CORRELATION or fits[best] - fits[is_aside].max() < MARGIN:
        return None
    return lamps[int(fits.argmax())]


def _lamp(azimuth: float, elevation: float) -> F64:
    """[3] a unit vector at angles in degrees, local."""
    turn, rise = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(turn) * np.cos(rise), np.sin(rise), np.sin(turn) * np.cos(rise)])


def _shade(grid: Grid, level: F64, paint: F64, place: Place) -> F64:
    """[SIDE, SIDE] share of the light that paint at level points [n, 2] blocks, 0 to 1."""
    density = blurred(grid.sums(level, paint) / grid.cell**2, BLUR * place.radius / grid.cell)
    return np.asarray(1 - np.exp(-density))


def _correlation(a: F64, b: F64) -> float:
    """Correlation of two columns; 0 if one is constant."""
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-12 else 0.0
