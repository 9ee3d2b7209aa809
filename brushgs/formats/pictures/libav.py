"""Videos and AVIF: frames go through filters into an encoder, with libav (PyAV).

Equal frames give equal bytes on every machine: encoders run in a fixed number of threads, and no time of day,
random number or version of the writer is written.

For pixels of more than 8 bits RGB becomes luma and chroma here, by BT.709 in limited range: libav's scaler
rounds those up, so that luma came out one or two levels of ten bits too bright, and alpha one too opaque.
Source: ITU-R BT.709-6, items 3.2 to 3.5.
"""

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from brushgs.core.signals import defer_stop
from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.pictures.encoding import Encoding
from brushgs.formats.pictures.oiio import Background, Pixels, video_pixels
from brushgs.formats.pictures.panorama import MATROSKA_MODES
from brushgs.values.arrays import F32
from brushgs.values.frame import Frame

_RED, _GREEN, _BLUE = 0.2126, 0.7152, 0.0722
_FROM_RGB = np.array(
    [
        (_RED, _GREEN, _BLUE),
        (-_RED / 1.8556, -_GREEN / 1.8556, (1 - _BLUE) / 1.8556),
        ((1 - _RED) / 1.5748, -_GREEN / 1.5748, -_BLUE / 1.5748),
    ],
    np.float32,
)


def planes_of(pixels: Pixels, bits: int, *, halves_chroma: bool) -> list[Pixels]:
    """Luma, two planes of chroma, and alpha where there is one.

    Args:
        pixels: [H, W, 3 or 4] over the full range of their type.
        bits: of a sample, 9 to 16; as limited range: 10 bits of luma are 64 to 940. Alpha has the full range.
        halves_chroma: whether chroma has a sample for each 2 x 2 pixels, their mean; sides must be even then.
    """
    values = pixels * np.float32(1 / np.iinfo(pixels.dtype).max)
    luma, *chroma = np.moveaxis(values[..., :3] @ _FROM_RGB.T, -1, 0)
    level = 1 << bits - 8
    planes = [_samples((16 + 219 * luma) * level)]
    for part in chroma:
        if halves_chroma:
            part = (part[0::2, 0::2] + part[0::2, 1::2] + part[1::2, 0::2] + part[1::2, 1::2]) / 4
        planes.append(_samples((128 + 224 * part) * level))
    if values.shape[2] == 4:
        planes.append(_samples(values[..., 3] * ((1 << bits) - 1)))
    return planes


def _samples(samples: F32) -> Pixels:
    return np.asarray(samples + np.float32(0.5)).astype(np.uint16)


# Encoders give other bytes for another number of threads, so it must not depend on the machine.
_NUM_THREADS = 4
# By default the scaler converts by the matrix of standard television (BT.601), up to 16 levels away.
# Chroma is the mean of its 2 x 2 pixels.
_TO_BT709 = (
    "flags=area+accurate_rnd+full_chroma_inp+bitexact:in_range=full:out_range=tv:out_color_matrix=bt709"
)
_BT709 = 1  # primaries, transfer and matrix have the same number in all codecs
_TV_RANGE = 1  # 16 to 235
_FORMATS = {3: "rgb24", 4: "rgba"}  # of pixels of 8 bits, by the number of channels
_NOTHING_RANDOM = {"fflags": "+bitexact"}  # no random number and no version of the writer in the file
# The index precedes the frames, so that a browser plays what it has received.
_INDEX_FIRST = _NOTHING_RANDOM | {"movflags": "+faststart"}
OF_QUICKTIME = ("mp4", "mov")  # containers, as libav calls them


class Encoder(NamedTuple):
    """How libav is to encode a video."""

    name: str  # in libav
    pixels: str  # how it takes them: a name of libav
    options: Mapping[str, str]  # for it
    tag: str | None = None  # of the codec in .mp4 and .mov, four letters; None for the usual one
    # frames by which decoding is ahead of showing, where the encoder does not say so reliably
    delay: int | None = None


def _encoder(codec: str, encoding: Encoding) -> Encoder:
    """The encoder of a codec: a name in `VIDEO_CODECS`, or "avif"."""
    luma_and_chroma = "yuv420p" if encoding.bits == 8 else "yuv420p10le"
    match codec:
        case "h264":
            # The error of the preset "medium" at a crf of 18, which is considered visually lossless, in 0.45
            # of its time and 1.11 of its bytes. x264's macroblock tree reads uninitialised memory: bytes
            # differed in 39 of 600 runs, and with MALLOC_PERTURB_. Without it files are 8 % larger, but
            # repeatable.
            options = {"crf": "17", "preset": "veryfast", "x264-params": "no-mbtree=1"}
            return Encoder("libx264", luma_and_chroma, options)
        case "h265":
            # Half a decibel below x264 here, in 52 % of the bytes (10 bit). Worker threads and frames in
            # flight by number, for x265 takes as many as the machine has; it writes its version and options
            # into the stream unless it is told not to, and its progress to the terminal.
            parameters = "log-level=none:info=0:pools=4:frame-threads=2"
            options = {"crf": "18", "preset": "medium", "x265-params": parameters}
            # QuickTime and Safari play no other tag. x265 knows the delay from the third frame on: time
            # stamps of shorter films were arbitrary.
            return Encoder("libx265", luma_and_chroma, options, tag="hvc1", delay=2)
        case "prores":
            pixels = "yuva444p10le" if encoding.has_alpha else "yuv444p10le"
            # Some programs open only what says it is Apple's.
            return Encoder("prores_ks", pixels, {"profile": "4444", "vendor": "apl0"})
        case "vp9":
            # The scale of crf is not that of H.264: 24 gives about the same error as 17 there.
            options = {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4"}
            options |= {"row-mt": "1", "tile-columns": "2"}
            if not encoding.has_alpha:
                return Encoder("libvpx-vp9", "yuv420p", options)
            # Frames that are not shown would have no picture of alpha beside them, and are refused.
            return Encoder("libvpx-vp9", "yuva420p", options | {"auto-alt-ref": "0"})
    # crf: the error of a JPEG of quality 95, in a third of its bytes; lp: threads, fixed as of videos.
    return Encoder("libsvtav1", luma_and_chroma, {"crf": "16", "preset": "6", "svtav1-params": "lp=1"})


@dataclass(frozen=True)
class Film:
    """What is known of a video before its first frame."""

    path: Path  # the file
    codec: str  # as `_encoder` takes it
    container: str  # its name in libav
    # width and height of the video, pixels; smaller frames are padded at their right and lower edge
    size: tuple[int, int]
    rate: Fraction  # frames a second
    encoding: Encoding  # bits of a channel, and whether there is transparency
    loops: bool = False  # whether it starts over at its end, where the format can say so
    eyes: str | None = None  # arrangement of two eyes, see `Panorama`; None for one


class VideoWriter:
    """A video that is being written; this much all kinds share. The stack closes the file."""

    def __init__(self, stack: contextlib.ExitStack, film: Film, options: Mapping[str, str]) -> None:
        import av

        self._film, self._count, self._is_finished = film, 0, False
        self._container: Any = av.open(str(film.path), "w", format=film.container, options=dict(options))

        def close() -> None:
            # After an error the rest cannot be written either; that error is the one to report.
            with contextlib.suppress(av.FFmpegError):
                self._container.close()

        stack.callback(close)

    def describe(self, text: str) -> None:
        """Set the comment of the file, before the first frame; a GIF has none."""

    def add(self, pixels: Pixels) -> None:
        """Add the next frame, see `video_pixels`."""
        self._add(pixels)
        self._count += 1

    def finish(self) -> None:
        """Write what is still buffered, and the index; no frame may follow. Further calls do nothing."""
        if not self._is_finished:
            self._is_finished = True
            self._flush()
            self._container.close()

    def _add(self, pixels: Pixels) -> None:
        raise NotImplementedError

    def _flush(self) -> None:
        raise NotImplementedError


class EncodedVideo(VideoWriter):
    """A video whose colours are converted by BT.709 and tagged so."""

    def __init__(self, stack: contextlib.ExitStack, film: Film) -> None:
        is_quicktime = film.container in OF_QUICKTIME
        super().__init__(stack, film, _INDEX_FIRST if is_quicktime else _NOTHING_RANDOM)
        self._encoder = encoder = _encoder(film.codec, film.encoding)
        stream = self._container.add_stream(encoder.name, rate=film.rate, options=dict(encoder.options))
        self._stream, self._num_packets = stream, 0
        stream.width, stream.height = film.size
        stream.pix_fmt = encoder.pixels
        if film.eyes is not None and not is_quicktime:
            stream.metadata["stereo_mode"] = MATROSKA_MODES[film.eyes]
        context = stream.codec_context
        context.thread_count = _NUM_THREADS
        context.color_primaries = context.color_trc = context.colorspace = _BT709
        context.color_range = _TV_RANGE
        if encoder.tag is not None and is_quicktime:
            context.codec_tag = encoder.tag
        self._graph = _graph(film, encoder.pixels) if film.encoding.bits == 8 else None

    def describe(self, text: str) -> None:
        """Set the comment of the file."""
        self._container.metadata["comment"] = text

    def _add(self, pixels: Pixels) -> None:
        (width, height), rate = self._film.size, self._film.rate
        right, below = width - pixels.shape[1], height - pixels.shape[0]
        if right or below:
            pixels = np.pad(pixels, ((0, below), (0, right), (0, 0)), mode="edge")  # type: ignore[assignment]
        if self._graph is not None:
            self._graph.push(video_frame(pixels, self._count, rate))
            frame = self._graph.pull()
        else:
            frame = _deep_frame(pixels, self._encoder.pixels, self._film.encoding.bits)
            frame.pts, frame.time_base = self._count, 1 / rate
        self._mux(self._stream.encode(frame))

    def _flush(self) -> None:
        self._mux(self._stream.encode(None))

    def _mux(self, packets: Sequence[Any]) -> None:
        for packet in packets:
            if self._encoder.delay is not None:
                frames = Fraction(self._num_packets - self._encoder.delay) / self._film.rate
                packet.dts = int(frames / packet.time_base)
            self._container.mux(packet)
            self._num_packets += 1


def _graph(film: Film, pixels: str) -> Any:
    """Filters from frames of 8 bits to the pixels that an encoder takes."""
    import av

    graph = av.filter.Graph()
    source = av.VideoFormat(_FORMATS[4 if film.encoding.has_alpha else 3])
    width, height = film.size
    nodes = [graph.add_buffer(width=width, height=height, format=source, time_base=1 / film.rate)]
    nodes += [graph.add(*one) for one in (("scale", _TO_BT709), ("format", pixels), ("buffersink",))]
    graph.link_nodes(*nodes).configure()
    return graph


@contextlib.contextmanager
def as_scene_error(path: Path) -> Iterator[None]:
    """Errors of libav in writing as SceneErrors."""
    import av

    try:
        yield
    except av.FFmpegError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


def _deep_frame(pixels: Pixels, name: str, bits: int) -> Any:
    """Pixels [H, W, 3 or 4] of 16 bits as a frame of planes, in a format of libav."""
    import av

    frame = av.VideoFrame(pixels.shape[1], pixels.shape[0], name)
    planes = planes_of(pixels, bits, halves_chroma="420" in name)
    for plane, samples in zip(frame.planes, planes, strict=True):
        rows = np.zeros((plane.height, plane.line_size // samples.itemsize), samples.dtype)
        rows[:, : plane.width] = samples
        plane.update(rows.tobytes())
    frame.colorspace = frame.color_primaries = frame.color_trc = _BT709  # ProRes writes those of each frame
    frame.color_range = _TV_RANGE
    return frame


def video_frame(pixels: Pixels, index: int, rate: Fraction) -> Any:
    """Pixels [H, W, 3 or 4] of 8 bits as frame `index` of a video."""
    import av

    frame = av.VideoFrame.from_ndarray(pixels, format=_FORMATS[pixels.shape[2]])
    frame.pts, frame.time_base = index, 1 / rate
    return frame


AVIF_MIN_SIDE = 16  # the encoder refuses smaller pictures


def write_avif(frame: Frame, path: str | Path, background: Background, *, bits: int = 8) -> None:
    """See `write_frame`."""
    if background is None:
        raise ValueError(f"write_frame: an AVIF holds no transparency, got {str(path)!r}; give a background")
    height, width = frame.alpha.shape
    if min(height, width) < AVIF_MIN_SIDE:
        rule = f"an AVIF must be at least {AVIF_MIN_SIDE} pixels wide and high"
        raise ValueError(f"{rule}, got {width}x{height}; use .png")
    if bits > 8 and (height % 2 or width % 2):
        raise ValueError(f"an AVIF of {bits} bits must have even sides, got {width}x{height}; use 8 bits")
    os.environ.setdefault("SVT_LOG", "1")  # errors only: it describes itself on the terminal
    with (
        defer_stop(),
        replacing(path) as temporary,
        as_scene_error(Path(path)),
        _scheduling_kept(),
        contextlib.ExitStack() as stack,
    ):
        film = Film(temporary, "avif", "avif", (width, height), Fraction(1), Encoding(bits, has_alpha=False))
        writer = EncodedVideo(stack, film)
        writer.add(video_pixels(frame, background, bits))
        writer.finish()


@contextlib.contextmanager
def _scheduling_kept() -> Iterator[None]:
    """Undo what SVT-AV1 does where the user is root: it makes the thread that calls it a real-time one.

    Threads and processes that this one begins later would be so, too, and all others would wait for them.
    """
    if not hasattr(os, "sched_getscheduler"):  # macOS and Windows, where it does not
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        if before != (os.sched_getscheduler(0), os.sched_getparam(0)):
            os.sched_setscheduler(0, *before)
