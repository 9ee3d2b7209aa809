"""Stroke directions over a film: one track, or where strokes move one for each of its runs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from brushgs.pipeline.clip import Run
from brushgs.pipeline.moving import Moving
from brushgs.rendering.canonical import Canonical
from brushgs.rendering.project import Directions
from brushgs.rendering.track import Track, track_directions
from brushgs.rendering.track_moving import MovingTrack, track_moving
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class FilmTrack:
    """The stroke directions of a coat in each frame of a film, a track for each of its runs.

    Attributes:
        runs: of the film.
        tracks: one per run.
    """

    runs: list[Run]
    tracks: list[MovingTrack]

    def directions(self, frame: int) -> Directions:
        """The directions in a frame."""
        track, place = self._place(frame, fading_in=False)
        return track.directions(place)

    def directions_into(self, frame: int) -> Directions:
        """The directions at the moment that a frame cross-fades into."""
        track, place = self._place(frame, fading_in=True)
        return track.directions(place)

    def place(self, frame: int) -> float:
        """The position of a frame among the knots of its run."""
        track, place = self._place(frame, fading_in=False)
        return float(track.positions[place])

    def _place(self, frame: int, *, fading_in: bool) -> tuple[MovingTrack, int]:
        for run, track in zip(self.runs, self.tracks, strict=True):
            split = run.num_fading
            among, skipped = (run.frames[:split], 0) if fading_in else (run.frames[split:], split)
            place = int(np.searchsorted(among, frame))
            if place < len(among) and among[place] == frame:
                return track, place + skipped
        raise IndexError(f"directions: there is no frame {frame}")


def track_strokes(
    strokes: Gaussians,
    cameras: Sequence[Camera],
    moving: Moving | None,
    *,
    fields: Canonical | None = None,
    is_loop: bool,
    low_pass: float,
    num_threads: int | None,
) -> Track | FilmTrack:
    """Choose the stroke directions of a coat over a film.

    Args:
        strokes: of the coat.
        cameras: one per frame; where nothing moves, a closed path ends with its first one again.
        moving: how the strokes move; None for a scene at rest.
        fields: toward which strokes of a scene at rest are pulled, see `track_directions`; or None.
        is_loop: whether the frame after the last is the first again, for both camera and moving scene.
        low_pass: with which the coat is projected.
        num_threads: None takes the processors available to this process.
    """
    if moving is None:
        return track_directions(strokes, cameras, fields=fields, low_pass=low_pass, num_threads=num_threads)
    runs, tracks = moving.film.runs(), []
    for run in runs:
        frames, times = run.frames, run.times
        if is_loop and len(runs) == 1 and not run.num_fading:  # it ends with a copy of its first frame
            frames, times = np.append(frames, frames[0]), np.append(times, times[0])
        tracks.append(
            track_moving(
                strokes,
                [cameras[frame] for frame in frames],
                moving.motion,
                moving.motion.positions(times),
                fps=moving.film.fps,
                low_pass=low_pass,
                num_threads=num_threads,
            )
        )
    return FilmTrack(runs, tracks)
