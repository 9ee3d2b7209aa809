"""Deep OpenEXR files, as OpenImageIO and a strict reader of the tests' own read them."""

import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brushgs import Camera, Frame
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.values.layers import DeepSamples
from brushgs.values.shot import Shot
from tests.io.exr_reader import read_header
from tests.kit.refusals import refuse


def make_frame(height: int = 9, width: int = 13, most: int = 6, seed: int = 0) -> Frame:
    """A frame whose pixels hold 0 to `most` samples."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, most + 1, height * width)
    starts = np.concatenate([[0], np.cumsum(counts)])
    num_samples = int(starts[-1])
    alphas = rng.random(num_samples).astype(np.float32)
    colors = (rng.random((num_samples, 3)) * alphas[:, None]).astype(np.float32)
    rank = np.arange(num_samples) - np.repeat(starts[:-1], counts)
    depths = (rank + rng.random(num_samples)).astype(np.float32) + 1
    ids = rng.integers(0, 2**32, num_samples, dtype=np.uint32)
    deep = DeepSamples(starts, colors, alphas, depths, ids, height, width)
    return Frame(np.zeros((height, width, 3), np.float32), np.zeros((height, width), np.float32), deep=deep)


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
        read, kind = (data.deep_value_uint, "u4") if name == "id" else (data.deep_value, "f4")
        every = [read(p, channel, s) for p in range(data.pixels) for s in range(data.samples(p))]
        values[name] = np.array(every, kind)
    return values


@given(st.integers(1, 5), st.integers(1, 30), st.integers(0, 40), st.booleans())
@settings(max_examples=25, deadline=None)
@example(1, 1, 0, True)
@example(3, 30, 40, True)  # equal samples: compressed
def test_samples_of_any_shape_read_back(height, width, most, is_even):
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
    for channel, name in enumerate("RGB"):
        np.testing.assert_array_equal(values[name], deep.colors[:, channel].astype(np.float16))


def test_the_header_says_what_it_is(tmp_path):
    seen = Camera.look_at((0, 0, -3), (0, 0, 0), width=13, height=9)
    write_frame(make_frame(), tmp_path / "a.exr", shot=Shot(seen, 12, 25.0))
    header = read_header(tmp_path / "a.exr")
    assert header.version == 2 | 1 << 11  # single part, deep
    assert header.channels == dict.fromkeys("ABGR", "half") | {"Z": "float", "id": "uint"}
    assert list(header.attributes) == sorted(header.attributes)
    expected = {"type": "deepscanline", "version": 1, "chunkCount": 9, "maxSamplesPerPixel": 6}
    expected |= {"compression": 2, "colorInteropID": "srgb_rec709_scene", "imageCounter": 12}  # ZIP by rows
    assert {name: header.value(name) for name in expected} == expected
    assert "display-encoded" in header.value("brushgs/RGBA")
    assert "number of the stroke" in header.value("brushgs/id")
    spec, _ = stored(tmp_path / "a.exr")
    assert spec.getattribute("worldToCamera") == pytest.approx(header.value("worldToCamera"))
    assert spec.getattribute("framesPerSecond") == (25, 1)


def test_deep_files_are_not_read_as_pictures_and_a_failed_write_leaves_nothing(tmp_path, monkeypatch):
    path = tmp_path / "a.exr"
    write_frame(make_frame(), path)
    refuse(path, "holds a volume or deep pixels; save it as a flat picture", read_image)
    path.unlink()

    def full(data, level):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("brushgs.formats.pictures.exr.zlib.compress", full)
    sentence = r"a\.exr: cannot be written \(No space left on device\); check"
    refuse(path, sentence, lambda path: write_frame(make_frame(), path))
    assert list(tmp_path.iterdir()) == []
