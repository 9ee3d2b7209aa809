"""The stages of a sequence in order, each timed.

    stroke (-> palette) -> load -> path (-> background) -> prune -> cluster (-> recolor)
        -> track -> paint -> write

The directions of all strokes are followed along the whole path before any frame is drawn; after that every
frame stands alone, so frames are painted in any number of processes, or only where they are missing, and are
the same files, bit for bit.
"""

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.errors import SceneWarning
from brushgs.io.pictures.numbered import Manifest, NumberedFiles
from brushgs.io.pictures.video import check_rate, check_size, filming, padded_size
from brushgs.options.painting import DrawConfig, PaintConfig
from brushgs.options.sequence import PathConfig, SequenceConfig
from brushgs.painting.frame_painter import Painter, Shot
from brushgs.painting.identity import check_same, find_manifest, painting
from brushgs.painting.outputs import check_target, plan_output
from brushgs.painting.parallel import spread
from brushgs.painting.parallel.connection import check_scheduler
from brushgs.painting.prepare import Prepared, prepare
from brushgs.painting.report import Report, Stage
from brushgs.painting.stages import NOTHING_SEEN, size_words

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.rendering.track import Track

NUM_LOOKS = 8  # views in which is looked whether any stroke is seen: a path of thousands needs no more


def paint_sequence(
    scene: str | Path,
    output: str | Path,
    path_config: PathConfig,
    config: PaintConfig | None = None,
    sequence: SequenceConfig | None = None,
    *,
    report: Report | None = None,
) -> Report:
    """Paint a scene file along a camera path.

    Args:
        scene: a trained 3D Gaussian scene.
        output: a video (.mp4, .webm, .gif), a pattern of numbered pictures such as frames/%05d.png (.png,
            .tif, .exr; the last folder is made), or a folder, which means %05d.png in it.
        path_config: where the camera goes.
        config: see `PaintConfig`; of its view what `plan_path` takes.
        sequence: where the frames are painted, and which.
        report: where the stages are told; a new one if None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written, or the frames that are to be gone on with are of
            another painting.
        ValueError: if an option does not suit the scene, the path or the output.
        KeyboardInterrupt: if the run is stopped; says how to go on. Frames are whole or not there.
    """
    config, sequence, report = config or PaintConfig(), sequence or SequenceConfig(), report or Report()
    target = plan_output(output, is_resumed=sequence.is_resumed)
    check_target(target, scene, path_config, config)
    if sequence.scheduler is not None:
        check_scheduler(sequence.scheduler)
    found = None
    if sequence.is_resumed and isinstance(target, NumberedFiles):
        found = find_manifest(target, config)

    def check_path(path: "CameraPath") -> None:
        if isinstance(target, Path):
            check_rate(target, path.fps)
            check_size(target, path.cameras[0].width, path.cameras[0].height)

    prepared = prepare(scene, config, report, views=path_config, check_path=check_path)
    track = _track(prepared, config.draw, report)
    work = _Work(prepared, config, track, sequence)
    if isinstance(target, Path):
        _paint_video(work, target, report)
        report.output = str(target)
    else:
        _paint_files(work, target, found, report)
        report.output = str(target.pattern)
    return report


def _track(prepared: Prepared, draw: DrawConfig, report: Report) -> "Track | None":
    """The directions of the strokes along the whole path, where they are tracked."""
    with report.stage("track") as stage:
        strokes, cameras, texture = prepared.strokes, prepared.cameras, prepared.texture
        lock = draw.lock_of(along_path=True)
        stage.counts = {"lock": lock, "strokes": len(strokes), "frames": len(cameras)}
        if not _sees_any(prepared):
            warnings.warn(SceneWarning(NOTHING_SEEN), stacklevel=2)
        if prepared.options.lock != "track":
            stage.did = "nothing"
            reason = f"{texture.name!r} has none" if lock == "track" else f"the lock is {lock!r}"
            stage.skipped.append(f"following directions: {reason}")
            return None
        from brushgs.rendering.track import track_directions

        assert prepared.path is not None
        track = track_directions(strokes, prepared.path.closed, num_threads=draw.threads)
        stage.did = f"directions of {len(strokes):,} strokes over {len(cameras):,} views"
    return track


def _sees_any(prepared: Prepared) -> bool:
    """Whether a stroke is seen from any of some views of the path."""
    from brushgs.rendering.options import project_with

    options, step = prepared.options.in_direction("off"), -(-len(prepared.cameras) // NUM_LOOKS)
    seen = (project_with(prepared.strokes, camera, options)[0] for camera in prepared.cameras[::step])
    return any(len(boxes) for boxes in seen)


@dataclass(frozen=True, eq=False)
class _Work:
    """All that is known when the first frame is painted."""

    prepared: Prepared
    config: PaintConfig
    track: "Track | None"
    sequence: SequenceConfig

    @property
    def path(self) -> "CameraPath":
        """The path of the camera."""
        assert self.prepared.path is not None
        return self.prepared.path

    def painter(self, suffix: str | None) -> Painter:
        """What paints the frames."""
        prepared = self.prepared
        return Painter(prepared.strokes, prepared.texture, prepared.background, prepared.options, suffix)

    def shot(self, index: int) -> Shot:
        """One frame of the path."""
        directions = None if self.track is None else self.track.directions(index)
        return Shot(index, self.path.cameras[index], directions)

    def view(self, index: int) -> tuple[object, ...]:
        """All that sets one frame of the path apart: where it is equal, so is the picture, bit for bit."""
        camera = self.path.cameras[index]
        place = None if self.track is None else float(self.track.positions[index])
        lens = camera.K.tobytes(), camera.width, camera.height, camera.near
        return camera.viewmat.tobytes(), *lens, place


def _paint(
    work: _Work,
    indices: Sequence[int],
    suffix: str | None,
    take: Callable[[int, Any], None],
    report: Report,
) -> float:
    """Paint frames and hand each, in order, to `take`; the seconds that took are given back.

    While the camera rests one picture serves all its frames.
    """
    with report.stage("paint", frames=len(indices)) as stage:
        start, taking = time.perf_counter(), 0.0
        sequence = work.sequence
        rests = [list(same) for _, same in groupby(indices, key=work.view)]
        shots = (work.shot(rest[0]) for rest in rests)
        frames: Any = spread(work.painter(suffix), shots, jobs=sequence.jobs, scheduler=sequence.scheduler)
        with closing(frames):
            for rest, frame in zip(rests, frames, strict=True):
                for index in rest:
                    began = time.perf_counter()
                    take(index, frame)
                    taking += time.perf_counter() - began
                    report.advance()
        stage.seconds = -taking  # told as the stage that follows
        num_repeated = len(indices) - len(rests)
        _tell_painted(stage, work, len(rests), num_repeated, time.perf_counter() - start - taking, report)
    return taking


def _tell_painted(
    stage: Stage, work: _Work, num_painted: int, num_repeated: int, seconds: float, report: Report
) -> None:
    """How many frames were painted, and what one costs."""
    sequence, num_frames = work.sequence, len(work.path.cameras)
    stage.counts = {
        "frames": num_frames,
        "painted": num_painted,
        "repeated": num_repeated,
        "skipped": num_frames - num_painted - num_repeated,
        "jobs": sequence.jobs,
        "scheduler": sequence.scheduler,
    }
    stage.did = f"{num_painted:,} of {num_frames:,} frames"
    if skipped := num_frames - num_painted - num_repeated:
        stage.skipped.append(f"{skipped:,} frames: they are there, whole")
    if num_repeated:
        stage.skipped.append(f"{num_repeated:,} frames: the camera rests, they are those before them")
    if not num_painted:
        return
    per_frame = seconds / num_painted
    stage.did += f", {per_frame:.3f} s each"
    stage.counts["seconds_per_frame"] = round(per_frame, 6)
    if work.track is not None:
        tracking = next(earlier.seconds for earlier in reversed(report.stages) if earlier.name == "track")
        share = tracking / num_frames / per_frame
        stage.did += f"; tracking adds {share:.1%}"
        stage.counts["tracking_share"] = round(share, 4)
    if sequence.scheduler is not None:
        stage.did += f"; by the workers of {sequence.scheduler}"
    elif sequence.jobs > 1:
        stage.did += f"; in {sequence.jobs} processes"


def _paint_video(work: _Work, target: Path, report: Report) -> None:
    """All frames to a video file."""
    path, camera, ground = work.path, work.path.cameras[0], work.config.draw.background
    size = camera.width, camera.height
    film = filming(target, width=size[0], height=size[1], fps=path.fps, loops=path.is_loop)
    cure = f"no video was written; numbered frames, -o {target.with_suffix('')}/, can be gone on with"
    with _saying_when_stopped(lambda: cure), film as reel:
        taking = _paint(work, range(len(path.cameras)), None, lambda _, pixels: reel.add(pixels), report)
        with report.stage("write") as stage:
            stage.seconds = taking
            reel.finish()
    # Only now the file has its name, and its size.
    num_bytes, padded = target.stat().st_size, padded_size(target, *size)
    stage.did = f"{target}, {path.fps:g} frames a second, {size_words(num_bytes)}, on {ground}"
    if padded != size:
        stage.did += f"; {padded[0]}x{padded[1]}: the last row or column is doubled, for H.264 has even sides"
    stage.counts = {"path": str(target), "bytes": num_bytes, "width": padded[0], "height": padded[1]}
    stage.counts |= {"fps": path.fps, "background": ground}


def _paint_files(work: _Work, files: NumberedFiles, found: Manifest | None, report: Report) -> None:
    """The frames that are missing, each to a file."""
    prepared = work.prepared
    identity = painting(
        work.config, work.path, prepared.strokes, prepared.texture.coverage, prepared.background
    )
    if found is not None:
        check_same(found, identity)
    num_frames, ground = len(work.path.cameras), work.config.draw.background
    done = {} if found is None else {i: size for i, size in found.sizes.items() if found.is_done(i)}
    manifest = Manifest(files, identity, done)
    manifest.begin()
    missing = [index for index in range(num_frames) if index not in done]

    def state() -> str:
        return f"{len(manifest.sizes)} of {num_frames} frames are there, whole; go on with --resume"

    with _saying_when_stopped(state):
        taking = _paint(work, missing, files.pattern.suffix.lower(), manifest.add, report)
    with report.stage("write") as stage:
        stage.seconds = taking
        num_bytes = sum(manifest.sizes.values())
        stage.did = f"{files.pattern}, {num_frames:,} files, {size_words(num_bytes)}, on {ground}"
        stage.counts = {"path": str(files.pattern), "files": num_frames, "bytes": num_bytes}
        stage.counts["background"] = ground
        _warn_of_others(files, num_frames)


@contextmanager
def _saying_when_stopped(state: Callable[[], str]) -> Iterator[None]:
    """Say with Ctrl-C what is there, and how to go on."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(state()) from None


def _warn_of_others(files: NumberedFiles, num_frames: int) -> None:
    """Warn of frames of a longer sequence that was there before: a player would run on into them."""
    others = [number for number in files.numbers() if number >= num_frames]
    if others:
        first = files.path(others[0]).name
        sentence = f"{len(others)} files of an older sequence follow the last frame, from {first} on"
        warnings.warn(SceneWarning(f"{files.pattern}: {sentence}; remove them"), stacklevel=2)
