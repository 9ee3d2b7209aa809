"""Rigs: several cameras in place of one, for spherical and stereo pictures.

A rig replaces the camera of a frame by one for each eye and, for spherical pictures, by those of the faces of
a cube around each. All use the same renderer. Stroke directions are those of the camera between the eyes, so
no stroke flips between them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from brushgs.options.projection import ProjectionConfig
from brushgs.rendering.canonical import directions_of
from brushgs.rendering.wanted import NOTHING, Following, Wanted
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.shot import Panorama

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.project import Directions

WIDER = 1.5  # factor on the sides of the view for directions: eyes see more than the camera between them


@dataclass(frozen=True)
class Rig:
    """The cameras of one frame.

    Attributes:
        projection: see `ProjectionConfig`.
        ipd: distance between the eyes, world units; 0 for one eye.
    """

    projection: ProjectionConfig
    ipd: float = 0.0

    def size_of(self, camera: Camera) -> tuple[int, int]:
        """(width, height) of the whole picture of frames of this camera, pixels."""
        return self.projection.whole_size(camera.width, camera.height)

    @property
    def panorama(self) -> Panorama:
        """Projection and stereo layout of the picture, for players."""
        stereo = self.projection.stereo
        degrees: Literal[360, 180] | None = 180 if stereo == "vr180" else 360 if stereo is None else None
        return Panorama(degrees, "side" if stereo == "vr180" else stereo)

    def eyes(self, camera: Camera) -> list[Camera]:
        """The cameras of the eyes, left first: parallel, shifted by half of `ipd` to each side."""
        if self.projection.stereo is None:
            return [camera]
        return [moved_aside(camera, side * self.ipd) for side in (-0.5, 0.5)]

    def guides(self, camera: Camera) -> list[Camera]:
        """The views that strokes are made for."""
        if not self.projection.is_spherical:
            return [camera]
        from brushgs.rendering.sphere import GUIDE_MARGIN, sphere_of

        return sphere_of(self.projection, camera).faces(camera, GUIDE_MARGIN)

    def beside(self, pictures: Sequence[Array]) -> Array:
        """Join the pictures [H, W, ...] of all eyes."""
        return np.concatenate(pictures, axis=0 if self.projection.stereo == "top" else 1)

    def frame(
        self,
        painting: "Painting",
        camera: Camera,
        directions: "Sequence[Directions | None]" = (),
        *,
        wanted: Wanted = NOTHING,
    ) -> Frame:
        """Paint the frame of a camera with all eyes; arguments as for `Painting.frame`."""
        alone = replace(painting, rig=None)
        if self.projection.is_spherical:
            from brushgs.rendering.sphere import sphere_of

            sphere = sphere_of(self.projection, camera)
            frames = sphere.frames(alone, camera, self.eyes(camera), wanted)
        else:
            locked = directions_between(alone.coats, camera, directions)
            frames = [
                alone.frame(eye, locked, wanted=self._seen_by(number, wanted))
                for number, eye in enumerate(self.eyes(camera))
            ]
        return frames[0] if len(frames) == 1 else self._joined(frames)

    def _seen_by(self, number: int, wanted: Wanted) -> Wanted:
        """The requested outputs of one eye, with the next frame as seen by that eye."""
        following = wanted.following
        if following is None:
            return wanted
        locked = directions_between(following.coats, following.camera, following.directions)
        eye = self.eyes(following.camera)[number]
        return replace(wanted, following=Following(following.coats, eye, locked, following.sign))

    def _joined(self, frames: Sequence[Frame]) -> Frame:
        planes = {
            name: None
            if getattr(frames[0], name) is None
            else self.beside([getattr(f, name) for f in frames])
            for name in ("rgb", "alpha", "depth", "height")
        }
        layers = {name: self.beside([f.layers[name] for f in frames]) for name in frames[0].layers}  # type: ignore[misc]
        return Frame(**planes, layers=layers)  # type: ignore[arg-type]


def moved_aside(camera: Camera, right: float) -> Camera:
    """The camera shifted along its right axis, world units."""
    viewmat = camera.viewmat.copy()
    viewmat[0, 3] -= right
    return replace(camera, viewmat=viewmat)


def directions_between(
    coats: "Sequence[Coat]", camera: Camera, directions: "Sequence[Directions | None]" = ()
) -> "tuple[Directions | None, ...]":
    """Stroke directions of coats in the view of a camera, for the eyes beside it; given ones are kept."""
    given = [*directions, *[None] * (len(coats) - len(directions))]
    return tuple(
        _seen_from(coat, camera) if one is None else one for coat, one in zip(coats, given, strict=True)
    )


def _seen_from(coat: "Coat", camera: Camera) -> "Directions | None":
    """Directions in the view of a camera; for strokes outside its picture, those in a wider picture."""
    found = directions_of(coat.strokes, camera, coat.options, coat.fields)
    wide = directions_of(coat.strokes, wider(camera), coat.options, coat.fields)
    if found is None or wide is None:
        return None
    return replace(found, angles=np.where(found.angles == 0, wide.angles, found.angles))


def wider(camera: Camera) -> Camera:
    """A camera whose picture extends that of `camera` on all sides."""
    width, height = (round(WIDER * side) for side in (camera.width, camera.height))
    K = camera.K.copy()
    K[:2, 2] += 0.5 * (width - camera.width), 0.5 * (height - camera.height)
    return replace(camera, K=K, width=width, height=height)
