"""Open moving scenes stored in one file, and read one moment of any moving scene as a still scene."""

import warnings
from collections.abc import Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import exists, is_dir, is_plain
from brushgs.formats.format import NUM_FIRST_BYTES, Format
from brushgs.formats.moving.frames import Frames, find_frames
from brushgs.formats.registry import SCENE_FORMATS, added, formats_of, function_of
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.formats.scenes.stored import Stored
from brushgs.options.moment import Moment
from brushgs.options.scene_source import SceneSource
from brushgs.values.moving import MovingScene

_NUM_INSPECTED = 16  # of the paths: a clip of 100,000 files is not opened file by file


def open_formula(source: SceneSource) -> MovingScene | None:
    """Open a moving scene stored in one file. None for a still scene, or one stored as one file per moment.

    Raises SceneError if the format is not read, an option does not suit it, or the file is damaged.
    """
    seen = ((path, find_moving(path)) for path in source.paths[:_NUM_INSPECTED])
    path, row = next((pair for pair in seen if pair[1] is not None), (source.paths[0], None))
    if row is None:
        _warn_of_networks(source.paths)
        return None
    rated = "one file that moves, not numbered moments; omit their rate (--moments-per-second)"
    faults = (
        (row.read is None, row.cure),
        (len(source.paths) > 1, "which moves by itself; name it alone"),
        (source.lod is not None, "which has no levels of detail; omit the level (lod)"),
        (source.moments_per_second is not None, rated),
    )
    for is_so, fault in faults:
        if is_so:
            raise SceneError(path, f"is a {row.name}, {fault}")
    open_moving = function_of(row.read)
    # Values beyond float32 become infinite and NaN stays NaN: the readers drop both.
    with np.errstate(all="ignore"):
        moving: MovingScene = open_moving(path)
    return moving


def find_moving(path: Path) -> Format | None:
    """The moving-scene format of a path, including formats that are recognized but not read; None otherwise.

    Also None for a missing or unreadable file, which the reader of still scenes reports. Formats of other
    packages are tried last, and only for files that are no known still scene.
    """
    begin = b""
    if is_plain(path):
        with suppress(OSError), path.open("rb", buffering=0) as file:
            begin = file.read(NUM_FIRST_BYTES)
    if not begin and not is_dir(path):
        return None
    own = next((row for row in formats_of("clip") if row.matches(path, begin)), None)
    if own is not None or not begin or any(row.matches(path, begin) for row in SCENE_FORMATS):
        return own
    return next((row for row in added("clip") if row.matches(path, begin)), None)


def _warn_of_networks(paths: Sequence[Path]) -> None:
    """Warn if Gaussians lie beside a deformation network: without it they are no moment of the clip."""
    for path in paths[:_NUM_INSPECTED]:
        if path.name == "point_cloud.ply" and is_plain(path.with_name("deformation.pth")):
            what = "are moved by the network beside them (deformation.pth), and show no moment without it"
            cure = f"name the folder {path.parent} for what to do"
            warnings.warn(SceneWarning(f"{path}: its Gaussians {what}; {cure}"), stacklevel=4)


LEAST_OPACITY = 1e-3  # Gaussians of a computed moment that are fainter are dropped
ROUNDED = 1e-3  # seconds: rounding of the duration in reports
_NEARLY = 0.02  # share of the time between two files: 0.033 s typed by a user means the file at 1/30 s
_CURE = "choose another moment (--time)"


def open_moment(source: SceneSource, encoding: Encoding) -> SceneFile | None:
    """The moment that a source names, as a scene file; None for a still scene.

    For a moment stored in a file of its own, the result is that file, so messages name it.

    Args:
        source: the scene; without a time, its first moment is read.
        encoding: what the stored numbers mean.

    Raises:
        SceneError: if a time or a rate is given for a still scene, the moment lies after the end or holds no
            Gaussians, or a file cannot be read.
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
    """A file of a clip, or the Gaussians interpolated between two."""
    position = clip.position(time)
    if abs(position - round(position)) > _NEARLY and clip.has_rows:
        made = _made(clip.scene(), clip.series.paths[int(position)], time)
        return replace(made, has_fixed_encoding=clip.encoding.is_standard)  # others are already decoded
    index = clip.nearest(time)
    if (file := clip.file(index)) is None:
        raise SceneError(clip.series.paths[index], f"holds no Gaussians; {_CURE}")
    words = _in_words(float(clip.times[index]), clip.duration)
    return replace(file, format=f"{file.format}, {words}", moment=time)


def _made(moving: MovingScene, path: Path, time: float) -> SceneFile:
    """A computed moment, wrapped as a scene file."""
    notes = moving.notes
    assert notes is not None, "a moving scene of a file has notes"
    gaussians = moving.at(time)
    gaussians = gaussians.take(gaussians.opacities >= LEAST_OPACITY)
    if len(gaussians) == 0:
        raise SceneError(path, f"holds no Gaussians {time:.3g} s after its start; {_CURE}")

    def decode(start: int, stop: int, out: Columns) -> None:
        for name, column in gaussians.columns().items():
            getattr(out, name)[...] = column[start:stop]
        if out.brushes is not None and gaussians.brushes is not None:
            out.brushes[:] = gaussians.brushes[start:stop]

    num_rows, num_terms = len(gaussians), gaussians.sh.shape[1]
    rows = RowSource(
        num_rows,
        num_terms,
        lambda: nullcontext(decode),
        num_rows,
        encoding=Encoding(scales="linear"),
        has_brushes=gaussians.brushes is not None,
        count_used=lambda: num_terms,
        is_active=True,
        num_dropped=notes.rows_dropped,
    )
    name = f"{notes.format}, {_in_words(time, moving.duration)}"
    return SceneFile(
        path,
        name,
        num_rows + notes.rows_dropped,
        num_terms,
        open_rows=lambda encoding=STANDARD: rows,  # other encodings are already decoded
        up=notes.up,
        training=notes.training,
        unknown=notes.unknown,
        stored=Stored(notes.scene, notes.first_view, notes.brushes, is_strokes=notes.is_strokes),
        moment=time,
    )


def _in_words(time: float, duration: float) -> str:
    return f"moment {time:.2f} s of {duration:.2f} s"
