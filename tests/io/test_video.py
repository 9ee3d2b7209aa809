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
from brushgs import SceneError
from brushgs.io.pictures.formats import VIDEO_SUFFIXES
from brushgs.io.pictures.gif_colors import ColorCounts
from brushgs.io.pictures.video import open_video, padded_size

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT, NUM_FRAMES = 72, 50, 7


def moving_picture(
    width: int = WIDTH, height: int = HEIGHT, num_frames: int = NUM_FRAMES
) -> list[np.ndarray]:
    """A smooth pattern of many colours that slides by two pixels a frame."""
    noise = np.random.default_rng(0).random((height, width + 2 * num_frames, 3))
    smooth = gaussian_filter(noise, (4, 4, 0))
    pixels = ((smooth - smooth.min()) / np.ptp(smooth) * 255).astype(np.uint8)
    return [np.ascontiguousarray(pixels[:, 2 * i : 2 * i + width]) for i in range(num_frames)]


def film(path: Path, frames: list[np.ndarray], fps: float = 24, **options: bool) -> Path:
    height, width, _ = frames[0].shape
    with open_video(path, width=width, height=height, fps=fps, **options) as reel:
        for pixels in frames:
            reel.add(pixels)
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


def psnr(actual: np.ndarray, expected: np.ndarray) -> float:
    return float(10 * np.log10(255**2 / np.mean((actual.astype(float) - expected) ** 2)))


# Worst frames measured: 34.1, 33.9 and 31.6 dB. Halving the chroma alone leaves 35.0 of a pattern as bright
# as this; painted frames come to 38.7 and more.
@pytest.mark.parametrize(("suffix", "least"), [(".mp4", 33.5), (".webm", 33.5), (".gif", 31)])
def test_a_video_gives_its_frames_back(tmp_path: Path, suffix: str, least: float) -> None:
    frames = moving_picture()
    decoded, _, rate = read(film(tmp_path / f"a{suffix}", frames, fps=25))
    assert len(decoded) == NUM_FRAMES
    assert rate == 25
    for actual, expected in zip(decoded, frames, strict=True):
        assert actual.shape == expected.shape
        assert psnr(actual, expected) > least
    # Each is nearest to the frame it was: none is shown twice, none is late.
    errors = np.array([[psnr(actual, expected) for expected in frames] for actual in decoded])
    assert errors.argmax(axis=1).tolist() == list(range(NUM_FRAMES))


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
def test_equal_frames_give_equal_bytes(tmp_path: Path, suffix: str) -> None:
    first, second = (film(tmp_path / f"{name}{suffix}", moving_picture()) for name in "ab")
    assert first.read_bytes() == second.read_bytes()


def test_bytes_do_not_depend_on_what_lay_in_memory(tmp_path: Path) -> None:
    code = (
        "import hashlib, pathlib, sys\n"
        "from tests.io.test_video import film, moving_picture\n"
        "for suffix in ('.mp4', '.webm', '.gif'):\n"
        "    path = film(pathlib.Path(sys.argv[1] + suffix), moving_picture())\n"
        "    print(hashlib.sha256(path.read_bytes()).hexdigest())\n"
    )
    runs = []
    for fill in ("1", "255"):  # glibc fills fresh memory with it; elsewhere the runs are alike anyway
        environment = os.environ | {"MALLOC_PERTURB_": fill, "MALLOC_MMAP_THRESHOLD_": str(2**30)}
        command = [sys.executable, "-c", code, str(tmp_path / fill)]
        runs.append(subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE))
    first, second = (run.communicate()[0] for run in runs)
    assert len(first.split()) == 3
    assert first == second


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_colours_are_converted_by_bt709_and_tagged_so(tmp_path: Path, suffix: str) -> None:
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (200, 120, 40)])
    pixels = np.repeat(np.repeat(colors[None].astype(np.uint8), 32, axis=0), 16, axis=1)
    _, stored, _ = read(film(tmp_path / f"a{suffix}", [pixels] * 3))
    assert (stored.colorspace, stored.color_range, stored.color_primaries, stored.color_trc) == (1, 1, 1, 1)
    assert stored.format.name == "yuv420p"
    planes = stored.to_ndarray()
    luma = planes[:32].reshape(32, 4, 16)[4:-4, :, 4:-4].mean(axis=(0, 2))
    expected = 16 + 219 * (colors / 255) @ (0.2126, 0.7152, 0.0722)
    np.testing.assert_allclose(luma, expected, atol=1.5)  # BT.601 is off by 16 in green


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
def test_odd_sides_lose_nothing(tmp_path: Path, suffix: str) -> None:
    frames = moving_picture(41, 33)
    decoded, _, _ = read(film(tmp_path / f"a{suffix}", frames))
    assert padded_size(Path(f"a{suffix}"), 41, 33) == ((42, 34) if suffix == ".mp4" else (41, 33))
    width, height = padded_size(Path(f"a{suffix}"), 41, 33)
    assert decoded[0].shape == (height, width, 3)
    assert psnr(decoded[3][:33, :41], frames[3]) > 33
    if suffix == ".mp4":  # what stands over is the outermost row and column once more
        np.testing.assert_allclose(decoded[3][33].astype(int), decoded[3][32], atol=5)
        np.testing.assert_allclose(decoded[3][:, 41].astype(int), decoded[3][:, 40], atol=5)


def test_the_index_of_an_mp4_comes_first(tmp_path: Path) -> None:
    content = film(tmp_path / "a.mp4", moving_picture()).read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


def test_a_gif_starts_over_only_if_it_loops(tmp_path: Path) -> None:
    for loops in (True, False):
        content = film(tmp_path / "a.gif", moving_picture(), loops=loops).read_bytes()
        assert (b"NETSCAPE2.0" in content) == loops


@pytest.mark.parametrize(("fps", "rate"), [(23.976, Fraction(2997, 125)), (30, 30), (12.5, Fraction(25, 2))])
def test_the_frame_rate_is_kept(tmp_path: Path, fps: float, rate: Fraction) -> None:
    assert read(film(tmp_path / "a.mp4", moving_picture(), fps))[2] == rate


@pytest.mark.parametrize(
    ("name", "fps", "most"), [("a.gif", 60, 50), ("a.mp4", 0, 1000), ("a.webm", 1001, 1000)]
)
def test_a_rate_that_the_format_cannot_hold_is_refused(
    tmp_path: Path, name: str, fps: float, most: int
) -> None:
    with pytest.raises(ValueError, match=rf"fps must be above 0 and at most {most} for \.\w+, got {fps}"):
        film(tmp_path / name, moving_picture(), fps)
    assert list(tmp_path.iterdir()) == []


def test_a_size_that_h264_cannot_hold_is_refused(tmp_path: Path) -> None:
    wide = [np.zeros((2, 16385, 3), np.uint8)]
    with pytest.raises(ValueError, match=r"at most 16384 pixels wide and high, got 16385x2; use \.webm"):
        film(tmp_path / "a.mp4", wide)
    assert list(tmp_path.iterdir()) == []
    assert len(read(film(tmp_path / "a.webm", wide))[0]) == 1


@pytest.mark.parametrize("suffix", VIDEO_SUFFIXES)
@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_a_video_that_is_not_finished_leaves_what_was_there(
    tmp_path: Path, suffix: str, error: type[BaseException]
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text("old")

    def stop() -> None:
        with open_video(path, width=WIDTH, height=HEIGHT, fps=24) as reel:
            reel.add(moving_picture()[0])
            raise error

    with pytest.raises(error):
        stop()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_what_cannot_be_written_is_reported(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"the folder .*nowhere does not exist; create it first"):
        film(tmp_path / "nowhere" / "a.mp4", moving_picture())


# ---- the colours of a GIF


def test_few_colours_are_kept_as_they_are() -> None:
    colors = np.random.default_rng(1).integers(0, 256, (200, 3), dtype=np.uint8)
    counts = ColorCounts()
    counts.add(colors[None])
    kept = counts.palette(255)
    assert {tuple(color) for color in kept} == {tuple(color) for color in colors}


def test_a_small_bright_patch_and_the_ground_keep_their_colour() -> None:
    rng = np.random.default_rng(2)
    frame = np.clip(rng.normal((90, 100, 110), 25, (200, 300, 3)), 0, 255).astype(np.uint8)
    frame[:100] = (250, 248, 241)  # the ground, the most frequent colour
    frame[150:154, 20:24] = (200, 10, 30)  # 1 of 3750 pixels
    counts = ColorCounts()
    counts.add(frame)
    palette = counts.palette(255).astype(int)
    assert len(palette) <= 255
    assert np.abs(palette - (250, 248, 241)).sum(axis=1).min() == 0
    assert np.abs(palette - (200, 10, 30)).max(axis=1).min() <= 4
    errors = np.sqrt(((frame[::4, ::4].reshape(-1, 1, 3).astype(int) - palette) ** 2).sum(-1).min(1))
    assert errors.mean() < 8


def test_colours_of_all_pictures_count() -> None:
    counts = ColorCounts()
    for color in ((255, 0, 0), (0, 0, 255)):
        counts.add(np.full((4, 4, 3), color, np.uint8))
    assert counts.palette(255).tolist() == [[0, 0, 255], [255, 0, 0]]


def test_frames_of_a_sequence_become_a_video(tmp_path):
    frames = [
        bg.Frame(np.full((48, 64, 3), 0.1 * k, np.float32), np.full((48, 64), 0.5, np.float32))
        for k in range(5)
    ]
    bg.save_video(iter(frames), tmp_path / "a.mp4", fps=12, background=(0, 0, 1))
    with av.open(tmp_path / "a.mp4") as video:
        assert video.streams.video[0].average_rate == 12
        pictures = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert len(pictures) == 5
    for k, picture in enumerate(pictures):
        expected = 255 * np.clip([0.1 * k, 0.1 * k, 0.1 * k + 0.5], 0, 1)
        np.testing.assert_allclose(picture.mean(axis=(0, 1)), expected, atol=4)


@pytest.mark.parametrize(
    ("sizes", "name", "words"),
    [
        ([], "a.mp4", "frames must hold at least one, got none"),
        ([(4, 6), (6, 4)], "a.gif", "frames must have one size, got 6x4 and 4x6"),
        ([(4, 6)], "a.avi", "path must end in .*, got '.*a.avi'"),
    ],
)
def test_frames_that_make_no_video_are_refused_and_nothing_is_left(tmp_path, sizes, name, words):
    frames = [bg.Frame(np.zeros((*size, 3), np.float32), np.zeros(size, np.float32)) for size in sizes]
    with pytest.raises(ValueError, match=words):
        bg.save_video(frames, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
