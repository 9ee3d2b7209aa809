"""The configurations of the temporal report in a look: whole paintings, with ground, coats, light and stage.

Frames are those of `brushgs render`. Figures of boxes refer to the strokes of the scene: the largest tracked
coat except a backdrop.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from brushgs.measure.stability.painters import AlonePainter, StrokePainter
from brushgs.options.choices import Lock
from brushgs.pipeline.backdrop import with_cut_edges
from brushgs.pipeline.film_track import FilmTrack
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.prepare import Prepared
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.project import Directions
from brushgs.rendering.track import Track
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians


def is_bare(painting: Painting) -> bool:
    """Whether a painting is nothing but its strokes on a background."""
    first = painting.coats[0]
    is_alone = len(painting.coats) == 1 and first.plain is None and first.blend == "cover"
    return is_alone and painting.surface is None and painting.lamp is None and first.normals is None


def main_coat(painting: Painting) -> Coat:
    """The coat for figures of boxes, see the module; the first one if no coat is tracked."""
    others = [coat for coat in painting.coats if coat.name != BACKDROP]
    tracked = [coat for coat in others if coat.options.lock == "track"]
    return max(tracked, key=lambda coat: len(coat.strokes)) if tracked else others[0]


def behind(painting: Painting) -> Array | None:
    """[3] the mean color of a painting's ground, the background of the plain picture; or None."""
    if painting.surface is None or painting.is_transparent:
        return None
    return np.asarray(painting.surface.rgb.mean(axis=(0, 1), dtype=np.float64))


@dataclass
class LookPainter(StrokePainter):
    """Paints whole frames; its own strokes are those of the main coat.

    Attributes:
        painting: along the path, its coats with the lock of the configuration.
    """

    painting: Painting = field(kw_only=True)
    _tracks: list[Track | FilmTrack | None] | None = None

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; it does not depend on the plain picture."""
        directions = self._directions(index)
        camera, painting = self.cameras[index], self.painting
        if self.moving is not None:
            painting = painting.posed(self.moving.pose(index), takes_light=self.moving.takes_light)
        with self.timer.draw.running():
            frame = painting.frame(camera, directions)
        self.timer.frames += 1
        return frame

    def _directions(self, index: int) -> list[Directions | None]:
        """The directions of each tracked coat; chosen along the whole path at the first call."""
        if self._tracks is None:
            with self.timer.track.running():
                self._tracks = [
                    self._track_of(coat) if coat.options.lock == "track" else None
                    for coat in self.painting.coats
                ]
        return [None if track is None else track.directions(index) for track in self._tracks]

    def _tracked(self) -> Track | FilmTrack:
        """The track of the main coat."""
        self._directions(0)
        assert self._tracks is not None, "they were chosen now"
        coats = self.painting.coats
        return next(
            track
            for coat, track in zip(coats, self._tracks, strict=True)
            if coat.strokes is self.gaussians and track is not None
        )

    def _track_of(self, coat: Coat) -> Track | FilmTrack:
        return self._track_along(coat.strokes, coat.options.low_pass)


@dataclass
class AloneLookPainter(AlonePainter):
    """Paints each frame as a still, with strokes made of that moment alone."""

    prepare: Callable[[int], Prepared] = field(kw_only=True)  # the painting of a frame
    _last: tuple[int, Prepared] | None = None  # one at a time: each has a canvas

    def strokes_at(self, index: int) -> Gaussians:
        """The strokes of a frame."""
        if index not in self._made:
            self._made[index] = self._at(index).strokes
        return self._made[index]

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; it does not depend on the plain picture."""
        camera, prepared = self.cameras[index], self._at(index)
        with self.timer.draw.running():
            painting = with_cut_edges(prepared.painting.with_depth(False), camera, prepared.edges)
            frame = in_threads(painting, self.options.num_threads).frame(camera)
        self.timer.frames += 1
        return frame

    def _at(self, index: int) -> Prepared:
        if self._last is None or self._last[0] != index:
            self._last = index, self.prepare(index)
        return self._last[1]


def locked(painting: Painting, lock: Lock) -> Painting:
    """A painting with another lock for its tracked coats; other coats are unchanged."""
    coats = (
        replace(coat, options=replace(coat.options, lock=lock)) if coat.options.lock == "track" else coat
        for coat in painting.coats
    )
    return replace(painting, coats=tuple(coats))


def in_threads(painting: Painting, num_threads: int | None) -> Painting:
    """A painting drawn by `num_threads` threads."""
    coats = (replace(coat, options=replace(coat.options, num_threads=num_threads)) for coat in painting.coats)
    return replace(painting, coats=tuple(coats))
