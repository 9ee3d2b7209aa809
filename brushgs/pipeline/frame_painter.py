"""The painter of single frames of a sequence: picklable, so that it runs in any process of any machine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.formats.registry import holds_depth
from brushgs.options.output import OutputConfig
from brushgs.pipeline.background import Background, cut_background
from brushgs.rendering.project import Directions
from brushgs.rendering.wanted import Following, Wanted
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.shot import Origin, Shot

if TYPE_CHECKING:
    from brushgs.formats.pictures.oiio import Pixels
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.growing import GrowingPainting
    from brushgs.rendering.hand import Hand
    from brushgs.rendering.motion import Pose
    from brushgs.values.boxes import Boxes


@dataclass(frozen=True, eq=False)
class FrameView:
    """One frame to paint: all data that differ between frames.

    Attributes:
        index: number of the frame on the path, from 0.
        camera: the view.
        directions: of the strokes of each coat, None for a coat without tracking; of a growing painting also
            those of strokes that are painted over.
        time: of a painting that grows, 0 to 1.
        hour: share of a day that has passed, 0 to 1; None for a fixed light.
        pose: the positions of moving strokes; None if nothing moves.
        into: the content that the frame cross-fades into; None without a fade.
        share: progress of the cross-fade, 0 to 1.
        following: the next frame, for the layer of motion; None if that is not requested.
        sign: -1 if `following` is the previous frame: then its motion is continued.
        held: for a film made by hand, the frames whose drawings are held in this one, by index.
    """

    index: int
    camera: Camera
    directions: tuple[Directions | None, ...] = ()
    time: float = 1.0
    hour: float | None = None
    pose: "Pose | None" = None
    into: "FrameView | None" = None
    share: float = 0.0
    following: "FrameView | None" = None
    sign: int = 1
    held: "Mapping[int, FrameView]" = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class FrameKind:
    """The output form of a frame.

    Attributes:
        suffix: one of `PICTURE_SUFFIXES` for the bytes of such a file, None for pixels of a video.
        output: bits and layers; the bits of a video are given.
        fps: frames a second, for files that store it; None if not known.
        manifest: see `Shot`.
        origin: see `Shot`.
    """

    suffix: str | None
    output: OutputConfig = field(default_factory=OutputConfig)
    fps: float | None = None
    manifest: PurePath | None = None
    origin: Origin | None = None

    @property
    def has_depth(self) -> bool:
        """Whether its files hold the depth of the picture."""
        return self.suffix is not None and holds_depth(f"a{self.suffix}")


@dataclass(frozen=True, eq=False)
class FramePainter:
    """Paints the frames; it holds all data common to them, and is sent to each process once.

    Attributes:
        painting: coats of strokes and their ground; `num_threads` of their options are those of one process.
        background: behind the painting, see `open_background`; None keeps pictures transparent.
        kind: output form of frames.
        growth: how the painting grows; None if it is finished in all frames.
        fade: the time in which a stroke appears, see `GrowingPainting.at`.
        takes_light: see `Moving`.
        hand: how far the film is made by hand; None for a steady one.
    """

    painting: "Painting"
    background: Background
    kind: FrameKind
    growth: "GrowingPainting | None" = None
    fade: float = 0.0
    takes_light: bool = True
    hand: "Hand | None" = None

    def frame(self, view: FrameView) -> Frame:
        """Paint the frame, with depth if its file holds it, and the requested layers."""
        output = self.kind.output
        start = view if self.hand is None else view.held.get(self.hand.starts(view.index)[0], view)
        painting = self._painting(start).with_depth(self.kind.has_depth)
        following = None
        if view.following is not None:
            other = view.following
            coats = self._painting(other).coats
            following = Following(coats, other.camera, self._directions(other, coats), view.sign)
        wanted = Wanted(output.all_layers, output.deep, following)
        boxes = None if self.hand is None else self._by_hand(self.hand, view, painting)
        directions = self._directions(view, painting.coats)
        frame = painting.frame(view.camera, directions, boxes=boxes, wanted=wanted)
        return frame if view.into is None else _faded(frame, self.frame(view.into), view.share)

    @property
    def _behind(self) -> Background:
        """The background of the frame's pixels."""
        return cut_background(self.background, self.painting.part)

    def _by_hand(self, hand: "Hand", view: FrameView, painting: "Painting") -> "Callable[[Coat], Boxes]":
        """The boxes of each coat of a frame that is made by hand."""
        from brushgs.rendering.hand import Seen

        @cache
        def coats_at(index: int) -> "Mapping[str, Seen]":
            at = view.held.get(index, view)
            coats = self._painting(at).coats
            found = zip(coats, self._directions(at, coats), strict=True)
            return {coat.name: Seen(coat, at.camera, of_coat) for coat, of_coat in found}

        def boxes(coat: "Coat") -> "Boxes":
            return hand.boxes(view.index, lambda index: coats_at(index)[coat.name])

        return boxes

    def _directions(self, view: FrameView, coats: "Sequence[Coat]") -> tuple[Directions | None, ...]:
        """The directions in a frame for the strokes of these coats, which may be a subset of all."""
        names = (coat.name for coat in self.painting.coats)
        known = dict(zip(names, view.directions, strict=False))
        found = ((known.get(coat.name), len(coat.strokes)) for coat in coats)
        return tuple(None if one is None else one.first(num) for one, num in found)

    def _painting(self, view: FrameView) -> "Painting":
        """The painting at the time of a frame."""
        painting = self.painting if self.growth is None else self.growth.at(view.time, self.fade)
        if painting.day is not None and view.hour is not None:
            painting = painting.day.over(painting, view.hour)
        if view.pose is not None:
            painting = painting.posed(view.pose, takes_light=self.takes_light)
        return painting

    def __call__(self, view: FrameView) -> "bytes | Pixels":
        """The content of the finished picture file, or the pixels of a video, see `video_pixels`.

        Pictures are encoded here, in the painting processes, to share that work too.
        """
        frame, kind = self.frame(view), self.kind
        if kind.suffix is None:
            from brushgs.formats.pictures.oiio import video_pixels

            return video_pixels(frame, self._behind, kind.output.bits or 8)
        from brushgs.formats.pictures.images import encode_frame

        painting, rig = self.painting, self.painting.rig
        shot = Shot(
            view.camera if rig is None else None,
            view.index,
            kind.fps,
            kind.manifest,
            kind.origin,
            dpi=painting.dpi,
            part=painting.part,
            panorama=None if rig is None else rig.panorama,
        )
        bits, space = kind.output.bits, kind.output.colorspace
        return encode_frame(frame, kind.suffix, self._behind, bits=bits, colorspace=space, shot=shot)


def _faded(frame: Frame, into: Frame, share: float) -> Frame:
    """A cross-fade of two frames."""
    mixed: dict[str, Any] = {}
    for name in ("rgb", "alpha", "depth", "height"):
        from_, to = getattr(frame, name), getattr(into, name)
        mixed[name] = None if from_ is None or to is None else from_ + np.float32(share) * (to - from_)
    return replace(frame, **mixed)
