"""The lamp of a job: where it stands in the scene, and how it shines on paint and canvas."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, degrees, sin
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.look_parts import USUAL_LAMP, LightConfig
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.runner import Memory, NoMemory
from brushgs.pipeline.stroke_pass import StrokePass
from brushgs.rendering.coat import Coat
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.add.stage import Site
    from brushgs.passes.color.key_light import KeyLight
    from brushgs.rendering.day import Day
    from brushgs.rendering.light import Lamp

SMALL = 240  # pixels, longer side of the views that show where strokes face
MOST_VIEWS = 8
INSIDE = 0.5  # strength of the light in a room, relative to an object: walls are flat and show every error
SUN_STEP = 3.0  # degrees of the sun's path between interpolated colors


@dataclass(frozen=True, eq=False)
class Key:
    """The light of a lamp on the strokes of a painting.

    Attributes:
        strength: 0 to 1.
        site: where the scene stands, and its lamp.
        cameras: a few small cameras that see the strokes.
        is_inside: whether the scene is seen from inside.
    """

    strength: float
    site: "Site"
    cameras: Sequence[Camera]
    is_inside: bool

    @classmethod
    def of(
        cls,
        light: LightConfig,
        site: "Site | None",
        cameras: Sequence[Camera],
        first_view: FirstView | None,
    ) -> "Key | None":
        """The key light of options, or None.

        Args:
            light: the options.
            site: where the scene stands; None if not known.
            cameras: of the job, or small ones of it.
            first_view: of the scene.
        """
        if light.key == 0 or site is None:
            return None
        from brushgs.passes.seen import some_small

        small = some_small(cameras, MOST_VIEWS, SMALL)
        is_inside = first_view is not None and first_view.eye is not None
        return cls(light.key * (INSIDE if is_inside else 1), site, small, is_inside)

    def on(self, strokes: Gaussians, memory: Memory | None = None) -> "KeyLight":
        """The strokes, ready for a lamp; a memory keeps their normals."""
        from brushgs.passes.color.key_light import KeyLight
        from brushgs.passes.color.key_normals import find_facing

        seen = replace(strokes, sh=strokes.sh[:, :1], brushes=None), tuple(self.cameras)
        facing = (memory or NoMemory()).of("normals", seen, lambda: find_facing(*seen))
        return KeyLight.of(strokes, self.cameras, self.site.place, is_inside=self.is_inside, facing=facing)

    def stroke_pass(self, *, skip: str | None, memory: Memory) -> StrokePass:
        """The pass that lights strokes; `skip` is the reason not to run."""

        def lit(strokes: Gaussians) -> Gaussians:
            return self.on(strokes, memory).lit(self.site.towards, self.strength)

        what = f"lit, warm in the light and cool in the shade, by {self.strength:g}"
        counts = {"strength": self.strength, "towards": [round(x, 3) for x in self.site.towards.tolist()]}
        return StrokePass("key", what, lit, skip, counts)


def check_sun(light: LightConfig, *, is_film: bool, is_moving: bool) -> None:
    """Refuse a moving sun, except in a film of a still scene.

    Raises:
        ValueError: saying what to do.
    """
    if not light.has_day:
        return
    if is_moving:
        raise ValueError("sun must stand still over a scene that moves; give one azimuth and elevation")
    if not is_film:
        raise ValueError(
            "sun passes over a film only; add --orbit or --path, or give one azimuth and elevation"
        )


def suns_of(light: LightConfig, first_view: FirstView | None) -> F64 | None:
    """[K, 3] unit vectors toward the suns of a day, evenly spread; None for a fixed light."""
    if light.sun is None or not light.has_day or first_view is None:
        return None
    from brushgs.cameras.framing import camera_axes

    start, end = np.array(light.sun[:2]), np.array(light.sun[2:])
    num = max(ceil(degrees(float(np.abs(end - start).max())) / SUN_STEP), 1) + 1
    suns = start + np.linspace(0, 1, num)[:, None] * (end - start)
    return np.stack([-camera_axes(first_view.up, azimuth, elevation)[2] for azimuth, elevation in suns])


def day_of(
    suns: F64, key: Key | None, strokes: Gaussians, coats: Sequence[Coat], of_backdrop: F32 | None
) -> "Day":
    """The light of a day on a painting.

    Args:
        suns: [K, 3] see `suns_of`.
        key: the light on the strokes; None if they keep theirs.
        strokes: k strokes, as made.
        coats: of the painting.
        of_backdrop: [K, n, 3] what each sun adds to the colors of the backdrop, RGB; or None.
    """
    from brushgs.rendering.day import Day

    shifts = {}
    if of_backdrop is not None:
        shifts[BACKDROP] = of_backdrop
    if key is not None:
        light = key.on(strokes)
        colors = np.stack([light.colors(sun, key.strength) for sun in suns])
        moves = (colors - colors[0]).astype(np.float32)
        own = (coat.name for coat in coats if coat.name != BACKDROP and len(coat.strokes) == len(strokes))
        shifts |= dict.fromkeys(own, moves)
    return Day(suns, shifts)


def towards_lamp(light: LightConfig, first_view: FirstView, axes: F64) -> F64 | None:
    """[3] unit vector toward the lamp of the options, world axes; None for the usual one.

    Args:
        light: the options.
        first_view: the angles of a sun are measured from its up axis and front.
        axes: [3, 3] rows right, down and ahead of the first view of the job.
    """
    if light.sun is not None:
        from brushgs.cameras.framing import camera_axes

        azimuth, elevation = light.sun[:2]
        return np.asarray(-camera_axes(first_view.up, azimuth, elevation)[2])
    if light.lamp is None:
        return None
    azimuth, elevation = light.lamp
    level = cos(elevation)
    return np.asarray((cos(azimuth) * level, sin(azimuth) * level, -sin(elevation)) @ axes)


def usual_light(first_view: FirstView) -> F64:
    """[3] direction toward the light of a picture without a lamp or sun of its own, world axes."""
    from brushgs.cameras.framing import camera_axes
    from brushgs.passes.add.stage_place import lamp_direction

    right, down, away = camera_axes(first_view.up, first_view.azimuth, 0.0)
    return np.asarray(lamp_direction() @ np.stack([right, -down, away]))


def open_lamp(light: LightConfig, site: "Site | None") -> "Lamp | None":
    """The lamp of a look; None if pictures stay flat.

    It is fixed in the scene if it lights the scene, or if options place it and it casts a shadow there.
    """
    if light.relief == 0:
        return None
    from brushgs.rendering.light import Lamp

    azimuth, elevation = light.lamp or USUAL_LAMP
    towards = None
    if site is not None and (light.is_in_scene or light.lamp is not None):
        x, y, z = site.towards.tolist()
        towards = x, y, z
    lamp = Lamp(azimuth, elevation, gloss=light.gloss, exponent=int(light.exponent), towards=towards)
    return lamp.at_relief(light.relief)
