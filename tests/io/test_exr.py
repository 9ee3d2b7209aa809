"""Flat OpenEXR files: what they hold, by OpenImageIO and by a strict reader of the tests' own."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import OpenImageIO
import pytest

from brushgs import Camera, Frame, SceneError
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.values.colors import linear_from_srgb
from brushgs.values.layers import Matte
from brushgs.values.shot import Shot
from tests.io import test_images
from tests.io.exr_reader import channels_of, read_header
from tests.io.test_images import straight
from tests.kit.for_each import for_each

HEIGHT, WIDTH = 70, 9  # more rows than are written at a time
HALF = 2.0**-11  # the largest relative error of rounding to a half float


def make_frame(*, depth: bool = False, layers: Mapping[str, object] | None = None) -> Frame:
    return replace(test_images.make_frame(HEIGHT, WIDTH, depth=depth), layers=layers or {})


def make_layers() -> dict[str, object]:
    rng = np.random.default_rng(3)

    def values(*shape: int) -> np.ndarray:
        return rng.standard_normal((HEIGHT, WIDTH, *shape)).astype(np.float32)

    unlit = rng.random((HEIGHT, WIDTH, 4))
    unlit[..., :3] *= unlit[..., 3:]
    rows = np.tile(np.int32([1, 0, -1]), (HEIGHT, WIDTH, 1))
    coverage = np.tile(np.float32([0.5, 0.25, 0]), (HEIGHT, WIDTH, 1))
    layers = {"depth": abs(values()), "normal": values(3), "motion": values(2) * 1000, "height": values()}
    layers |= {"uv": rng.random((HEIGHT, WIDTH, 2)).astype(np.float32), "unlit": unlit.astype(np.float32)}
    names = {"stroke": ("a_0", "a_1"), "layer": ("a", "ground")}
    return layers | {name: Matte(some, rows, coverage) for name, some in names.items()}


def camera() -> Camera:
    K = [[50.0, 0, 4.0], [0, 55.0, 30.0], [0, 0, 1]]
    seen = Camera.look_at((1, -2, 3), (0, 0.5, 0.2), (0, -1, 0.3), width=WIDTH, height=HEIGHT)
    return Camera(seen.viewmat, np.array(K), WIDTH, HEIGHT, near=0.1)


# ---- the picture


def test_the_picture_is_premultiplied_linear_light_in_half_floats_and_depth_is_exact(tmp_path):
    frame = make_frame(depth=True)
    write_frame(frame, tmp_path / "a.exr")
    channels = channels_of(tmp_path / "a.exr")
    assert list(channels) == ["R", "G", "B", "A", "Z"]
    light = linear_from_srgb(straight(frame)) * frame.alpha[..., None]
    for i, name in enumerate("RGB"):
        np.testing.assert_allclose(channels[name], light[..., i], rtol=HALF, atol=1e-7)
    np.testing.assert_allclose(channels["A"], frame.alpha, rtol=HALF)
    np.testing.assert_array_equal(channels["Z"], frame.depth)
    header = read_header(tmp_path / "a.exr")
    assert header.channels == dict.fromkeys("ABGR", "half") | {"Z": "float"}
    assert header.version == 2  # single part, scan lines, flat, short names
    assert header.attributes["compression"] == ("compression", 3)  # ZIP of 16 rows
    assert header.value("dataWindow") == header.value("displayWindow") == (0, 0, WIDTH - 1, HEIGHT - 1)
    pixels = read_image(tmp_path / "a.exr")  # display-encoded straight color
    assert pixels.shape == (HEIGHT, WIDTH, 4)
    np.testing.assert_allclose(pixels[..., :3], straight(frame), atol=0.5 / 255)
    np.testing.assert_allclose(pixels[..., 3], frame.alpha, atol=HALF)


@for_each("kind", ["color", "picture"])
def test_on_a_background_alpha_is_1_and_layers_tell_how_much_is_painted(tmp_path, kind):
    ground = np.random.default_rng(1).random((HEIGHT, WIDTH, 3)).astype(np.float32)
    background = (1.0, 0.5, 0.0) if kind == "color" else ground
    frame = make_frame(depth=True)
    write_frame(frame, tmp_path / "a.exr", background)
    channels = channels_of(tmp_path / "a.exr")
    assert list(channels) == ["R", "G", "B", "A", "Z"]
    assert (channels["A"] == 1).all()
    light = linear_from_srgb(frame.over(background))
    np.testing.assert_allclose(channels["G"], light[..., 1], rtol=HALF, atol=1e-7)
    shown = read_image(tmp_path / "a.exr")[..., :3]
    np.testing.assert_allclose(shown, frame.over(background), atol=0.5 / 255)
    layered = make_frame(layers=make_layers())
    write_frame(layered, tmp_path / "b.exr", background)
    channels = channels_of(tmp_path / "b.exr")
    np.testing.assert_allclose(channels["paint.A"], layered.alpha, rtol=HALF)
    assert (channels["unlit.A"] == 1).all()
    unlit = layered.layers["unlit"]
    expected = linear_from_srgb(Frame(unlit[..., :3], unlit[..., 3]).over(background))
    np.testing.assert_allclose(channels["unlit.B"], expected[..., 2], rtol=HALF, atol=1e-7)


# ---- layers


def test_every_layer_stands_under_its_name_with_the_axes_of_compositors(tmp_path):
    layers = make_layers()
    frame = make_frame(layers=layers)
    write_frame(frame, tmp_path / "a.exr")
    channels = channels_of(tmp_path / "a.exr")
    np.testing.assert_array_equal(channels["Z"], layers["depth"])
    for i, (name, sign) in enumerate((("N.X", 1), ("N.Y", -1), ("N.Z", -1))):
        np.testing.assert_allclose(channels[name], sign * layers["normal"][..., i], rtol=HALF)
    np.testing.assert_array_equal(channels["forward.u"], layers["motion"][..., 0])
    np.testing.assert_array_equal(channels["forward.v"], -layers["motion"][..., 1])
    np.testing.assert_allclose(channels["stroke.u"], layers["uv"][..., 0], rtol=HALF)
    np.testing.assert_allclose(channels["stroke.v"], layers["uv"][..., 1], rtol=HALF)
    np.testing.assert_allclose(channels["height.Y"], layers["height"], rtol=HALF)
    unlit = layers["unlit"]
    light = linear_from_srgb(unlit[..., :3] / unlit[..., 3:]) * unlit[..., 3:]
    np.testing.assert_allclose(channels["unlit.R"], light[..., 0], rtol=2 * HALF, atol=1e-7)
    np.testing.assert_allclose(channels["unlit.A"], unlit[..., 3], rtol=HALF)


def test_a_picture_with_many_layers_is_read_though_it_is_large(tmp_path):
    rows = np.zeros((300, 200, 24), np.int32)
    matte = Matte(("a",), rows, np.full(rows.shape, 0.04, np.float32))
    white = np.ones((300, 200, 4), np.float32)
    frame = Frame(white[..., :3], white[..., 3], layers={"stroke": matte})
    write_frame(frame, tmp_path / "a.exr")
    assert read_image(tmp_path / "a.exr", max_pixels=200 * 300 * 5).shape == (300, 200, 4)
    with pytest.raises(SceneError, match=r"holds 52 channels in 200x300 pixels .* its colors only"):
        read_image(tmp_path / "a.exr", max_pixels=200 * 300)


# ---- the header


def test_matrices_stand_in_rows_and_lead_to_the_pixel(tmp_path):
    seen = camera()
    write_frame(make_frame(), tmp_path / "a.exr", shot=Shot(seen))
    header = read_header(tmp_path / "a.exr")
    point = seen.position + seen.viewmat[2, :3] * 5 + np.array([0.2, 0.1, -0.3])
    x, y, z = seen.viewmat[:3, :3] @ point + seen.viewmat[:3, 3]  # right, down, forward
    to_camera, to_ndc = (header.value(name) for name in ("worldToCamera", "worldToNDC"))
    # OpenEXR: row vectors; x right, y up, z in the direction of view.
    np.testing.assert_allclose([*point, 1] @ np.reshape(to_camera, (4, 4)), [x, -y, z, 1], atol=1e-5)
    left, top, between, w = [*point, 1] @ np.reshape(to_ndc, (4, 4))
    pixel = seen.K[0, 0] * x / z + seen.K[0, 2], seen.K[1, 1] * y / z + seen.K[1, 2]
    np.testing.assert_allclose((left / w * WIDTH, top / w * HEIGHT), pixel, atol=1e-4)
    assert between / w == pytest.approx(1 - 0.1 / z, abs=1e-5)
    assert header.value("cameraFov") == pytest.approx(2 * np.degrees(np.arctan(WIDTH / 2 / 50)))
    spec = OpenImageIO.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.getattribute("worldToCamera") == pytest.approx(to_camera)


@for_each(
    ("fps", "rate"),
    [(24, (24, 1)), (23.976, (24000, 1001)), (24000 / 1001, (24000, 1001)), (12.5, (25, 2)), (0.5, (1, 2))],
)
def test_rates_are_fractions(tmp_path, fps, rate):
    write_frame(make_frame(), tmp_path / "a.exr", shot=Shot(fps=fps, number=7))
    header = read_header(tmp_path / "a.exr")
    assert header.attributes["framesPerSecond"] == ("rational", rate)
    assert header.attributes["imageCounter"] == ("int", 7)
    with pytest.raises(ValueError, match="Shot: fps must be > 0, got 0"):
        Shot(fps=0)


def test_colors_and_conventions_are_stated(tmp_path):
    write_frame(make_frame(layers=make_layers()), tmp_path / "a.exr", (1.0, 1.0, 1.0))
    header = read_header(tmp_path / "a.exr")
    assert header.value("chromaticities") == pytest.approx((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    assert header.attributes["colorInteropID"] == ("string", "lin_rec709_scene")
    assert header.value("Software").startswith("brushgs ")
    layers = {"RGBA", "Z", "N", "forward", "stroke", "height", "unlit", "paint"}
    notes = {name for name in header.attributes if name.startswith("brushgs/")}
    assert notes == {f"brushgs/{layer}" for layer in layers}
    assert "blended display-encoded" in header.value("brushgs/RGBA")
    assert "z toward the camera" in header.value("brushgs/N")
    assert "u right, v up" in header.value("brushgs/forward")
