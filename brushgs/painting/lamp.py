"""The lamp of a job: where it stands in the scene, and how it shines on paint and canvas."""

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np

from brushgs.arrays import F64
from brushgs.options.look_parts import USUAL_LAMP, LightConfig
from brushgs.options.painting import PaintConfig
from brushgs.scene import Camera, FirstView, Gaussians

if TYPE_CHECKING:
    from brushgs.passes.stage import Site
    from brushgs.rendering.light import Lamp


def towards_lamp(light: LightConfig, first_view: FirstView, axes: F64) -> F64 | None:
    """[3] unit vector toward the lamp that options name, world axes; None for the usual one.

    Args:
        light: the options.
        first_view: whose up axis and front the angles of a sun are measured from.
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


def open_site(
    config: PaintConfig, gaussians: Gaussians, first_view: FirstView | None, camera: Camera | None
) -> "Site | None":
    """Where a scene stands and how it is lit; None where neither a stage nor its light is painted.

    Args:
        config: the options.
        gaussians: the scene, pruned.
        first_view: of it; None where that is not known.
        camera: the first view of the job; None without any.
    """
    is_needed = config.ground.stage or config.light.is_in_scene
    if not is_needed or first_view is None or camera is None or len(gaussians) == 0:
        return None
    from brushgs.passes.stage import find_site

    return find_site(gaussians, first_view, towards_lamp(config.light, first_view, camera.viewmat[:3, :3]))


def open_lamp(light: LightConfig, site: "Site | None") -> "Lamp | None":
    """The lamp of a look; None where pictures stay flat.

    It stands in the scene where it lights that, or where options place it and it throws a shadow there.
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
