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
from typing import Any, Protocol

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


class VideoWriter(Protocol):
    """A video that is being written."""

    def describe(self, text: str) -> None:
        """Set the comment of the file, before the first frame; a GIF has none."""

    def add(self, pixels: Pixels) -> None:
        """Add the next frame, see `video_pixels`."""

    def finish(self) -> None:
        """Write what is still buffered; no frame may follow. Further calls do nothing."""


@dataclass(frozen=True)
class Film:
    """What is known of a video before its first frame.

    Attributes:
        path: the file.
        container: its name in libav.
        size: width and height of the video, pixels; smaller frames are padded at their right and lower edge.
        rate: frames a second.
        encoding: bits of a channel, and whether there is transparency.
        loops: whether it starts over at its end, where the format can say so.
        eyes: arrangement of two eyes, see `Panorama`; None for one.
    """

    path: Path
    container: str
    size: tuple[int, int]
    rate: Fraction
    encoding: Encoding
    loops: bool = False
    eyes: str | None = None


@dataclass(frozen=True)
class Encoder:
    """How libav is to encode a video.

    Attributes:
        name: in libav.
        pixels: how it takes them: a name of libav.
        options: for it.
        tag: of the codec in .mp4 and .mov, four letters; None for the usual one.
        delay: frames by which decoding is ahead of showing, where the encoder does not say so reliably.
    """

    name: str
    pixels: str
    options: Mapping[str, str]
    tag: str | None = None
    delay: int | None = None


class EncodedVideo:
    """A video whose colours are converted by BT.709 and tagged so.

    Args:
        stack: closes the file.
        film: what is known of it.
        encoder: how to encode.
    """

    def __init__(self, stack: contextlib.ExitStack, film: Film, encoder: Encoder) -> None:
        self._size, self._rate = film.size, film.rate
        self._container = open_container(stack, film)
        self._stream = stream = self._container.add_stream(
            encoder.name, rate=film.rate, options=dict(encoder.options)
        )
        stream.width, stream.height = film.size
        stream.pix_fmt = encoder.pixels
        if film.eyes is not None and film.container not in OF_QUICKTIME:
            stream.metadata["stereo_mode"] = MATROSKA_MODES[film.eyes]
        context = stream.codec_context
        context.thread_count = _NUM_THREADS
        context.color_primaries = context.color_trc = context.colorspace = _BT709
        context.color_range = _TV_RANGE
        if encoder.tag is not None and film.container in OF_QUICKTIME:
            context.codec_tag = encoder.tag
        self._bits, self._encoder = film.encoding.bits, encoder
        if self._bits == 8:
            source = _FORMATS[4 if film.encoding.has_alpha else 3]
            filters = ("scale", _TO_BT709), ("format", encoder.pixels)
            self._graph = filter_graph(*film.size, film.rate, *filters, source=source)
        self._count, self._num_packets, self._is_finished = 0, 0, False

    def describe(self, text: str) -> None:
        """Set the comment of the file."""
        self._container.metadata["comment"] = text

    def add(self, pixels: Pixels) -> None:
        """Convert, encode and write one frame, see `video_pixels`."""
        width, height = self._size
        right, below = width - pixels.shape[1], height - pixels.shape[0]
        if right or below:
            pixels = np.pad(pixels, ((0, below), (0, right), (0, 0)), mode="edge")  # type: ignore[assignment]
        if self._bits == 8:
            self._graph.push(video_frame(pixels, self._count, self._rate))
            frame = self._graph.pull()
        else:
            frame = _deep_frame(pixels, self._encoder.pixels, self._bits)
            frame.pts, frame.time_base = self._count, 1 / self._rate
        self._mux(self._stream.encode(frame))
        self._count += 1

    def finish(self) -> None:
        """Write the frames that the encoder has buffered, and the index."""
        if self._is_finished:
            return
        self._is_finished = True
        self._mux(self._stream.encode(None))
        self._container.close()

    def _mux(self, packets: Sequence[Any]) -> None:
        for packet in packets:
            if self._encoder.delay is not None:
                frames = Fraction(self._num_packets - self._encoder.delay) / self._rate
                packet.dts = int(frames / packet.time_base)
            self._container.mux(packet)
            self._num_packets += 1


@contextlib.contextmanager
def as_scene_error(path: Path) -> Iterator[None]:
    """Errors of libav in writing as SceneErrors."""
    import av

    try:
        yield
    except av.FFmpegError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


def open_container(stack: contextlib.ExitStack, film: Film, options: Mapping[str, str] | None = None) -> Any:
    """A container that is closed with the stack; options of its own replace those of its kind."""
    import av

    if options is None:
        options = _INDEX_FIRST if film.container in OF_QUICKTIME else _NOTHING_RANDOM
    container = av.open(str(film.path), "w", format=film.container, options=dict(options))

    def close() -> None:
        # After an error the rest cannot be written either; that error is the one to report.
        with contextlib.suppress(av.FFmpegError):
            container.close()

    stack.callback(close)
    return container


def filter_graph(
    width: int, height: int, rate: Fraction, *filters: tuple[str, str], source: str = "rgb24"
) -> Any:
    """A chain of filters for frames in a format of libav, given as pairs of name and options."""
    import av

    graph = av.filter.Graph()
    last = graph.add_buffer(
        width=width, height=height, format=av.VideoFormat(source), time_base=1 / rate, name="frames"
    )
    for name, options in (*filters, ("buffersink", "")):
        following = graph.add(name, options)
        last.link_to(following)
        last = following
    graph.configure()
    return graph


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


_ENCODER = Encoder(
    "libx264",
    "yuv420p",
    # The error of the preset "medium" at a crf of 18, which is considered visually lossless, in 0.45 of its
    # time and 1.11 of its bytes. x264's macroblock tree reads uninitialised memory: bytes differed in 39 of
    # 600 runs, and with MALLOC_PERTURB_. Without it files are 8 % larger, but repeatable.
    {"crf": "17", "preset": "veryfast", "x264-params": "no-mbtree=1"},
)


def open_h264(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(stack, film, _ENCODER)


_H265_PIXELS = {8: "yuv420p", 10: "yuv420p10le"}
# Worker threads and frames in flight by number, for x265 takes as many as the machine has; it writes its
# version and options into the stream unless it is told not to, and its progress to the terminal.
_PARAMETERS = "log-level=none:info=0:pools=4:frame-threads=2"


def open_h265(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(
        stack,
        film,
        Encoder(
            "libx265",
            _H265_PIXELS[film.encoding.bits],
            # Half a decibel below x264 here, in 52 % of the bytes (10 bit).
            {"crf": "18", "preset": "medium", "x265-params": _PARAMETERS},
            tag="hvc1",  # QuickTime and Safari play no other
            delay=2,  # x265 knows it from the third frame on: time stamps of shorter films were arbitrary
        ),
    )


_PRORES_OPTIONS = {"profile": "4444", "vendor": "apl0"}  # some programs open only what says it is Apple's


def open_prores(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(
        stack,
        film,
        Encoder("prores_ks", "yuva444p10le" if film.encoding.has_alpha else "yuv444p10le", _PRORES_OPTIONS),
    )


# The scale of crf is not that of H.264: 24 gives about the same error as 17 there.
_VP9_OPTIONS = {
    "crf": "24",
    "b": "0",
    "deadline": "good",
    "cpu-used": "4",
    "row-mt": "1",
    "tile-columns": "2",
}
# Frames that are not shown would have no picture of alpha beside them, and the encoder refuses them.
_VP9_ALPHA = _VP9_OPTIONS | {"auto-alt-ref": "0"}


def open_vp9(stack: contextlib.ExitStack, film: Film) -> VideoWriter:
    """See `open_video`."""
    return EncodedVideo(stack, film, _encoder(has_alpha=film.encoding.has_alpha))


def _encoder(*, has_alpha: bool) -> Encoder:
    if has_alpha:
        return Encoder("libvpx-vp9", "yuva420p", _VP9_ALPHA)
    return Encoder("libvpx-vp9", "yuv420p", _VP9_OPTIONS)


AVIF_MIN_SIDE = 16  # the encoder refuses smaller pictures
_AVIF_PIXELS = {8: "yuv420p", 10: "yuv420p10le"}
# crf: the error of a JPEG of quality 95, in a third of its bytes; lp: threads, fixed as those of videos are.
_AVIF_OPTIONS = {"crf": "16", "preset": "6", "svtav1-params": "lp=1"}


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
    encoder = Encoder("libsvtav1", _AVIF_PIXELS[bits], _AVIF_OPTIONS)
    with (
        defer_stop(),
        replacing(path) as temporary,
        as_scene_error(Path(path)),
        _scheduling_kept(),
        contextlib.ExitStack() as stack,
    ):
        film = Film(temporary, "avif", (width, height), Fraction(1), Encoding(bits, has_alpha=False))
        writer = EncodedVideo(stack, film, encoder)
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
