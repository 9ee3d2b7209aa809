"""The frames of a film: what each shows, and which are equal."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.clip import ClipConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.sequence import GrowConfig, SequenceConfig
from brushgs.pipeline.backdrop import for_film, in_one_order
from brushgs.pipeline.film_track import FilmTrack
from brushgs.pipeline.frame_painter import FrameKind, FramePainter, FrameView
from brushgs.pipeline.hand import open_hand
from brushgs.pipeline.prepare import Prepared
from brushgs.values.arrays import Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.shot import Origin

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.growing import GrowingPainting
    from brushgs.rendering.hand import Hand
    from brushgs.rendering.project import Directions
    from brushgs.rendering.track import Track

    AnyTrack = Track | FilmTrack


@dataclass(frozen=True, eq=False)
class SequenceFrames:
    """The frames of a path, or of a painting that grows, ready to be painted."""

    prepared: Prepared
    config: PaintConfig
    tracks: "list[AnyTrack | GrowingTrack | None]"
    sequence: SequenceConfig
    grow: GrowConfig | None = None
    clip: ClipConfig | None = None
    origin: Origin | None = None

    @cached_property
    def hand(self) -> "Hand | None":
        """How far the film is made by hand."""
        growth = self.prepared.growth
        coats = self.prepared.painting.coats if growth is None else [one.coat for one in growth.coats]
        return open_hand(self.config, self.path, coats)

    @cached_property
    def growing(self) -> GrowConfig | None:
        """How the painting grows in this film; None if it does not."""
        if self.grow is None or not self.grow.is_along_path:
            return self.grow
        return self.grow.along(len(self.path.cameras), self.path.fps)

    @property
    def path(self) -> "CameraPath":
        """The path of the camera."""
        assert self.prepared.path is not None
        return self.prepared.path

    @cached_property
    def painting(self) -> "Painting":
        """The painting as this film shows it."""
        painting = self.prepared.painting
        return painting if self.hand is not None else for_film(painting, self.config, self.path.cameras)

    @cached_property
    def growth(self) -> "GrowingPainting | None":
        """How it grows; None if it does not."""
        growth = self.prepared.growth
        if growth is None or self.painting is self.prepared.painting:
            return growth
        coats = (replace(one, coat=in_one_order(one.coat, self.path.cameras)) for one in growth.coats)
        return replace(growth, finished=self.painting, coats=tuple(coats))

    def painter(self, kind: FrameKind) -> FramePainter:
        """The painter of every frame."""
        shown = self.prepared if kind.has_depth else self
        painting, growth, background = shown.painting, shown.growth, self.prepared.background
        fade = 0.0 if self.growing is None else self.growing.fade
        takes_light = self.prepared.moving is None or self.prepared.moving.takes_light
        return FramePainter(painting, background, kind, growth, fade, takes_light, self.hand)

    def small(self, side: int) -> Iterator[Array]:
        """The frames, small and flat, on the mean color of their background, painted on demand."""
        painting, background = self.painting, self.prepared.background
        behind = background if painting.surface is None else painting.surface.rgb
        color = np.asarray(1.0 if behind is None else behind).reshape(-1, 3).mean(axis=0)
        flat = replace(painting, surface=None, lamp=None, part=None, dpi=None)
        painter = replace(self.painter(FrameKind(None)), painting=flat, growth=None)
        for index in range(len(self.path.cameras)):
            view = self.view(index)
            held = {start: replace(one, camera=one.camera.in_side(side)) for start, one in view.held.items()}
            small = replace(view, camera=view.camera.in_side(side), held=held, into=None, following=None)
            yield painter.frame(small).over(color)

    def view(self, index: int) -> FrameView:
        """What is special to one frame."""
        index = self._shown(index)
        view = self._alone(index)
        if self.hand is not None:
            view = replace(view, held={other: self._alone(other) for other in self.hand.needed(index)})
        if not self._has_motion:
            return view
        other, sign = self._neighbour(index)
        return replace(view, following=self._alone(self._shown(other)), sign=sign)

    def _shown(self, index: int) -> int:
        """The number of the frame whose camera and scene a frame shows."""
        return index if self.hand is None else self.hand.shown(index)

    @property
    def _has_motion(self) -> bool:
        """Whether frames have a layer of motion: no paint moves while a painting grows."""
        return "motion" in self.config.output.all_layers and self.grow is None

    def _neighbour(self, index: int) -> tuple[int, int]:
        """The next frame, and 1; at the end of an open path the previous one, and -1."""
        num_frames = len(self.path.cameras)
        if index + 1 < num_frames:
            return index + 1, 1
        return (0, 1) if self.path.is_loop else (max(index - 1, 0), -1)

    def _alone(self, index: int) -> FrameView:
        """The same without its neighbour."""
        directions = tuple(None if track is None else track.directions(index) for track in self.tracks)
        view = FrameView(index, self.path.cameras[index], directions, self._time(index), self._hour(index))
        moving = self.prepared.moving
        if moving is None:
            return view
        view = replace(view, pose=moving.pose(index))
        share = float(moving.film.shares[index])
        if share == 0:
            return view
        others = (
            track.directions_into(index) if isinstance(track, FilmTrack) else None for track in self.tracks
        )
        into = replace(view, directions=tuple(others), pose=moving.pose_into(index))
        return replace(view, into=into, share=share)

    def identity(self, index: int) -> tuple[object, ...]:
        """Equal for frames whose pictures are equal, bit for bit: nothing moves between them."""
        index = self._shown(index)
        found = self._seen(index)
        if self._has_motion:
            other, sign = self._neighbour(index)
            found = *found, *self._seen(self._shown(other)), sign
        if self.hand is None:
            return found
        others = *self.hand.starts(index), *sorted(self.hand.needed(index))
        held = (part for other in others for part in self._seen(other))
        return *found, *held, self.hand.state(index)

    def _seen(self, index: int) -> tuple[object, ...]:
        """A key of everything that decides the colors of a frame."""
        camera = self.path.cameras[index]
        places = [_place(track, index) for track in self.tracks if track is not None]
        lens = camera.K.tobytes(), camera.width, camera.height, camera.near
        moving = self.prepared.moving
        moment = () if moving is None else moving.film.moment(index)
        return camera.viewmat.tobytes(), *lens, *places, self._time(index), self._hour(index), *moment

    def _hour(self, index: int) -> float | None:
        if self.prepared.painting.day is None:
            return None
        return index / max(len(self.path.cameras) - 1, 1)

    def _time(self, index: int) -> float:
        return 1.0 if self.growing is None else self.growing.time(index)


@dataclass(frozen=True, eq=False)
class GrowingTrack:
    """The track of a finished coat, unchanged, extended to the strokes that are painted over."""

    finished: "AnyTrack"
    earlier: "AnyTrack"

    def directions(self, index: int) -> "Directions":
        """The directions of a frame, as those of a track."""
        return self.finished.directions(index).followed_by(self.earlier.directions(index))


def with_earlier(
    strokes: Gaussians, track: "Callable[[Gaussians], AnyTrack]", finished: Gaussians
) -> "AnyTrack | GrowingTrack":
    """The track of a coat that may grow, whose strokes begin with those of the finished one."""
    if len(finished) == len(strokes):
        return track(finished)
    earlier = strokes.take(np.arange(len(finished), len(strokes)))
    return GrowingTrack(track(finished), track(earlier))


def _place(track: "AnyTrack | GrowingTrack", index: int) -> tuple[float, ...]:
    """The positions of a frame among the knots of its track."""
    if isinstance(track, GrowingTrack):
        return *_place(track.finished, index), *_place(track.earlier, index)
    return (track.place(index) if isinstance(track, FilmTrack) else float(track.positions[index]),)
