"""Write frames as a video: .mp4, .mov, .webm, .mkv or .gif, see `table.py`.

The file appears when it is complete.
"""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import chain
from pathlib import Path

from brushgs.formats.files import replacing
from brushgs.formats.pictures.encoding import Encoding, choose_encoding, codec_of, frame_rate, video_format_of
from brushgs.formats.pictures.libav import OF_QUICKTIME, Film, VideoWriter, as_scene_error
from brushgs.formats.pictures.oiio import Background, video_pixels
from brushgs.formats.pictures.panorama import mark_video
from brushgs.formats.registry import VIDEO_SUFFIXES, function_of
from brushgs.values.arrays import Array
from brushgs.values.colors import rgb_of
from brushgs.values.frame import Frame
from brushgs.values.shot import Panorama


def check_rate(path: Path, fps: float) -> None:
    """Refuse a frame rate that the video format cannot hold.

    Raises ValueError if it is not in (0, 1000], or above 50 for a GIF.
    """
    most = video_format_of(path).max_fps
    if not 0 < fps <= most:
        raise ValueError(f"fps must be above 0 and at most {most} for {path.suffix}, got {fps:g}")


def check_size(path: Path, width: int, height: int, codec: str | None = None) -> None:
    """Refuse a frame size that the codec (None: the default of the suffix) does not support.

    Raises ValueError if a side is above 16384 pixels for H.264, or below 16 or above 8192 for H.265.
    """
    offer = codec_of(path, codec)
    rule = f"at least {offer.min_side}" if min(width, height) < offer.min_side else ""
    if offer.max_side is not None and max(width, height) > offer.max_side:
        rule = f"at most {offer.max_side}"
    if rule:
        fact = f"pictures in {path.suffix} with {offer.name} must be {rule} pixels wide and high"
        raise ValueError(f"{fact}, got {width}x{height}; use .webm or numbered frames")


def padded_size(path: Path, width: int, height: int, codec: str | None = None) -> tuple[int, int]:
    """Width and height of a video whose frames have this size.

    H.264 and H.265 subsample chroma by 2 x 2 and need even sides: of an odd side the last column or row is
    repeated once. The other codecs allow any size.
    """
    if not codec_of(path, codec).has_even_sides:
        return width, height
    return width + width % 2, height + height % 2


def save_video(
    frames: Iterable[Frame],
    path: str | Path,
    *,
    fps: float = 24.0,
    background: Sequence[float] | Array | str | None = (1.0, 1.0, 1.0),
    loops: bool = False,
    codec: str | None = None,
    bits: int | None = None,
) -> None:
    """Write frames, such as those of `brushgs.render_sequence`, to a video.

    The file appears when it is complete. Frames are taken one at a time.

    Args:
        frames: at least one, all of one size.
        path: the suffix decides the format: .mp4, .mov, .webm, .mkv or .gif, see `open_video`.
        fps: frames per second, above 0.
        background: color behind the strokes, see `Frame.over`; None or "transparent" stores straight alpha,
            which ProRes (.mov) and VP9 (.webm) support.
        loops: whether a GIF repeats.
        codec: "h264" or "h265" (.mp4, .mov, .mkv), "prores" (.mov), "vp9" (.webm); None for the default of
            the suffix.
        bits: per channel, 8 or 10; None for the default of the codec.

    Raises:
        ValueError: if there is no frame, sizes differ, or an option or the suffix is out of range.
        SceneError: if the file cannot be written.

    Example:
        >>> cameras = bg.orbit(gaussians, 12, width=160, height=120)
        >>> frames = bg.render_sequence(strokes, cameras, "flat")
        >>> bg.save_video(frames, "turn.mp4", fps=12, background="toned")
    """
    path, rest = Path(path), iter(frames)
    if path.suffix.lower() not in VIDEO_SUFFIXES:
        raise ValueError(f"save_video: path must end in {', '.join(VIDEO_SUFFIXES)}, got {str(path)!r}")
    behind: Background = None if isinstance(background, str) else background
    if isinstance(background, str):
        behind = None if background.lower() == "transparent" else rgb_of(background)
    encoding = choose_encoding(path, codec=codec, bits=bits, transparent=behind is None)
    first = next(rest, None)
    if first is None:
        raise ValueError("save_video: frames must hold at least one, got none")
    height, width = first.alpha.shape
    with open_video(path, encoding, width=width, height=height, fps=fps, loops=loops) as video:
        for frame in chain([first], rest):
            if frame.alpha.shape != (height, width):
                size = f"{frame.alpha.shape[1]}x{frame.alpha.shape[0]}"
                raise ValueError(f"save_video: frames must have one size, got {width}x{height} and {size}")
            video.add(video_pixels(frame, behind, encoding.bits))


@contextmanager
def open_video(
    path: str | Path,
    encoding: Encoding,
    *,
    width: int,
    height: int,
    fps: float,
    loops: bool = False,
    panorama: Panorama | None = None,
) -> Iterator[VideoWriter]:
    """Write a video; the file appears when the block ends without an error, else no file remains.

    By default .mp4 and .mkv are H.264 at crf 18.2, .webm is VP9, .mov ProRes 4444. All but ProRes have 4:2:0
    chroma; colors are converted to BT.709 in limited range, and tagged so. A GIF has one palette of 255
    colors, computed from all frames, and an ordered dither, which does not flicker in still areas.

    Args:
        path: see `save_video`, also for `fps` and `loops`.
        encoding: of `choose_encoding` for the path. The writer takes frames from `video_pixels`.
        width: of the frames, pixels; see `padded_size`.
        height: of the frames, pixels.
        fps: at most 50 for a GIF, whose delays are rounded to 1/100 s.
        loops: only for GIF; other formats leave it to players.
        panorama: tags for players of spherical or stereo video; .gif has none, .mkv and .webm only stereo.

    Raises:
        ValueError: if the suffix, `fps`, the size or another option is not supported.
        SceneError: if the file cannot be written.
    """
    path, codec = Path(path), encoding.codec
    check_rate(path, fps)
    check_size(path, width, height, codec)
    open_writer = function_of(codec_of(path, codec).write)
    rate, size = frame_rate(fps), padded_size(path, width, height, codec)
    with replacing(path) as temporary, as_scene_error(path), ExitStack() as stack:
        eyes, row = None if panorama is None else panorama.eyes, video_format_of(path)
        film = Film(temporary, codec or row.codecs[0], row.container, size, rate, encoding, loops, eyes)
        writer: VideoWriter = open_writer(stack, film)
        yield writer
        writer.finish()
        if panorama is not None and film.container in OF_QUICKTIME:
            mark_video(temporary, panorama)
