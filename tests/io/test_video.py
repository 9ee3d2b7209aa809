import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import brushgs as bg
from brushgs.formats.pictures.encoding import choose_encoding, codec_of
from brushgs.formats.pictures.gif import ColorCounts
from brushgs.formats.pictures.oiio import spread_colors
from brushgs.formats.pictures.video import open_video, padded_size
from brushgs.formats.registry import VIDEO_FORMATS, VIDEO_SUFFIXES
from brushgs.formats.table import VIDEO_CODECS
from tests.kit.for_each import for_each

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT, NUM_FRAMES = 72, 50, 7


def moving_picture(width=WIDTH, height=HEIGHT, num_frames=NUM_FRAMES) -> list[np.ndarray]:
    """A smooth pattern of many colors that slides by two pixels a frame."""
    noise = np.random.default_rng(0).random((height, width + 2 * num_frames, 3))
    smooth = gaussian_filter(noise, (4, 4, 0))
    pixels = ((smooth - smooth.min()) / np.ptp(smooth) * 255).astype(np.uint8)
    return [np.ascontiguousarray(pixels[:, 2 * i : 2 * i + width]) for i in range(num_frames)]


CODECS = [(row.suffixes[0], codec) for row in VIDEO_FORMATS for codec in row.codecs]
OFFERED = [(suffix, codec, bits) for suffix, codec in CODECS for bits in VIDEO_CODECS[codec].bits]


def film(path: Path, frames: list[np.ndarray], fps: float = 24, **options: bool | str | int | None) -> Path:
    """A video of frames of 8 bits; formats of more bits get the same values in 16."""
    height, width, channels = frames[0].shape
    bits = options.get("bits") or codec_of(path, options.get("codec")).bits[0]
    encoding = choose_encoding(path, transparent=channels == 4, **options)
    with open_video(path, encoding, width=width, height=height, fps=fps) as reel:
        for pixels in frames:
            reel.add(pixels if bits == 8 else pixels.astype(np.uint16) * 257)
        reel.finish()
    return path


def read(path: Path) -> tuple[list[np.ndarray], av.VideoFrame, Fraction]:
    """All frames as RGB by the matrix of the tags, the first as it was stored, and the rate."""
    with av.open(str(path)) as container:
        rate = container.streams.video[0].average_rate
        stored = list(container.decode(video=0))
    if path.suffix == ".gif":
        return [frame.to_ndarray(format="rgb24") for frame in stored], stored[0], rate
    matrix = {"src_colorspace": stored[0].colorspace, "dst_colorspace": stored[0].colorspace}
    return [frame.reformat(format="rgb24", **matrix).to_ndarray() for frame in stored], stored[0], rate


def plane(stored: av.VideoFrame, index: int) -> np.ndarray:
    """One plane of a frame as it is stored."""
    part = stored.planes[index]
    dtype = np.uint8 if stored.format.components[index].bits == 8 else np.uint16
    return np.frombuffer(bytes(part), dtype).reshape(part.height, -1)[:, : part.width].astype(float)


def rgb_of(stored: av.VideoFrame) -> np.ndarray:
    """RGB 0 to 1 of a frame by the formulas of BT.709, limited range; halved chroma is repeated."""
    full = 1 << stored.format.components[0].bits - 8
    luma, *chroma = (plane(stored, index) / full for index in range(3))
    if chroma[0].shape != luma.shape:
        chroma = [np.repeat(np.repeat(part, 2, 0), 2, 1)[: luma.shape[0], : luma.shape[1]] for part in chroma]
    y, (cb, cr) = (luma - 16) / 219, ((part - 128) / 224 for part in chroma)
    red, blue = y + 1.5748 * cr, y + 1.8556 * cb
    return np.stack([red, (y - 0.2126 * red - 0.0722 * blue) / 0.7152, blue], axis=-1)


def psnr(actual: np.ndarray, expected: np.ndarray) -> float:
    return float(10 * np.log10(255**2 / np.mean((actual.astype(float) - expected) ** 2)))


# Worst frames measured: 34.1, 33.9 and 31.6 dB. Halving the chroma alone leaves 35.0 of a pattern as bright
# as this; painted frames come to 38.7 and more.
LEAST = {"h264": 33.5, "h265": 33, "vp9": 33.5, "prores": 45, "gif": 31}


@for_each(("suffix", "codec", "bits"), OFFERED)
def test_a_video_gives_its_frames_back(tmp_path, suffix, codec, bits):
    frames, least = moving_picture(), LEAST[codec]
    decoded, stored, rate = read(film(tmp_path / f"a{suffix}", frames, fps=25, codec=codec, bits=bits))
    name = stored.format.name
    assert ("p10" in name or "p12" in name) == (bits == 10), name
    assert len(decoded) == NUM_FRAMES
    assert rate == 25
    for actual, expected in zip(decoded, frames, strict=True):
        assert actual.shape == expected.shape
        assert psnr(actual, expected) > least
    if suffix in (".mp4", ".mov"):  # the index comes first
        content = (tmp_path / f"a{suffix}").read_bytes()
        assert 0 < content.index(b"moov") < content.index(b"mdat")
    # Each is nearest to the frame it was: none is shown twice, none is late.
    errors = np.array([[psnr(actual, expected) for expected in frames] for actual in decoded])
    assert errors.argmax(axis=1).tolist() == list(range(NUM_FRAMES))


def test_frames_behind_a_hard_cut_are_as_good_as_without_it(tmp_path):
    """Where motion is predicted across a cut, errors stay larger for a second."""
    noise = np.random.default_rng(1).normal(128, 90, (HEIGHT, 2 * WIDTH))
    texture = np.repeat(np.clip(gaussian_filter(noise, 1), 0, 255).astype(np.uint8)[..., None], 3, axis=2)
    shot = [np.ascontiguousarray(texture[:, 2 * i : 2 * i + WIDTH]) for i in range(26)]
    both = read(film(tmp_path / "both.mp4", moving_picture(num_frames=26) + shot))[0][26:]
    alone = read(film(tmp_path / "alone.mp4", shot))[0]
    found, least = (min(map(psnr, decoded, shot)) for decoded in (both, alone))
    assert found > least - 1


def test_bytes_do_not_depend_on_what_lay_in_memory(tmp_path):
    code = (
        "import hashlib, pathlib, sys\n"
        "from tests.io.test_video import OFFERED, film, moving_picture, seen_through\n"
        "for suffix, codec, bits in OFFERED:\n"
        "    path = film(pathlib.Path(sys.argv[1] + suffix), moving_picture(), codec=codec, bits=bits)\n"
        "    print(hashlib.sha256(path.read_bytes()).hexdigest())\n"
        "for suffix in ('.mov', '.webm'):\n"
        "    path = film(pathlib.Path(sys.argv[1] + suffix), seen_through())\n"
        "    print(hashlib.sha256(path.read_bytes()).hexdigest())\n"
    )
    runs = []
    for fill in ("1", "255"):  # glibc fills fresh memory with it; elsewhere the runs are alike anyway
        environment = os.environ | {"MALLOC_PERTURB_": fill, "MALLOC_MMAP_THRESHOLD_": str(2**30)}
        command = [sys.executable, "-c", code, str(tmp_path / fill)]
        runs.append(subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE))
    first, second = (run.communicate()[0] for run in runs)
    assert len(first.split()) == len(OFFERED) + 2
    assert first == second


@for_each(("suffix", "codec", "bits"), [row for row in OFFERED if row[0] != ".gif"])
def test_colors_are_converted_by_bt709_and_tagged_so(tmp_path, suffix, codec, bits):
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (200, 120, 40)])
    pixels = np.repeat(np.repeat(colors[None].astype(np.uint8), 32, axis=0), 16, axis=1)
    _, stored, _ = read(film(tmp_path / f"a{suffix}", [pixels] * 3, codec=codec, bits=bits))
    assert (stored.colorspace, stored.color_range, stored.color_primaries, stored.color_trc) == (1, 1, 1, 1)
    full = 1 << stored.format.components[0].bits - 8
    luma = plane(stored, 0).reshape(32, 4, 16)[4:-4, :, 4:-4].mean(axis=(0, 2)) / full
    expected = 16 + 219 * (colors / 255) @ (0.2126, 0.7152, 0.0722)
    np.testing.assert_allclose(luma, expected, atol=1.5)  # BT.601 is off by 16 in green


@for_each("suffix", VIDEO_SUFFIXES)
def test_odd_sides_lose_nothing(tmp_path, suffix):
    frames = moving_picture(41, 33)
    decoded, _, _ = read(film(tmp_path / f"a{suffix}", frames))
    is_even = suffix in (".mp4", ".mkv")
    assert padded_size(Path(f"a{suffix}"), 41, 33) == ((42, 34) if is_even else (41, 33))
    width, height = padded_size(Path(f"a{suffix}"), 41, 33)
    assert decoded[0].shape == (height, width, 3)
    assert psnr(decoded[3][:33, :41], frames[3]) > 33
    if is_even:  # what stands over is the outermost row and column once more
        np.testing.assert_allclose(decoded[3][33].astype(int), decoded[3][32], atol=5)
        np.testing.assert_allclose(decoded[3][:, 41].astype(int), decoded[3][:, 40], atol=5)


@for_each(
    ("fps", "rate"),
    [
        (29.97, Fraction(30000, 1001)),
        (59.94, Fraction(60000, 1001)),
        (30, 30),
        (12.5, Fraction(25, 2)),
    ],
)
def test_the_frame_rate_is_kept_and_those_of_television_are_fractions(tmp_path, fps, rate):
    assert read(film(tmp_path / "a.mp4", moving_picture(), fps))[2] == rate


@for_each("suffix", VIDEO_SUFFIXES)
@for_each("error", [KeyboardInterrupt, ValueError])
def test_a_video_that_is_not_finished_leaves_what_was_there(tmp_path, suffix, error):
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def stop():
        with open_video(path, choose_encoding(path), width=WIDTH, height=HEIGHT, fps=24) as reel:
            reel.add(moving_picture()[0])
            raise error

    with pytest.raises(error):
        stop()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    path.unlink()


# ---- what a format offers


PLAIN, SMALL = [(HEIGHT, WIDTH)], [(4, 6)]


@for_each(
    "sizes, name, options, sentence",
    [
        (PLAIN, "a.gif", {"fps": 60}, r"fps must be above 0 and at most 50 for \.\w+, got 60"),
        (PLAIN, "a.mp4", {"fps": 0}, r"fps must be above 0 and at most 1000 for \.\w+, got 0"),
        ([(16, 8194)], "a.mp4", {"codec": "h265"}, r"in \.mp4 with H\.265 must be at most 8192 pixels wide"),
        ([(15, 40)], "a.mp4", {"codec": "h265"}, r"in \.mp4 with H\.265 must be at least 16 pixels wide"),
        (SMALL, "a.mp4", {"codec": "vp9"}, r"codec must be h264 or h265 for \.mp4, got 'vp9'; \.webm takes"),
        (SMALL, "a.webm", {"codec": "h264"}, r"codec must be vp9 for \.webm, got 'h264'; \.mp4, \.mov or"),
        (SMALL, "a.gif", {"background": "transparent"}, r"must not be transparent in a\.gif, whose"),
        (SMALL, "a.avi", {}, r"path must end in .*, got '.*a.avi'"),
        ([], "a.mp4", {}, "frames must hold at least one, got none"),
        ([(4, 6), (6, 4)], "a.gif", {}, "frames must have one size, got 6x4 and 4x6"),
    ],
)
def test_what_makes_no_video_is_refused_and_nothing_is_left(tmp_path, sizes, name, options, sentence):
    frames = [bg.Frame(np.zeros((*size, 3), np.float32), np.zeros(size, np.float32)) for size in sizes]
    with pytest.raises(ValueError, match=sentence):
        bg.save_video(iter(frames), tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


# ---- bits


@for_each(("name", "codec"), [("a.mov", "prores"), ("a.mp4", "h265"), ("a.mkv", "h265")])
def test_ten_bits_hold_what_eight_cannot(tmp_path, name, codec):
    """A ramp over 11 levels of 8 bits in 41 steps, each on a strip 32 wide, so that codecs keep its steps."""
    steps = np.linspace(0.4, 0.45, 41, dtype=np.float32)
    ramp = np.broadcast_to(np.repeat(steps, 32)[None, :, None], (64, 41 * 32, 3))
    frame = bg.Frame(np.ascontiguousarray(ramp), np.ones(ramp.shape[:2], np.float32))
    bg.save_video([frame], tmp_path / name, codec=codec)
    with av.open(str(tmp_path / name)) as container:
        stored = next(container.decode(video=0))
    full = 1 << stored.format.components[0].bits - 8
    luma = plane(stored, 0).reshape(64, 41, 32)[16:-16, :, 8:-8].mean(axis=(0, 2)) / full
    # Within a step of 10 bits; those of 8 would be off by up to 2.
    np.testing.assert_allclose(4 * luma, 4 * (16 + 219 * steps), atol=1)
    assert np.diff(luma).min() > 0


# ---- transparency


def seen_through(width: int = WIDTH, height: int = HEIGHT) -> list[np.ndarray]:
    """Frames [H, W, 4] of 8 bits whose alpha rises from left to right."""
    alpha = np.broadcast_to(np.linspace(0, 255, width).astype(np.uint8)[None, :, None], (height, width, 1))
    return [np.concatenate([pixels, alpha], axis=2) for pixels in moving_picture(width, height)]


def soft_frame(width: int, height: int) -> bg.Frame:
    """A warm disc with a soft edge on nothing; its colors slide from left to right."""
    x, y = np.meshgrid(np.arange(width) / width - 0.5, np.arange(height) / height - 0.5)
    alpha = np.clip((0.42 - np.hypot(x, y)) * 6, 0, 1).astype(np.float32)
    colors = np.stack([0.8 + 0.1 * x, 0.5 + 0.4 * x, 0.2 - 0.1 * y], axis=-1).astype(np.float32)
    return bg.Frame(colors * alpha[..., None], alpha)


def with_alpha(path: Path) -> list[av.VideoFrame]:
    """Frames with their alpha: of VP9 only libvpx decodes it."""
    with av.open(str(path)) as container:
        if path.suffix != ".webm":
            return list(container.decode(video=0))
        assert container.streams.video[0].metadata["alpha_mode"] == "1"
        decoder = av.CodecContext.create("libvpx-vp9", "r")
        packets = [packet for packet in container.demux(video=0) if packet.size]
        return [frame for packet in [*packets, None] for frame in decoder.decode(packet)]


@for_each("size", [(96, 64), (97, 63)])
@for_each(("suffix", "close"), [(".mov", 0.004), (".webm", 0.03)])
def test_transparent_frames_keep_their_alpha_and_their_straight_colors(tmp_path, suffix, close, size):
    frame = soft_frame(*size)
    bg.save_video([frame] * 3, tmp_path / f"a{suffix}", background=None)
    decoded = with_alpha(tmp_path / f"a{suffix}")
    assert len(decoded) == 3
    for stored in decoded:
        assert (stored.width, stored.height) == size
        most = (1 << stored.format.components[3].bits) - 1
        alpha = plane(stored, 3) / most
        # ProRes keeps alpha without loss, in the 10 bits that libav takes; it is read in 12.
        np.testing.assert_allclose(alpha, frame.alpha, atol=0.75 / 1023 if suffix == ".mov" else 0.03)
        rgb = rgb_of(stored)
        painted = frame.alpha > 0.02
        straight = frame.rgb[painted] / frame.alpha[painted, None]
        errors = np.abs(rgb[painted] - straight)
        assert errors.max() < 3 * close, errors.max()
        assert errors.mean() < close / 2, errors.mean()


def test_colors_go_on_where_nothing_is_painted():
    frame = soft_frame(37, 22)
    colors = spread_colors(frame)
    painted = frame.alpha > 0
    np.testing.assert_allclose(colors[painted], frame.rgb[painted] / frame.alpha[painted, None], rtol=1e-6)
    assert colors[~painted].min() > 0.1  # none is black
    assert np.abs(colors[~painted] - (0.8, 0.5, 0.2)).max() < 0.3
    bare = bg.Frame(np.zeros((3, 5, 3), np.float32), np.zeros((3, 5), np.float32))
    assert not spread_colors(bare).any()


def test_colors_of_all_pictures_of_a_gif_count():
    counts = ColorCounts()
    for color in ((255, 0, 0), (0, 0, 255)):
        counts.add(np.full((4, 4, 3), color, np.uint8))
    assert counts.palette(255).tolist() == [[0, 0, 255], [255, 0, 0]]


def test_frames_become_a_video_on_their_background(tmp_path):
    grey = [np.full((48, 64, 3), 0.1 * k, np.float32) for k in range(5)]
    frames = (bg.Frame(rgb, np.full((48, 64), 0.5, np.float32)) for rgb in grey)
    bg.save_video(frames, tmp_path / "a.mp4", fps=12, background=(0, 0, 1))
    pictures, _, rate = read(tmp_path / "a.mp4")
    assert (len(pictures), rate) == (5, 12)
    for k, picture in enumerate(pictures):
        expected = 255 * np.clip([0.1 * k, 0.1 * k, 0.1 * k + 0.5], 0, 1)
        np.testing.assert_allclose(picture.mean(axis=(0, 1)), expected, atol=4)
