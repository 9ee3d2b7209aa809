"""A prepared painting seen by other cameras, with the same strokes.

`prepare` for another camera makes other strokes if small views of the job guide them. A viewer that turns a
painting needs the same strokes: only data in the size of the picture are remade.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.painting import DrawConfig, PaintConfig
from brushgs.pipeline.drawing import open_picture_background
from brushgs.pipeline.look import open_surface, recolored_ground
from brushgs.pipeline.moving import Moving
from brushgs.pipeline.prepare import Prepared
from brushgs.pipeline.report import Report
from brushgs.pipeline.steps.seeing import canvas
from brushgs.rendering.coat import Coat
from brushgs.values.camera import Camera

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.pipeline.clip import Film


def seen_by(prepared: Prepared, config: PaintConfig, camera: Camera, report: Report) -> Prepared:
    """The same strokes, seen by one camera.

    Args:
        prepared: with its `scene`.
        config: options of `prepared`.
        camera: the view, in any size.
        report: gets the stages of data in the size of the picture.
    """
    background = open_picture_background(config.draw, camera, report)
    surface = open_surface(
        config.ground, canvas(config.light), config.draw.background, prepared.whole_scene, camera, report
    )
    for change in prepared.ground_changes:
        surface = recolored_ground(surface, change)
    painting = replace(prepared.painting, surface=surface)
    return replace(prepared, cameras=[camera], path=None, background=background, painting=painting)


def at_moment(prepared: Prepared, seconds: float) -> Prepared:
    """The same strokes at one moment of a moving scene, as a still; a still scene is unchanged.

    Args:
        prepared: of a painting without a path.
        seconds: of its film, from the start; later ones are the last moment.
    """
    moving = prepared.moving
    if moving is None:
        return prepared
    times = moving.film.times
    time = np.interp(seconds * moving.film.fps, np.arange(len(times)), times)
    pose = moving.motion.pose(float(moving.motion.positions(np.array([time]))[0]))
    painting = prepared.painting.posed(pose, takes_light=moving.takes_light)
    return replace(prepared, painting=painting, moving=None)


def along(
    prepared: Prepared,
    config: PaintConfig,
    path: "CameraPath",
    report: Report,
    film: "Film | None" = None,
) -> Prepared:
    """The same strokes along a path: with the lock, the order and the light of paths.

    Args:
        prepared: of a still, with its `scene`.
        config: options of `prepared`.
        path: its cameras.
        report: gets the stages of data in the size of the pictures.
        film: moments of the frames, of a moving scene.
    """
    seen = seen_by(prepared, config, path.cameras[0], report)
    coats = tuple(_along(coat, config.draw) for coat in seen.painting.coats)
    painting = replace(seen.painting, coats=coats, is_moving=True)
    moving = seen.moving
    if moving is not None and film is not None:
        moving = Moving.of(moving.scene, film, moving.motion, takes_light=moving.takes_light)
    return replace(seen, cameras=path.cameras, path=path, painting=painting, moving=moving)


def _along(coat: Coat, draw: DrawConfig) -> Coat:
    """A coat of a still along a path; a kernel has neither lock nor order, see `RenderOptions.of`."""
    if not coat.texture.is_directed:
        return coat
    lock, order = draw.lock_of(along_path=True), draw.order_of(along_path=True)
    fields = None if lock == "track" else coat.fields  # which a track would be pulled toward
    return replace(coat, options=replace(coat.options, lock=lock, order=order), fields=fields)
