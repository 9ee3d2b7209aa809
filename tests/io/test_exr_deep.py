"""Deep OpenEXR files, as OpenImageIO and a strict reader of the tests' own read them."""

import tempfile
from pathlib import Path, PurePath

import numpy as np
import OpenImageIO
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brushgs import Camera, Frame, SceneError
from brushgs.formats.pictures.images import encode_frame, read_image, write_frame
from brushgs.formats.pictures.shot import Shot
from brushgs.values.layers import DeepSamples
from tests.io.exr_reader import read_header


def make_frame(height: int = 9, width: int = 13, most: int = 6, seed: int = 0) -> Frame:
    """A frame whose pixels hold 0 to `most` samples, with the picture that they are."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, height * width)
    starts = np.concatenate([[0], np.cumsum(counts)])
    num_samples = int(starts[-1])
    alphas = rng.random(num_samples).astype(np.float32)
    colors = (rng.random((num_samples, 3)) * alphas[:, None]).astype(np.float32)
    rank = np.arange(num_samples) - np.repeat(starts[:-1], counts)
    depths = (rank + rng.random(num_samples)).astype(np.float32) + 1
    ids = rng.integers(0, 2**32, num_samples, dtype=np.uint32)
    rgb, alpha = np.zeros((height * width, 3)), np.zeros(height * width)
    for pixel in range(height * width):
        for sample in range(starts[pixel], starts[pixel + 1]):
            rgb[pixel] += (1 - alpha[pixel]) * colors[sample]
            alpha[pixel] += (1 - alpha[pixel]) * alphas[sample]
    deep = DeepSamples(starts, colors, alphas, depths, ids, height, width)
    return Frame(
        rgb.reshape(height, width, 3).astype(np.float32),
        alpha.reshape(height, width).astype(np.float32),
        deep=deep,
    )


def stored(path: Path) -> tuple[OpenImageIO.ImageSpec, OpenImageIO.DeepData]:
    source = OpenImageIO.ImageInput.open(str(path))
    assert source is not None, OpenImageIO.geterror()
    spec = source.spec()
    data = source.read_native_deep_image()
    assert data is not None, source.geterror()
    source.close()
    return spec, data


def sample_values(spec: OpenImageIO.ImageSpec, data: OpenImageIO.DeepData) -> dict[str, np.ndarray]:
    """The samples by channel, pixel after pixel."""
    values = {}
    for channel, name in enumerate(spec.channelnames):
        read = data.deep_value_uint if name == "id" else data.deep_value
        values[name] = np.array(
            [read(p, channel, s) for p in range(data.pixels) for s in range(data.samples(p))],
            np.uint32 if name == "id" else np.float32,
        )
    return values


@pytest.mark.parametrize("size", [(9, 13, 6), (1, 1, 1), (1, 40, 200), (50, 1, 3), (4, 4, 0)])
def test_samples_read_back_exactly(tmp_path: Path, size: tuple[int, int, int]) -> None:
    deep = make_frame(*size).deep
    write_frame(make_frame(*size), tmp_path / "a.exr")
    spec, data = stored(tmp_path / "a.exr")
    assert spec.deep
    assert (spec.height, spec.width) == size[:2]
    assert [data.samples(p) for p in range(data.pixels)] == np.diff(deep.starts).tolist()
    values = sample_values(spec, data)
    for i, name in enumerate("RGB"):
        np.testing.assert_array_equal(values[name], deep.colors[:, i].astype(np.float16))
    np.testing.assert_array_equal(values["A"], deep.alphas.astype(np.float16))
    np.testing.assert_array_equal(values["Z"], deep.depths)
    np.testing.assert_array_equal(values["id"], deep.ids)


@given(st.integers(1, 5), st.integers(1, 30), st.integers(0, 40), st.booleans())
@settings(max_examples=25, deadline=None)
@example(1, 1, 0, True)
@example(3, 30, 40, True)  # equal samples: compressed
def test_samples_of_any_shape_read_back(height: int, width: int, most: int, is_even: bool) -> None:
    frame = make_frame(height, width, most)
    deep = frame.deep
    if is_even:
        flat = np.ones_like(deep.alphas)
        deep = DeepSamples(deep.starts, deep.colors * 0, flat, flat, deep.ids * 0, height, width)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.exr"
        write_frame(Frame(frame.rgb, frame.alpha, deep=deep), path)
        values = sample_values(*stored(path))
    np.testing.assert_array_equal(values["Z"], deep.depths)
    np.testing.assert_array_equal(values["id"], deep.ids)
    np.testing.assert_array_equal(values["A"], deep.alphas.astype(np.float16))


def test_samples_laid_over_each_other_in_order_are_the_picture(tmp_path: Path) -> None:
    frame = make_frame()
    write_frame(frame, tmp_path / "a.exr")
    spec, data = stored(tmp_path / "a.exr")
    at = {name: spec.channelnames.index(name) for name in "RGBA"}
    for pixel in range(data.pixels):
        color, alpha = np.zeros(3), 0.0
        for sample in range(data.samples(pixel)):
            color += (1 - alpha) * np.array([data.deep_value(pixel, at[name], sample) for name in "RGB"])
            alpha += (1 - alpha) * data.deep_value(pixel, at["A"], sample)
        y, x = divmod(pixel, spec.width)
        np.testing.assert_allclose(color, frame.rgb[y, x], atol=1e-3)
        assert alpha == pytest.approx(frame.alpha[y, x], abs=1e-3)


def test_the_header_says_what_it_is(tmp_path: Path) -> None:
    seen = Camera.look_at((0, 0, -3), (0, 0, 0), width=13, height=9)
    write_frame(make_frame(), tmp_path / "a.exr", shot=Shot(seen, 12, 25.0))
    header = read_header(tmp_path / "a.exr")
    assert header.version == 2 | 1 << 11  # single part, deep
    assert header.channels == dict.fromkeys("ABGR", "half") | {"Z": "float", "id": "uint"}
    assert list(header.attributes) == sorted(header.attributes)
    assert header.attributes["type"] == ("string", "deepscanline")
    assert header.attributes["version"] == ("int", 1)
    assert header.attributes["chunkCount"] == ("int", 9)
    assert header.attributes["maxSamplesPerPixel"] == ("int", 6)
    assert header.attributes["compression"] == ("compression", 2)  # ZIP of single rows
    assert header.attributes["colorInteropID"] == ("string", "srgb_rec709_scene")
    assert header.attributes["imageCounter"] == ("int", 12)
    assert "display-encoded" in header.value("brushgs/RGBA")
    assert "number of the stroke" in header.value("brushgs/id")
    spec, _ = stored(tmp_path / "a.exr")
    assert spec.getattribute("worldToCamera") == pytest.approx(header.value("worldToCamera"))
    assert spec.getattribute("framesPerSecond") == (25, 1)


def test_the_header_says_where_the_names_of_the_strokes_are(tmp_path: Path) -> None:
    write_frame(make_frame(), tmp_path / "a.exr", shot=Shot(manifest=PurePath("..") / "a.json"))
    write_frame(make_frame(), tmp_path / "b.exr")
    note = "names of the strokes, id 1 first, stand in the file ../a.json"
    assert read_header(tmp_path / "a.exr").value("brushgs/names") == note
    assert "brushgs/names" not in read_header(tmp_path / "b.exr").attributes


def test_flat_and_deep_files_state_the_same_camera(tmp_path: Path) -> None:
    frame = make_frame()
    shot = Shot(Camera.look_at((1, 2, -3), (0, 0, 0), width=13, height=9), 12, 23.976)
    write_frame(frame, tmp_path / "deep.exr", shot=shot)
    write_frame(Frame(frame.rgb, frame.alpha), tmp_path / "flat.exr", shot=shot)
    deep, flat = (read_header(tmp_path / name).attributes for name in ("deep.exr", "flat.exr"))
    for name in (
        "worldToCamera",
        "worldToNDC",
        "cameraFov",
        "imageCounter",
        "framesPerSecond",
        "chromaticities",
    ):
        assert deep[name] == flat[name]


def test_numbers_beyond_half_floats_stay_finite(tmp_path: Path) -> None:
    frame = make_frame()
    deep = frame.deep
    bright = DeepSamples(deep.starts, deep.colors * 1e9, deep.alphas, deep.depths, deep.ids, 9, 13)
    write_frame(Frame(frame.rgb, frame.alpha, deep=bright), tmp_path / "a.exr")
    assert sample_values(*stored(tmp_path / "a.exr"))["R"].max() == 65504


def test_equal_frames_give_equal_bytes() -> None:
    assert encode_frame(make_frame(), ".exr") == encode_frame(make_frame(), ".exr")


def test_deep_files_are_not_read_as_pictures(tmp_path: Path) -> None:
    write_frame(make_frame(), tmp_path / "a.exr")
    with pytest.raises(SceneError, match="holds a volume or deep pixels; save it as a flat picture"):
        read_image(tmp_path / "a.exr")


def test_other_formats_take_the_flat_picture_of_a_deep_frame(tmp_path: Path) -> None:
    frame = make_frame()
    write_frame(frame, tmp_path / "a.png")
    np.testing.assert_allclose(read_image(tmp_path / "a.png")[..., 3], frame.alpha, atol=0.5 / 255 + 1e-6)


def test_a_failed_write_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(data: bytes, level: int) -> bytes:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("brushgs.formats.pictures.exr.zlib.compress", full)
    with pytest.raises(SceneError, match=r"a\.exr: cannot be written \(No space left on device\); check"):
        write_frame(make_frame(), tmp_path / "a.exr")
    assert list(tmp_path.iterdir()) == []
