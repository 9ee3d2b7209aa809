"""Stages in the manner of paintings: strokes take colors and directions from maps of painted surroundings.

A map is wrapped around the subject: its rows extend from the foot of the subject to the top of the job's
pictures, as seen in the views. The table takes about the same share of the map's height as of a picture's, so
that sky and land of a painting keep their shares. Columns go around the axis, repeated so often that marks
keep their shape. A map turns with the camera like the stage.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.passes.add.stage_place import Place
from brushgs.passes.add.stage_surface import Spots, Surface
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of

if TYPE_CHECKING:
    from brushgs.passes.style.transport import FlatColors
    from brushgs.values.style import MarkDictionary, StyleStage

TABLE = 0.3, 0.65  # least and largest share of a map's height that lies on the table
COVE = 0.3  # share of the way from table to wall that still counts as table
LEAST_SIZE = 0.6  # share of the table's radius: closer to the axis, columns stop getting narrower
MOST_STRETCH = 1.5  # maximum lengthening of strokes that run away from the eye and look foreshortened
AROUND = 3.0  # cells of a map: standard deviation of the window in which calmness is measured
LOOSE = 0.08  # radians: standard deviation of directions


@dataclass(frozen=True, eq=False)
class Part:
    """The map of one style, and how much of it a stage takes.

    Attributes:
        stage: the map.
        color: share of its colors, 0 to 1.
        direction: share of its directions, 0 to 1.
        marks: of the painting; None if unknown.
        inks: the colors of a print; None for a painting.
    """

    stage: "StyleStage"
    color: float
    direction: float
    marks: "MarkDictionary | None" = None
    inks: "FlatColors | None" = None


@dataclass(frozen=True, eq=False)
class Manner:
    """How the surroundings of a subject are painted in paintings.

    Attributes:
        parts: the maps.
        size: of marks, root of length times width, in shorter sides of the picture.
        aspect: length over width.
        marks: share of size and aspect that strokes take, 0 to 1.
        jitter: standard deviations of OKLab lightness, and of a and b, from mark to mark.
    """

    parts: Sequence[Part]
    size: float
    aspect: float
    marks: float
    jitter: tuple[float, float]

    @property
    def color(self) -> float:
        """The share of colors that comes from maps."""
        return float(min(sum(part.color for part in self.parts), 1.0))


class Layout(NamedTuple):
    """The position of a map on a stage.

    [steps] height in the map along the profile, from 0 at the foot to 1 at the top of the pictures, mirrored
    above; number of repetitions around the axis; [steps] length of one map height in world units, along the
    profile and around the axis.
    """

    heights: F64
    repeats: int
    upward: F64
    around: F64


def layout_of(surface: Surface, place: Place, cameras: Sequence[Camera], aspect: float) -> Layout:
    """The layout of a map of this aspect, width over height, on a stage seen by these cameras."""
    eyes = np.stack([place.local(camera.position[None])[0] for camera in cameras])
    away, eye = float(np.median(np.hypot(eyes[:, 0], eyes[:, 2]))), float(np.median(eyes[:, 1]))
    borders = np.array([_borders(camera, place) for camera in cameras])
    bottom, top = borders[:, 0].mean(), borders[:, 1].max()
    angles = np.arctan2(surface.height - eye, away + surface.rho)
    reach = surface.table + COVE * (surface.wall - surface.table)
    edge = float(np.interp(reach, surface.rho, np.maximum.accumulate(angles)))
    span = max(top - edge, 0.1)
    share = float(np.clip((edge - bottom) / (edge - bottom + span), *TABLE))
    on_table = share * np.minimum(surface.length / np.interp(reach, surface.rho, surface.length), 1)
    places = on_table + (1 - share) * np.maximum(np.maximum.accumulate(angles) - edge, 0) / span
    radius = np.maximum(surface.rho, LEAST_SIZE * surface.table)
    # Apparent width of one map height at the wall.
    wide = span / (1 - share) * np.hypot(away + surface.wall, surface.height[-1] * 0.25)
    repeats = max(round(2 * np.pi * surface.wall / (aspect * wide)), 1)
    upward = np.gradient(surface.length) / np.maximum(np.gradient(places), 1e-6)
    around = 2 * np.pi * radius / (repeats * aspect)
    return Layout(1 - np.abs((places % 2) - 1), repeats, upward, around)


def _borders(camera: Camera, place: Place) -> tuple[float, float]:
    """Elevation of the lower and the upper border of a picture, radians."""
    y = (np.array([camera.height, 0]) - camera.K[1, 2]) / camera.K[1, 1]
    rays = np.stack([np.zeros(2), y, np.ones(2)], axis=1) @ camera.viewmat[:3, :3] @ place.axes.T
    bottom, top = np.arctan2(rays[:, 1], np.hypot(rays[:, 0], rays[:, 2])).tolist()
    return bottom, top


class Places(NamedTuple):
    """Places in a map: [n] columns in turns of it, and [n] rows from 0 at its top to 1 at its foot."""

    columns: F64
    rows: F64


def places_on(layout: Layout, surface: Surface, spots: Spots) -> Places:
    """The places in a map that lie at spots of a stage."""
    rows = 1 - np.interp(spots.along, surface.length, layout.heights)
    return Places(-spots.around * layout.repeats / (2 * np.pi), rows)


def map_colors(manner: Manner, places: Places, own: F64) -> F64:
    """[n, 3] OKLab colors of the maps by their shares, and of `own` [n, 3] for the rest."""
    found = (1 - manner.color) * own
    for part in manner.parts:
        own_colors = _sampled(oklab_field(part.stage), places)
        found += part.color * (own_colors if part.inks is None else part.inks.flat(own_colors))
    return found


def map_contrasts(manner: Manner, places: Places) -> F64:
    """[n] factor on the color differences from mark to mark, 0 to 1: small where maps are calm."""
    found, total = np.zeros(len(places.rows)), 0.0
    for part in manner.parts:
        factors = _sampled(_contrasts(part)[..., None], places)[:, 0]
        found, total = found + part.color * factors, total + part.color
    return found / total if total > 0 else np.ones(len(found))


def _contrasts(part: Part) -> F64:
    """[h, w] contrast of marks over its mean, at most 1: least where the map is calmest."""
    from scipy.ndimage import gaussian_filter

    light = oklab_field(part.stage)[..., 0]
    if part.marks is None:
        return np.ones_like(light)
    modes = "nearest", "wrap"
    fine = light - gaussian_filter(light, AROUND, mode=modes)
    energy = gaussian_filter(fine**2, AROUND, mode=modes)
    ranks = np.argsort(np.argsort(energy, axis=None)).reshape(energy.shape) / energy.size
    return np.minimum(part.marks.factors_at(ranks), 1)


def oklab_field(stage: "StyleStage") -> F64:
    """[h, w, 3] the colors of a map, OKLab."""
    rgb = stage.colors.astype(np.float64)
    return np.asarray(oklab_of(rgb.reshape(-1, 3)).reshape(rgb.shape))


def map_directions(
    manner: Manner, layout: Layout, surface: Surface, spots: Spots, along: F64, frames: tuple[F64, F64]
) -> tuple[F64, F64]:
    """[n, 3] local axes of strokes, and [n] their lengthening, turned toward the directions of the maps.

    Args:
        manner: of the stage.
        layout: of its maps.
        surface: of the stage.
        spots: positions of strokes.
        along: [n, 3] their axes without maps.
        frames: [n, 3] unit vectors around the axis, and up along the profile.
    """
    around, rise = frames
    angles, clear = map_angles(manner, places_on(layout, surface, spots), spots.noise[:, 6])
    ratio = np.interp(spots.along, surface.length, layout.upward / layout.around)
    across, up = np.cos(angles), -np.sin(angles) * np.clip(ratio, 1 / MOST_STRETCH, MOST_STRETCH)
    lengths = np.hypot(across, up)
    wanted = (-across[:, None] * around + up[:, None] * rise) / lengths[:, None]
    wanted *= np.where((wanted * along).sum(axis=1, keepdims=True) < 0, -1, 1)
    mixed = clear * wanted + (1 - clear) * along
    norms = np.linalg.norm(mixed, axis=1, keepdims=True)
    stretch = 1 + clear[:, 0] * (np.maximum(lengths, 1) - 1)
    return np.where(norms > 1e-6, mixed / np.maximum(norms, 1e-6), along), stretch


def map_angles(manner: Manner, places: Places, noise: F64) -> tuple[F64, F64]:
    """[n] directions of the maps, radians from right to down, and [n, 1] how clear they are, 0 to 1."""
    pairs = np.zeros((len(places.rows), 2))
    for part in manner.parts:
        pairs += part.direction * _sampled(part.stage.directions.astype(np.float64), places)
    angles = 0.5 * np.arctan2(pairs[:, 1], pairs[:, 0]) + LOOSE * noise
    return angles, np.clip(2 * np.hypot(pairs[:, 0], pairs[:, 1]), 0, 1)[:, None]


def _sampled(field: F64, places: Places) -> F64:
    """[n, k] a field [h, w, k] of a map at places."""
    from scipy.ndimage import map_coordinates

    height, width = field.shape[:2]
    v = places.rows * (height - 1)
    u = (places.columns % 1) * width
    closed = np.concatenate([field, field[:, :1]], axis=1)
    return np.stack(
        [map_coordinates(closed[..., k], [v, u], order=1) for k in range(field.shape[-1])], axis=1
    )
