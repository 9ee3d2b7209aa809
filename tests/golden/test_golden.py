"""The kernel against the golden pictures, alone and in several threads, in float32 and float64.

The pictures are made by the float64 reference (`python -m tests.golden.regenerate`); no test writes one.
Where one fails, what was painted, what should have been and ten times the difference lie in `failed/`.
"""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.light import light
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.relief import Relief
from brushgs.still_life import still_life_camera
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.golden.cases import CASES, FOLDER, HEIGHT, NUM_STROKES, WIDTH, Case, scene
from tests.kit.for_each import for_each

MEAN_LIMIT = 0.1  # steps of 8 bits
FAR = 2  # steps; at most FAR_SHARE of the pixels may be further off
FAR_SHARE = 0.001
MAX_BYTES = 50 * 1024


def kernel_frame(case: Case, dtype: type[np.floating], num_threads: int) -> Frame:
    texture = case.texture
    boxes = case.boxes(texture.num_sigmas)
    if case.surface is not None:
        return canvas_frame(case, boxes.astype(dtype), num_threads)
    size, look = {"width": WIDTH, "height": HEIGHT}, {"underpaint": case.underpaint, "streaks": case.streaks}
    look |= {"filter": case.filter, "relief": case.lamp is not None, "num_threads": num_threads}
    frame = rasterize(boxes.astype(dtype), texture, **size, **look)
    if frame.height is None:
        return frame
    lit = light(frame.rgb, frame.height, case.lamp, alpha=frame.alpha, num_threads=num_threads)
    return replace(frame, rgb=lit)


def canvas_frame(case: Case, boxes: Boxes, num_threads: int) -> Frame:
    """The boxes laid on a surface, as paintings are."""
    relief = None if case.lamp is None else Relief()
    options = RenderOptions.of(case.texture, filter=case.filter, relief=relief, num_threads=num_threads)
    canvas = Painting((), case.surface()).canvas(still_life_camera(width=WIDTH, height=HEIGHT))
    canvas.lay(Coat("golden", scene(NUM_STROKES), case.texture, options, blend=case.blend), boxes)
    return canvas.finish(case.lamp)


def decoded(path) -> np.ndarray:
    """[H, W, 3 or 4] in steps of 8 bits, color premultiplied: faint pixels count by what they show."""
    pixels = 255 * read_image(path).astype(np.float64)
    if pixels.shape[2] == 4:
        pixels[..., :3] *= pixels[..., 3:] / 255
    return pixels


def difference(actual: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Mean difference in steps, and the share of pixels off by more than `FAR`."""
    off = np.abs(actual - expected)
    return float(off.mean()), float((off.max(axis=2) > FAR).mean())


def keep_evidence(name: str, actual: np.ndarray, expected: np.ndarray) -> None:
    folder = FOLDER / "failed"
    folder.mkdir(exist_ok=True)
    pictures = {"actual": actual, "expected": expected, "difference_x10": 10 * np.abs(actual - expected)}
    for kind, steps in pictures.items():
        rgb = np.clip(steps[..., :3] / 255, 0, 1)
        write_frame(Frame(rgb, np.ones(rgb.shape[:2])), folder / f"{name}_{kind}.png", (0, 0, 0))


@for_each(("dtype", "num_threads"), [(np.float32, 1), (np.float64, 3)])
@pytest.mark.parametrize("name", CASES)
def test_kernel_paints_the_golden_picture(name, dtype, num_threads, tmp_path):
    case = CASES[name]
    write_frame(kernel_frame(case, dtype, num_threads), tmp_path / "actual.png", case.background)
    actual, expected = decoded(tmp_path / "actual.png"), decoded(FOLDER / f"{name}.png")
    assert actual.shape == expected.shape == (HEIGHT, WIDTH, 4 if case.background is None else 3)
    mean, far = difference(actual, expected)
    print(f"golden {name} {dtype.__name__} {num_threads} threads: mean {mean:.4f}, far {far:.2%}")
    if mean > MEAN_LIMIT or far > FAR_SHARE:
        keep_evidence(name, actual, expected)
    assert mean <= MEAN_LIMIT, f"see {FOLDER / 'failed'}"
    assert far <= FAR_SHARE, f"see {FOLDER / 'failed'}"


def test_golden_pictures_tell_strokes_and_filters_apart():
    """No case would pass for another: the limits can fail. Nearest of all are bilinear and mip."""
    files = {path.stem: path for path in FOLDER.glob("*.png")}
    assert set(files) == set(CASES)
    assert all(path.stat().st_size < MAX_BYTES for path in files.values())
    pictures = {name: decoded(path)[..., :3] for name, path in files.items()}
    for name, picture in pictures.items():
        for other, other_picture in pictures.items():
            mean, far = difference(picture, other_picture)
            assert name == other or (mean > 10 * MEAN_LIMIT and far > 100 * FAR_SHARE), (name, other)


def test_a_pixel_of_shift_or_a_change_of_tone_would_be_caught():
    expected = decoded(FOLDER / "gaussian.png")  # the smoothest: the hardest to catch
    for wrong in (np.roll(expected, 1, axis=1), expected + 0.2, expected[:, ::-1], 0.99 * expected):
        mean, far = difference(wrong, expected)
        assert mean > MEAN_LIMIT or far > FAR_SHARE
