"""Encode videos and AVIF with libav (PyAV): frames pass a filter graph into an encoder.

Equal frames give equal bytes on every machine: encoders use a fixed number of threads, and no time of day,
random number or version of the writer is stored.

Above 8 bits, RGB is converted to luma and chroma here, by BT.709 in limited range: libav's scaler rounds up,
which made luma one or two 10-bit levels too bright, and alpha one too opaque.
Source: ITU-R BT.709-6, items 3.2 to 3.5.
"""

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
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
    """Convert pixels to planes of luma, two of chroma, and alpha if there is a fourth channel.

    Args:
        pixels: [H, W, 3 or 4] over the full range of their dtype.
        bits: of a sample, 9 to 16, in limited range: 10-bit luma is 64 to 940. Alpha has the full range.
        halves_chroma: whether chroma is subsampled by 2 x 2 (mean); sides must be even then.
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


# The bytes depend on the number of threads, so it must not depend on the machine.
_NUM_THREADS = 4
# By default the scaler uses the BT.601 matrix, which is off by up to 16 levels. Chroma is the mean of its
# 2 x 2 pixels.
_TO_BT709 = (
    "flags=area+accurate_rnd+full_chroma_inp+bitexact:in_range=full:out_range=tv:out_color_matrix=bt709"
)
_BT709 = 1  # code of the primaries, transfer and matrix in all codecs
_TV_RANGE = 1  # 16 to 235
_FORMATS = {3: "rgb24", 4: "rgba"}  # number of channels -> 8-bit pixel format
_NOTHING_RANDOM = {"fflags": "+bitexact"}  # no random number and no version of the writer in the file
# The index precedes the frames, so that a browser can play while it downloads.
_INDEX_FIRST = _NOTHING_RANDOM | {"movflags": "+faststart"}
OF_QUICKTIME = ("mp4", "mov")  # names of the containers in libav


class Encoder(NamedTuple):
    """Settings of an encoder of libav."""

    name: str  # in libav
    pixels: str  # input pixel format, a name of libav
    options: Mapping[str, str]  # of the encoder
    tag: str | None = None  # codec tag in .mp4 and .mov, four letters; None for the default
    # frames by which decoding is ahead of presentation, if the encoder does not report it reliably
    delay: int | None = None


# x264's macroblock tree reads uninitialised memory: bytes differed in 39 of 600 runs, and with
# MALLOC_PERTURB_. Files are larger without it, but reproducible. The rest suits paint in even motion: within
# 0.2 dB of the preset's own choices at crf 17, in 0.66 to 0.71 of the time and 0.95 to 1.04 of the bytes.
# B-frames in fixed places need little analysis ahead, blocks of 8 x 8 pixels in B-frames gain little, and a
# dead zone narrower by a third keeps texture, which pays for both. Without a search for cuts another 8 % of
# the time is saved, but frames behind a cut lose up to 8 dB.
_OF_X264 = {
    "crf": "18.2",
    "preset": "veryfast",
    "x264-params": "no-mbtree=1:b-adapt=0:bframes=2:partitions=p8x8,i8x8,i4x4:"
    "deadzone-inter=14:chroma-qp-offset=-1",
}


def _encoder(codec: str, encoding: Encoding) -> Encoder:
    """The encoder of a codec: a name in `VIDEO_CODECS`, or "avif"."""
    luma_and_chroma = "yuv420p" if encoding.bits == 8 else "yuv420p10le"
    match codec:
        case "h264":
            # Against the preset "medium" at crf 18, which is considered visually lossless: luma 0.5 to 1.1 dB
            # better, chroma 0.2 to 1 dB worse, 0.3 of the time, 1.3 to 1.8 times the bytes.
            return Encoder("libx264", luma_and_chroma, _OF_X264)
        case "h265":
            # Half a decibel below x264, in 52 % of the bytes (10 bit). The numbers of worker and frame
            # threads are fixed, as x265 otherwise uses those of the machine. By default it also writes its
            # version and options into the stream, and its progress to the terminal.
            parameters = "log-level=none:info=0:pools=4:frame-threads=2"
            options = {"crf": "18", "preset": "medium", "x265-params": parameters}
            # QuickTime and Safari play no other tag. x265 knows the delay only from the third frame on:
            # timestamps of shorter videos were arbitrary.
            return Encoder("libx265", luma_and_chroma, options, tag="hvc1", delay=2)
        case "prores":
            pixels = "yuva444p10le" if encoding.has_alpha else "yuv444p10le"
            # Some programs open only files with Apple's vendor tag.
            return Encoder("prores_ks", pixels, {"profile": "4444", "vendor": "apl0"})
        case "vp9":
            # crf is scaled differently from H.264: 24 gives about the same error as 18 there.
            options = {"crf": "24", "b": "0", "deadline": "good", "cpu-used": "4"}
            options |= {"row-mt": "1", "tile-columns": "2"}
            if not encoding.has_alpha:
                return Encoder("libvpx-vp9", "yuv420p", options)
            # Hidden alternate reference frames have no alpha counterpart, and the encoder refuses them.
            return Encoder("libvpx-vp9", "yuva420p", options | {"auto-alt-ref": "0"})
    # AVIF. crf: the error of a JPEG of quality 95, in a third of its bytes; lp: number of threads, fixed.
    return Encoder("libsvtav1", luma_and_chroma, {"crf": "16", "preset": "6", "svtav1-params": "lp=1"})


class Film(NamedTuple):
    """Parameters of a video to write."""

    path: Path  # the file
    codec: str  # see `_encoder`
    container: str  # its name in libav
    # width and height of the video, pixels; smaller frames are padded at their right and lower edge
    size: tuple[int, int]
    rate: Fraction  # frames per second
    encoding: Encoding  # bits per channel, and whether alpha is stored
    loops: bool = False  # whether it repeats, if the format can store that
    eyes: str | None = None  # stereo layout, see `Panorama`; None for one eye


class VideoWriter:
    """Base class of video writers. The exit stack closes the file."""

    def __init__(self, stack: contextlib.ExitStack, film: Film, options: Mapping[str, str]) -> None:
        import av

        self._film, self._count, self._is_finished = film, 0, False
        self._container: Any = av.open(str(film.path), "w", format=film.container, options=dict(options))

        def close() -> None:
            # After an error closing fails too; the first error is the one to report.
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
        """Write buffered frames and the index; no frame may follow. Further calls do nothing."""
        if not self._is_finished:
            self._is_finished = True
            self._flush()
            self._container.close()

    def _add(self, pixels: Pixels) -> None:
        raise NotImplementedError

    def _flush(self) -> None:
        raise NotImplementedError


class EncodedVideo(VideoWriter):
    """A video whose colors are converted and tagged as BT.709."""

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
    """Filter graph from 8-bit frames to the pixel format of an encoder."""
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
    """Convert errors of libav while writing to SceneErrors."""
    import av

    try:
        yield
    except av.FFmpegError as error:
        raise SceneError(path, f"cannot be written ({error.strerror}); check the disk") from None


def _deep_frame(pixels: Pixels, name: str, bits: int) -> Any:
    """16-bit pixels [H, W, 3 or 4] as a planar frame; `name` is a pixel format of libav."""
    import av

    frame = av.VideoFrame(pixels.shape[1], pixels.shape[0], name)
    planes = planes_of(pixels, bits, halves_chroma="420" in name)
    for plane, samples in zip(frame.planes, planes, strict=True):
        rows = np.zeros((plane.height, plane.line_size // samples.itemsize), samples.dtype)
        rows[:, : plane.width] = samples
        plane.update(rows.tobytes())
    frame.colorspace = frame.color_primaries = frame.color_trc = _BT709  # ProRes stores those of each frame
    frame.color_range = _TV_RANGE
    return frame


def video_frame(pixels: Pixels, index: int, rate: Fraction) -> Any:
    """8-bit pixels [H, W, 3 or 4] as frame `index` of a video."""
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
    os.environ.setdefault("SVT_LOG", "1")  # log errors only: by default it prints its settings
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
    """Restore the scheduling policy of the calling thread, which SVT-AV1 makes real-time for root.

    Threads and processes started later would inherit it, and starve all others.
    """
    if not hasattr(os, "sched_getscheduler"):  # macOS and Windows are not affected
        yield
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        if before != (os.sched_getscheduler(0), os.sched_getparam(0)):
            os.sched_setscheduler(0, *before)
