"""One moment of a moving scene, read as a still scene is."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import exists, is_dir
from brushgs.formats.moving.frames import Frames, find_frames
from brushgs.formats.moving.open_formula import open_formula
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

LEAST_OPACITY = 1e-3  # of a Gaussian between the moments that are stored; fainter ones are not there then
ROUNDED = 1e-3  # seconds: reports print the end of a scene so
_NEARLY = 0.02  # of the time between two files: what is typed as 0.033 s is the file at 1/30 s
_CURE = "choose another moment (--time)"


def open_moment(source: SceneSource, encoding: Encoding) -> SceneFile | None:
    """The moment that a source names, as a scene file; None for a still scene.

    A moment that a file holds is that file, so that all that is said of it is said of the file.

    Args:
        source: of a moving scene; the moment is the first if it names none.
        encoding: what the numbers mean.

    Raises:
        SceneError: if the scene is a still one and a moment is named, the moment lies after the end or is
            without Gaussians, or a file cannot be read; or if a rate of moments is given for a still one.
    """
    path, time = source.paths[0], source.time
    moving = open_formula(source)
    if moving is not None:
        if time is not None and time.is_all:
            raise SceneError(path, "is one file that moves, not a file a moment; name a moment in seconds")
        return _made(moving, path, _seconds(time, moving.duration, path))
    clip = find_frames(source, encoding)
    if clip is not None:
        return _of_clip(clip, _seconds(time, clip.duration, path))
    if time is not None and not time.is_all and exists(path):
        raise SceneError(path, f"{_at_rest(source)}, which has no moments; omit the time (--time)")
    if source.moments_per_second is not None and exists(path):
        cure = "omit their rate (--moments-per-second)"
        if time is not None:
            cure = f"{cure} or --time all"
        elif len(source.paths) > 1 or is_dir(path):
            cure = f"{cure}, or call files that are moments frame_0, frame_1 and so on"
        raise SceneError(path, f"{_at_rest(source)}, which has no moments; {cure}")
    return None


def _at_rest(source: SceneSource) -> str:
    return "is a scene at rest" if len(source.paths) == 1 else "and the others are one scene at rest"


def _seconds(time: Moment | None, duration: float, path: Path) -> float:
    if time is None:
        return 0.0
    seconds = time.seconds(duration)
    if seconds > duration + ROUNDED:
        raise SceneError(path, f"lasts {duration:.4g} s, and {time} is after its end; {_CURE}")
    return min(seconds, duration)


def _of_clip(clip: Frames, time: float) -> SceneFile:
    """A file of a clip, or what lies between two."""
    position = clip.position(time)
    if abs(position - round(position)) > _NEARLY and clip.has_rows:
        made = _made(clip.scene(), clip.paths[int(position)], time)
        return replace(made, has_fixed_encoding=clip.encoding.is_standard)  # any other is decoded already
    index = clip.nearest(time)
    file = clip.file(index)
    if file is None:
        raise SceneError(clip.paths[index], f"holds no Gaussians; {_CURE}")
    words = _in_words(float(clip.times[index]), clip.duration)
    return replace(file, format=f"{file.format}, {words}", moment=time)


def _made(moving: MovingScene, path: Path, time: float) -> SceneFile:
    """The Gaussians of a moment that no file holds, in the guise of a file."""
    notes = moving.notes
    assert notes is not None, "a moving scene of a file has notes"
    gaussians = moving.at(time)
    gaussians = gaussians.take(gaussians.opacities >= LEAST_OPACITY)
    if len(gaussians) == 0:
        raise SceneError(path, f"holds no Gaussians {time:.3g} s after its start; {_CURE}")

    def read_columns(*, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
        return _columns(gaussians, is_raw=is_raw), Dropped(num_broken=notes.rows_dropped)

    return SceneFile(
        path=path,
        format=f"{notes.format}, {_in_words(time, moving.duration)}",
        num_rows=len(gaussians) + notes.rows_dropped,
        num_terms=gaussians.sh.shape[1],
        read_columns=read_columns,
        up=notes.up,
        is_strokes=notes.is_strokes,
        training=notes.training,
        unknown=notes.unknown,
        scene=notes.scene,
        first_view=notes.first_view,
        brushes=notes.brushes,
        moment=time,
    )


def _in_words(time: float, duration: float) -> str:
    return f"moment {time:.2f} s of {duration:.2f} s"


def _columns(gaussians: Gaussians, *, is_raw: bool) -> Columns:
    """Columns of their own, which may be written to."""
    columns = Columns.empty(len(gaussians), gaussians.sh.shape[1])
    for name, column in gaussians.columns().items():
        getattr(columns, name)[...] = column
    columns.brushes = None if gaussians.brushes is None else gaussians.brushes.copy()
    if is_raw:
        with np.errstate(divide="ignore"):
            np.log(columns.scales, out=columns.scales)
            columns.opacities[:] = np.log(columns.opacities) - np.log1p(-columns.opacities)
    return columns
