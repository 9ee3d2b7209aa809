"""StrokeTexture: names, files of every kind, arrays, and what is refused."""

from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from PIL import Image

from brushgs.brushes.texture import StrokeTexture, builtin_names, variants_of, without_number
from brushgs.errors import SceneError, SceneWarning
from tests.kit.for_each import for_each


def write_image(path, pixels):
    """Write [H, W, C] floats as 8 bits, or whole numbers as they are, with straight alpha."""
    if np.issubdtype(pixels.dtype, np.floating):
        pixels = np.rint(pixels * 255).astype(np.uint8)
    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], pixels.dtype.name)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    out = OpenImageIO.ImageOutput.create(str(path))
    assert out.open(str(path), spec)
    assert out.write_image(np.ascontiguousarray(pixels))
    out.close()
    return path


def blob(height, width):
    """A soft ellipse of coverage that fades to 0 within the picture, with a bare border of 10 %."""
    y, x = np.meshgrid(np.linspace(-1.1, 1.1, height), np.linspace(-1.1, 1.1, width), indexing="ij")
    return np.clip(1.5 - 1.5 * (x**2 + y**2), 0, 1)


def rgba(coverage, color=(0.2, 0.4, 0.6)):
    return np.dstack([np.broadcast_to(color, (*coverage.shape, 3)), coverage])


@pytest.mark.parametrize("spelling", ["dry_brush", "Dry Brush", "dry-brush"])
def test_a_builtin_name_is_found_however_it_is_written(spelling, folder):
    texture = StrokeTexture.open(spelling)
    assert (texture.kind, texture.name) == ("image", "dry_brush")
    assert texture.height.shape == texture.coverage.shape


@pytest.mark.parametrize("name", ["swirl.png", "./swirl.png", Path("swirl.png")])
def test_a_suffix_or_a_folder_means_a_file(folder, name):
    sentence = r"swirl\.png: there is no such file; for the built-in .* write swirl$"
    with pytest.raises(SceneError, match=sentence):
        StrokeTexture.open(name)
    write_image(folder / "swirl.png", rgba(np.ones((3, 5)) * [1, 1, 1, 1, 0.5]))
    assert StrokeTexture.open(name).coverage.shape == (3, 5)
    assert StrokeTexture.open("swirl").coverage.shape != (3, 5)


def test_a_stroke_is_taken_by_name_path_or_as_it_is(tmp_path):
    path = write_image(tmp_path / "a.png", rgba(blob(20, 30)))
    opened = StrokeTexture.open("flat")
    assert StrokeTexture.of(opened) is opened
    assert np.array_equal(StrokeTexture.of("flat").coverage, opened.coverage)
    assert StrokeTexture.of(str(path)).name == StrokeTexture.of(path).name == "a"
    with pytest.raises(TypeError, match=r"texture must be a StrokeTexture, the name .* array, got int"):
        StrokeTexture.of(5)
    assert np.array_equal(StrokeTexture.of(opened.coverage).coverage, opened.coverage)


def test_a_built_in_stroke_has_variants_by_number():
    names = builtin_names()
    assert "flat_2" not in names
    assert variants_of("flat") == ["flat", "flat_2", "flat_3", "flat_4"]
    assert variants_of("Dry Brush") == ["dry_brush", "dry_brush_2", "dry_brush_3"]
    assert (variants_of("swirl"), variants_of("gaussian")) == (["swirl"], ["gaussian"])
    assert (variants_of("flat_1"), variants_of("flat-3")) == (["flat"], ["flat_3"])
    for name in ("flat_9", "flat.png", "./flat", "flower_of_mine", "_1", "swril"):
        assert variants_of(name) == []
    assert {without_number(name) for name in variants_of("palette_knife")} == {"palette_knife"}
    first, second = StrokeTexture.open("flat_1"), StrokeTexture.open("Flat 2")
    assert (first.name, second.name) == ("flat", "flat_2")
    np.testing.assert_array_equal(first.coverage, StrokeTexture.open("flat").coverage)
    assert not np.array_equal(first.coverage, second.coverage)
    with pytest.raises(SceneError, match=r"^flat_9: neither a file .*did you mean 'flat'"):
        StrokeTexture.open("flat_9")


def test_alpha_is_the_coverage_and_luminance_the_height(tmp_path):
    coverage = blob(30, 50)
    texture = StrokeTexture.open(write_image(tmp_path / "a.png", rgba(coverage)))
    rows, columns = np.flatnonzero(coverage.any(1)), np.flatnonzero(coverage.any(0))
    expected = np.rint(coverage[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] * 255)
    kept = texture.coverage.shape
    assert kept[0] <= expected.shape[0] < 30
    top, left = (expected.shape[0] - kept[0]) // 2, (expected.shape[1] - kept[1]) // 2
    assert np.array_equal(texture.coverage, expected[top : top + kept[0], left : left + kept[1]])
    relief = 0.2126 * 0.2 + 0.7152 * 0.4 + 0.0722 * 0.6
    assert texture.height[texture.coverage > 0] == pytest.approx(relief, abs=0.002)
    assert np.all(texture.height[texture.coverage == 0] == 0.5)
    assert texture.height.dtype == np.float32


@pytest.mark.parametrize("is_dark_on_light", [True, False])
@pytest.mark.parametrize("num_channels", [1, 3, 4])
def test_without_transparency_the_border_tells_paint_from_ground(tmp_path, is_dark_on_light, num_channels):
    coverage = blob(40, 60)
    grey = 1 - 0.8 * coverage if is_dark_on_light else 0.1 + 0.7 * coverage
    pixels = np.repeat(grey[..., None], num_channels, axis=2)
    if num_channels == 4:
        pixels[..., 3] = 1
    texture = StrokeTexture.open(write_image(tmp_path / "a.png", pixels))
    assert texture.height is None
    assert texture.coverage.sum() / 255 == pytest.approx(coverage.sum() / coverage.max(), rel=0.01)


def test_a_large_image_is_averaged_down_and_keeps_aspect_and_paint(tmp_path):
    coverage = np.kron(np.random.default_rng(0).random((100, 250)) > 0.3, np.ones((4, 4)))
    coverage *= np.linspace(1, 0.2, 1000)
    path = write_image(tmp_path / "a.png", rgba(coverage))
    texture = StrokeTexture.open(path)
    assert texture.coverage.shape == (102, 256)
    assert texture.coverage.mean() / 255 == pytest.approx(coverage.mean(), abs=0.003)
    assert StrokeTexture.open(path, size=64).coverage.shape == (26, 64)


def test_a_flat_opaque_image_paints_a_rectangle_and_says_so(tmp_path):
    path = write_image(tmp_path / "a.png", rgba(np.ones((2, 3))))
    with pytest.warns(SceneWarning, match="one flat tone and no transparency, so it paints a solid"):
        texture = StrokeTexture.open(path)
    assert np.array_equal(texture.coverage, np.full((2, 3), 255))


def test_a_texture_cannot_be_changed_from_outside():
    array = np.zeros((2, 2), np.uint8)
    texture = StrokeTexture.from_coverage(array)
    array[0, 0] = 9
    assert texture.coverage[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        texture.coverage[0, 0] = 1
    with pytest.raises(ValueError, match="read-only"):
        StrokeTexture.open("flat").height[0, 0] = 1


def test_a_small_image_of_any_kind_is_taken_texel_by_texel(tmp_path):
    """Of 8 and 16 bits, in PNG and TIFF, with a palette."""
    row = np.array([[0.2, 1.0, 0.6]])
    for suffix, pixels in (
        ("png", rgba(row)),
        ("tif", rgba(row)),
        ("png", np.rint(rgba(row) * 65535).astype(np.uint16)),
        ("png", np.dstack([0.7 + 0 * row, row])),
    ):
        texture = StrokeTexture.open(write_image(tmp_path / f"a.{suffix}", pixels))
        assert np.array_equal(texture.coverage, [[51, 255, 153]])
    assert texture.height == pytest.approx(0.7, abs=0.002)
    whole = np.array([[0, 7], [255, 3]], np.uint8)
    assert np.array_equal(StrokeTexture.from_coverage(whole).coverage, whole)
    assert np.array_equal(StrokeTexture.from_coverage(row).coverage, [[51, 255, 153]])
    palette = np.ones((4, 4), np.uint8)
    palette[1, 1:3] = palette[2, 1] = 0
    picture = Image.fromarray(palette, mode="P")
    picture.putpalette([0, 0, 0, 255, 255, 255])
    picture.save(tmp_path / "p.png")
    assert np.array_equal(StrokeTexture.open(tmp_path / "p.png").coverage, [[255, 255], [255, 0]])
    dark = write_image(tmp_path / "d.png", (0.45 - 0.4 * blob(20, 30))[..., None])  # on a dark ground
    coverage = StrokeTexture.open(dark).coverage
    assert coverage[coverage.shape[0] // 2, coverage.shape[1] // 2] == 255


@for_each(
    ("texture", "sigmas"),
    [
        (StrokeTexture.from_coverage(np.full((8, 8), 0.1)), 2.0),
        (StrokeTexture.from_coverage(np.zeros((8, 8))), 2.0),
        (StrokeTexture.open("gaussian"), 3.0),
        (StrokeTexture.open("ellipse"), 2.0),
        *((StrokeTexture.from_coverage(np.full((8, 8), mean)), None) for mean in (0.6, 0.7, 1.0)),
    ],
)
def test_a_fitted_stroke_paints_as_much_as_its_gaussian_and_a_little_more(texture, sigmas):
    """Unless that were more than the texture's own extent."""
    painted = (2 * texture.fitted_sigmas) ** 2 * texture.coverage.mean() / 255
    if sigmas is None:
        assert painted == pytest.approx(1.2**2 * 2 * np.pi)
    else:
        assert texture.fitted_sigmas == texture.num_sigmas == sigmas


NO_FILE = r"there is no such picture; check the path$"


@for_each(
    ("name", "message"),
    [
        *((name, NO_FILE) for name in ("missing.png", "somewhere/brush.png", "./gaussain", "brush.tiff")),
        ("swril", r"^swril: neither a file .* gaussian, ellipse, .*mean 'swirl'\?$"),
        ("missing", r"^missing: neither a file [^;]*$"),  # no name is near
        ("bare.png", r"bare\.png: the stroke is fully transparent; give"),
        ("text.png", r"text\.png: cannot be read as a picture"),
    ],
)
def test_what_is_no_stroke_is_refused(folder, name, message):
    write_image(folder / "bare.png", rgba(np.zeros((8, 8))))
    (folder / "text.png").write_text("not a picture")
    with pytest.raises(SceneError, match=message):
        StrokeTexture.open(name)


@for_each(
    ("array", "error", "message"),
    [
        (np.array([[0.5, np.nan]]), ValueError, r"must lie in 0 to 1, got 1 texels .* first nan at \[0, 1\]"),
        (np.array([[0.5, 2.0]]), ValueError, r"must lie in 0 to 1, got 1 texels .* first 2.0 at \[0, 1\]"),
        (np.zeros((2, 2), np.int64), TypeError, "must be uint8 or floating, got int64"),
        (np.zeros(4, np.uint8), ValueError, r"coverage must have shape \[h=4, w\], got \[4\]"),
        (np.zeros((0, 4), np.uint8), ValueError, r"coverage must have texels, got \[0, 4\]"),
        ([[1.0]], TypeError, "coverage must be a NumPy array, got list"),
        ({"kind": "blob"}, ValueError, "kind must be one of gaussian, ellipse, image, got 'blob'"),
        ({"num_sigmas": 0.0}, ValueError, "num_sigmas must be > 0, got 0.0"),
        ({"coverage": np.zeros((2, 2))}, TypeError, "coverage must be uint8, got float64"),
        ({"height": np.zeros((2, 2))}, TypeError, "height must be float32, got float64"),
        ({"height": np.zeros((2, 3), np.float32)}, ValueError, r"height must have shape \[h=2, w=2\]"),
    ],
)
def test_a_bad_array_or_field_is_refused_by_name(array, error, message):
    good = {"kind": "image", "name": "n", "coverage": np.zeros((2, 2), np.uint8)}
    with pytest.raises(error, match=message):
        StrokeTexture(**good | array) if isinstance(array, dict) else StrokeTexture.from_coverage(array)
    with pytest.raises(ValueError, match="size must be at least 1, got 0"):
        StrokeTexture.open("flat", size=0)
