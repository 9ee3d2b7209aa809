"""From a scene file to a video or numbered pictures, along a path or of a painting that grows.

The stages are those of `prepare`, then track -> paint -> write. The directions of a stroke along the whole
path, and the time when it appears, are decided before any frame is painted. After that frames are
independent: any number of processes paint the same files, bit for bit, and missing frames can be painted
alone.
"""

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from itertools import groupby
from math import degrees, radians
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.cameras.motion import view_changes
from brushgs.errors import SceneWarning
from brushgs.formats.pictures.encoding import choose_encoding, codec_of
from brushgs.formats.pictures.metadata import metadata_text
from brushgs.formats.pictures.numbered import Manifest, NumberedFiles
from brushgs.formats.pictures.video import check_rate, check_size, open_video, padded_size
from brushgs.formats.registry import PICTURE_SUFFIXES
from brushgs.options.clip import ClipConfig
from brushgs.options.output import OutputConfig
from brushgs.options.painting import DrawConfig, PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.pipeline.background import TRANSPARENT
from brushgs.pipeline.clip import Clip, files_of
from brushgs.pipeline.drawing import why_nothing_is_seen
from brushgs.pipeline.film_track import track_strokes
from brushgs.pipeline.frame_painter import FrameKind
from brushgs.pipeline.hand import describe_hand
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.outputs import check_output, input_files
from brushgs.pipeline.parallel import parallel_map
from brushgs.pipeline.parallel.ahead import one_ahead
from brushgs.pipeline.parallel.connection import Waiting, check_scheduler
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report, Stage, Stopwatch
from brushgs.pipeline.resume import check_same_painting, describe_painting, read_manifest
from brushgs.pipeline.sequence_frames import GrowingTrack, SequenceFrames, with_earlier
from brushgs.pipeline.sequence_outputs import check_target, plan_output
from brushgs.pipeline.strokes import file_size, name_of
from brushgs.pipeline.views_sheet import write_sheet_of
from brushgs.rendering.knots import MOST_TURN, MOST_WIDE_TURN, WIDE_STEP
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.shot import Origin, Shot

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath
    from brushgs.pipeline.sequence_frames import AnyTrack
    from brushgs.rendering.coat import Coat

CALM_STEP = 10.0  # degrees the camera turns per frame, above which a note says that strokes turn visibly
FILM_FRAMES = 12  # fewer frames are viewed one by one
NUM_SAMPLED_VIEWS = 8  # of a path, to check whether any stroke is visible; enough for thousands of frames


def paint_sequence(
    scene: SceneFiles | Clip,
    output: str | Path,
    path_config: PathConfig | GrowConfig | Camera | None,
    config: PaintConfig | None = None,
    sequence: SequenceConfig | None = None,
    *,
    grow: GrowConfig | None = None,
    report: Report | None = None,
    sheet: str | Path | None = None,
    origin: Origin | None = None,
) -> Report:
    """Paint a scene file along a camera path, as it grows, or as it moves.

    Args:
        scene: the files of a trained 3D Gaussian scene, or a moving scene.
        output: a video (.mp4, .mov, .webm, .mkv, .gif), a pattern of numbered pictures such as
            frames/%05d.png (any picture format; the last folder is created), or a folder, which means
            %05d.png in it.
        path_config: the camera path, or how the painting grows before a fixed camera; for a moving scene
            also that camera, None for that of `config`.
        config: see `PaintConfig`; of its view the options that `plan_path` uses.
        sequence: which frames are painted, and where.
        grow: how the painting grows along a path; None if it does not.
        report: gets the stages; None makes a new one.
        sheet: output of a contact sheet of the plain scene, see `views_sheet`; or None.
        origin: metadata of the files, or None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written, or the frames to resume are of another painting.
        ValueError: if an option does not suit the scene, the path or the output, or no frame shows a stroke.
        KeyboardInterrupt: if the run is stopped; says how to resume it. Every written frame is complete.
    """
    config, sequence, report = config or PaintConfig(), sequence or SequenceConfig(), report or Report()
    grow = path_config if isinstance(path_config, GrowConfig) else grow
    clip = scene.config if isinstance(scene, Clip) else None
    files = files_of(scene)
    target = plan_output(output, is_resumed=sequence.is_resumed)
    check_target(target, files, _rate_of(path_config, clip), config)
    if sequence.scheduler is not None:
        check_scheduler(sequence.scheduler, Waiting(sequence.workers_timeout, report.tell))
    found = None
    if sequence.is_resumed and isinstance(target, NumberedFiles):
        found = read_manifest(target, config, grow, clip)
    asks: tuple[str, ...] = PICTURE if grow is None else (*PICTURE, "growth")
    if sheet is not None:
        check_output(Path(sheet), PICTURE_SUFFIXES, inputs=input_files(files, config))
        asks = (*asks, "first_view", "scene")
    prepared = prepare(
        scene,
        config,
        report,
        asks=asks,
        views=path_config,
        check_path=lambda path: _check_video(target, path, config),
        workers=sequence,
    )
    if sheet is not None:
        name = name_of(files, prepared.notes)
        write_sheet_of(prepared, Path(sheet), config, report, name=name, origin=origin)
    tracks = [] if isinstance(path_config, GrowConfig) else _track(prepared, config.draw, report)
    _check_seen(prepared)
    frames = SequenceFrames(prepared, config, tracks, sequence, grow, clip, origin)
    describe_hand(frames.hand, frames.small, report)
    if isinstance(target, Path):
        _paint_video(frames, target, report)
        report.output = str(target)
    else:
        _paint_files(frames, target, found, report)
        report.output = str(target.pattern)
    return report


def _rate_of(path_config: PathConfig | GrowConfig | Camera | None, clip: ClipConfig | None) -> float | None:
    """The frame rate of the options."""
    named = path_config if isinstance(path_config, PathConfig | GrowConfig) else clip
    return None if named is None else named.fps


def _check_video(target: Path | NumberedFiles, path: "CameraPath", config: PaintConfig) -> None:
    """Refuse a frame rate or size that does not suit a video."""
    if isinstance(target, Path):
        check_rate(target, path.fps)
        check_size(target, *_frame_size(path.cameras[0], config), config.output.codec)


def _frame_size(camera: Camera, config: PaintConfig) -> tuple[int, int]:
    """Width and height of the pictures of a film, of all eyes, pixels."""
    crop = config.output.crop
    return config.projection.whole_size(camera.width, camera.height) if crop is None else crop[2:]


def _check_seen(prepared: Prepared) -> None:
    """Refuse a path on which no frame shows a stroke."""
    if not _sees_any(prepared, NUM_SAMPLED_VIEWS) and not _sees_any(prepared, len(prepared.cameras)):
        why = why_nothing_is_seen(coat.strokes for coat in prepared.painting.coats if coat.name != BACKDROP)
        raise ValueError(f"in all {len(prepared.cameras)} frames {why}")


def paint_prepared(
    prepared: Prepared, target: Path, config: PaintConfig, report: Report, origin: Origin | None = None
) -> Report:
    """Paint a prepared scene along its path to a video.

    Args:
        prepared: with a path.
        target: the video to write.
        config: options of `prepared`.
        report: gets the stages; `advance` after each frame.
        origin: metadata of the video, or None.

    Raises:
        ValueError: if the rate or the size does not suit the video.
        SceneError: if it cannot be written.
    """
    assert prepared.path is not None, "prepare along a path"
    check_rate(target, prepared.path.fps)
    check_size(target, *_frame_size(prepared.camera, config), config.output.codec)
    frames = SequenceFrames(
        prepared, config, _track(prepared, config.draw, report), SequenceConfig(), origin=origin
    )
    describe_hand(frames.hand, frames.small, report)
    _paint_video(frames, target, report)
    report.output = str(target)
    return report


def _is_tracked(prepared: Prepared, lock: str) -> bool:
    """Whether one field serves the whole path: strokes that move have fields by moment, spheres by face."""
    rig = prepared.painting.rig
    is_flat = rig is None or not rig.projection.is_spherical
    return is_flat and (lock == "track" or (lock == "canonical" and prepared.moving is None))


def _track(prepared: Prepared, draw: DrawConfig, report: Report) -> "list[AnyTrack | GrowingTrack | None]":
    """Choose the stroke directions along the whole path, for each tracked coat."""
    with report.stage("track") as stage:
        cameras, coats = prepared.cameras, prepared.painting.coats
        lock = draw.lock_of(along_path=True)
        tracked = [coat for coat in coats if _is_tracked(prepared, lock) and coat.options.lock != "off"]
        num_strokes = sum(len(coat.strokes) for coat in tracked)
        stage.counts = {"lock": lock, "strokes": num_strokes, "frames": len(cameras)}
        if not tracked:
            stage.did = "nothing"
            of_name = f"{prepared.texture.name!r} has no direction"
            locks = [coat.options.lock for coat in coats if coat.texture.is_directed]
            stage.skipped.append(f"tracking: {f'the lock is {locks[0]!r}' if locks else of_name}")
            return [None] * len(coats)
        path, moving = prepared.path, prepared.moving
        assert path is not None

        def track(strokes: Gaussians, coat: "Coat") -> "AnyTrack":
            return track_strokes(
                strokes,
                path.closed if moving is None else cameras,
                moving,
                fields=coat.fields if strokes is coat.strokes else None,
                is_loop=path.is_loop,
                low_pass=coat.options.low_pass,
                num_threads=draw.threads,
            )

        shown = coats if prepared.growth is None else [one.coat for one in prepared.growth.coats]
        tracks = [
            with_earlier(more.strokes, partial(track, coat=coat), coat.strokes) if coat in tracked else None
            for coat, more in zip(coats, shown, strict=True)
        ]
        _note_coarse(path.closed)
        stage.did = f"directions of {num_strokes:,} strokes over {len(cameras):,} views"
    return tracks


def _note_coarse(cameras: Sequence[Camera]) -> None:
    """Add a note if the camera turns so far per frame that strokes turn visibly."""
    if len(cameras) < FILM_FRAMES:
        return
    viewmats = np.stack([camera.viewmat for camera in cameras])
    turns = view_changes(viewmats[:-1], viewmats[1:], np.inf)  # without the effect of shifts
    step = float(np.degrees(np.median(turns[turns > 0]))) if (turns > 0).any() else 0.0
    if step > CALM_STEP * (1 + 1e-6):
        most = degrees(MOST_TURN if radians(step) <= WIDE_STEP else MOST_WIDE_TURN)
        fact = f"the camera turns by {step:.3g} degrees a frame, and strokes by up to {most:.0f}"
        cure = f"{round(360 / CALM_STEP)} frames a turn or more are calmer"
        warnings.warn(SceneWarning(f"{fact}; {cure}"), stacklevel=2)


def _views(prepared: Prepared, index: int) -> Sequence[Camera]:
    """The views of a frame, as strokes are made for them."""
    rig, camera = prepared.painting.rig, prepared.cameras[index]
    return [camera] if rig is None else rig.guides(camera)


def _sees_any(prepared: Prepared, num_views: int) -> bool:
    """Whether a stroke is visible in any of `num_views` evenly spread views."""
    from brushgs.rendering.options import project_with

    step, moving = -(-len(prepared.cameras) // num_views), prepared.moving
    for coat in prepared.painting.coats:
        if coat.name == BACKDROP:
            continue
        options = replace(coat.options, lock="off", order="depth", fade=False)  # the fastest options
        for index in range(0, len(prepared.cameras), step):
            shown = coat if moving is None else coat.posed(moving.pose(index))
            if any(len(project_with(shown.strokes, view, options)[0]) for view in _views(prepared, index)):
                return True
    return False


def _paint(
    frames: SequenceFrames,
    indices: Sequence[int],
    kind: FrameKind,
    take: Callable[[int, Any], None],
    report: Report,
) -> Stopwatch:
    """Paint frames and pass each, in order, to `take`, which writes it.

    Equal frames are painted once. With a single process, the next frame is painted while `take` runs.

    Returns:
        The time of `take`, for the stage of writing.
    """
    sequence, writing, making, start = frames.sequence, Stopwatch(), Stopwatch(), time.perf_counter()
    with report.stage("paint", total=len(indices), apart=writing) as stage:
        rests = [list(same) for _, same in groupby(indices, key=frames.identity)]
        views = (frames.view(rest[0]) for rest in rests)
        painted: Any = parallel_map(
            frames.painter(kind),
            views,
            jobs=sequence.jobs,
            scheduler=sequence.scheduler,
            waiting=Waiting(sequence.workers_timeout, report.tell),
        )
        is_alone = sequence.jobs == 1 and sequence.scheduler is None
        with closing(one_ahead(painted, making) if is_alone else painted) as ready:
            for rest, frame in zip(rests, ready, strict=True):
                for index in rest:
                    with writing.running():
                        take(index, frame)
                    report.advance()
        seconds = making.seconds if is_alone else time.perf_counter() - start - writing.seconds
        _describe_painted(stage, frames, len(rests), len(indices) - len(rests), seconds, report)
    return writing


def _describe_painted(
    stage: Stage, frames: SequenceFrames, num_painted: int, num_repeated: int, seconds: float, report: Report
) -> None:
    """Report how many frames were painted, and the cost of one."""
    sequence, num_frames = frames.sequence, len(frames.path.cameras)
    num_skipped = num_frames - num_painted - num_repeated
    stage.counts = {
        "frames": num_frames,
        "painted": num_painted,
        "repeated": num_repeated,
        "skipped": num_skipped,
        "jobs": sequence.jobs,
        "scheduler": sequence.scheduler,
    }
    stage.did = f"{num_painted:,} of {num_frames:,} frames"
    if num_skipped:
        stage.skipped.append(f"{num_skipped:,} frames: they exist, whole")
    if num_repeated:
        why = (
            "the camera rests, they equal those before" if frames.grow is None else "the painting is finished"
        )
        if frames.clip is not None:
            why = "nothing moves, they equal those before"
        stage.skipped.append(f"{num_repeated:,} frames: {why}")
    if not num_painted:
        return
    per_frame = seconds / num_painted
    stage.did += f", {per_frame:.3f} s each"
    stage.counts["seconds_per_frame"] = round(per_frame, 6)
    if any(track is not None for track in frames.tracks):
        tracking = next(earlier.seconds for earlier in reversed(report.stages) if earlier.name == "track")
        share = tracking / num_frames / per_frame
        stage.details.append(f"tracking adds {share:.1%}")
        stage.counts["tracking_share"] = round(share, 4)
    if sequence.scheduler is not None:
        stage.did += f"; by the workers of {sequence.scheduler}"
    elif sequence.jobs > 1:
        stage.did += f"; in {sequence.jobs} processes"


def _paint_video(frames: SequenceFrames, target: Path, report: Report) -> None:
    """Paint all frames to a video file."""
    path, camera, background = frames.path, frames.path.cameras[0], frames.config.draw.background
    size, output, rig = _frame_size(camera, frames.config), frames.config.output, frames.prepared.painting.rig
    transparent = background.lower() == TRANSPARENT
    encoding = choose_encoding(target, codec=output.codec, bits=output.bits, transparent=transparent)
    film = open_video(
        target,
        encoding,
        width=size[0],
        height=size[1],
        fps=path.fps,
        loops=path.is_loop,
        panorama=None if rig is None else rig.panorama,
    )
    cure = f"no video was written; numbered frames, -o {target.with_suffix('')}/, can be resumed"
    with _interrupted_with(lambda: cure), film as reel:
        kind, indices = FrameKind(None, replace(output, bits=encoding.bits)), range(len(path.cameras))
        if text := metadata_text(Shot(camera if rig is None else None, origin=frames.origin)):
            reel.describe(text)
        writing = _paint(frames, indices, kind, lambda _, pixels: reel.add(pixels), report)
        with report.stage("write", earlier=writing) as stage:
            reel.finish()
    # Only now the file has its name and size.
    num_bytes, padded = target.stat().st_size, padded_size(target, *size, output.codec)
    codec = codec_of(target, output.codec).name
    stage.did = f"{target}, {path.fps:g} frames per second, {file_size(num_bytes)}, on {background}"
    if output != OutputConfig():
        stage.did += f"; {codec}, {encoding.bits} bit"
    if padded != size:
        stage.did += (
            f"; {padded[0]}x{padded[1]}: the last row or column is doubled, for {codec} has even sides"
        )
    stage.counts = {"path": str(target), "bytes": num_bytes, "width": padded[0], "height": padded[1]}
    stage.counts |= {"fps": path.fps, "background": background, "codec": codec, "bits": encoding.bits}


def _paint_files(
    frames: SequenceFrames, files: NumberedFiles, found: Manifest | None, report: Report
) -> None:
    """Paint the missing frames, each to a file."""
    painting = describe_painting(frames.config, frames.prepared, frames.grow, frames.clip)
    if found is not None:
        check_same_painting(found, painting)
    num_frames, background = len(frames.path.cameras), frames.config.draw.background
    done = {} if found is None else {i: size for i, size in found.sizes.items() if found.is_done(i)}
    manifest = Manifest(files, painting, done)
    manifest.begin()
    missing = [index for index in range(num_frames) if index not in done]

    def state() -> str:
        return f"{len(manifest.sizes)} of {num_frames} frames are done; add --resume to paint the rest"

    with _interrupted_with(state):
        writing = _paint(frames, missing, _kind_of(frames, files), manifest.add, report)
    with report.stage("write", earlier=writing) as stage:
        num_bytes = sum(manifest.sizes.values())
        stage.did = f"{files.pattern}, {num_frames:,} files, {file_size(num_bytes)}, on {background}"
        stage.counts = {"path": str(files.pattern), "files": num_frames, "bytes": num_bytes}
        stage.counts["background"] = background
        _warn_of_others(files, num_frames)


def _kind_of(frames: SequenceFrames, files: NumberedFiles) -> FrameKind:
    """The content of frame files; the names of strokes, if many, are written once beside them."""
    output, manifest = frames.config.output, None
    if output.deep or "stroke" in output.all_layers:
        from brushgs.formats.pictures.exr.cryptomatte import is_long, write_manifest
        from brushgs.rendering.mattes import stroke_names

        names = stroke_names(frames.prepared.painting.coats)
        if output.deep or is_long(names):
            manifest = files.named("strokes.json")
            write_manifest(manifest, names)
    name = None if manifest is None else PurePath(manifest.name)
    return FrameKind(files.pattern.suffix.lower(), output, frames.path.fps, name, frames.origin)


@contextmanager
def _interrupted_with(state: Callable[[], str]) -> Iterator[None]:
    """Let Ctrl-C report which frames are done, and how to resume."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(state()) from None


def _warn_of_others(files: NumberedFiles, num_frames: int) -> None:
    """Warn of frames of an older, longer sequence: a player would show them after the last frame."""
    others = [number for number in files.numbers() if number >= num_frames]
    if others:
        first = files.path(others[0]).name
        sentence = f"{len(others)} files of an older sequence follow the last frame, from {first} on"
        warnings.warn(SceneWarning(f"{files.pattern}: {sentence}; remove them"), stacklevel=2)
