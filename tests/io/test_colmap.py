"""COLMAP sparse models that the tests write, in both forms, whole and damaged."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from brushgs import SceneWarning
from brushgs.formats import load_cameras
from brushgs.formats.cameras.colmap import MODELS
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

NUMBER_OF = {name: number for number, (name, _) in enumerate(MODELS)}
PINHOLE = (1, "PINHOLE", 640, 480, (500.0, 510.0, 300.5, 250.25))
FORMS = ("bin", "txt")


@dataclass
class Image:
    name: str = "a.jpg"
    quat: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    translation: tuple[float, ...] = (1.0, 2.0, 3.0)
    camera_id: int = 1
    points: list[tuple[float, float, int]] = field(default_factory=list)


IMAGE = Image()


def write(folder: Path, form: str, cameras=(PINHOLE,), images=(IMAGE,)) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for other in FORMS:
        for stem in ("cameras", "images"):
            (folder / f"{stem}.{other}").unlink(missing_ok=True)
    if form == "bin":
        data = struct.pack("<Q", len(cameras))
        for number, model, width, height, values in cameras:
            data += struct.pack("<iiQQ", number, NUMBER_OF.get(model, 99), width, height)
            data += struct.pack(f"<{len(values)}d", *values)
        (folder / "cameras.bin").write_bytes(data)
        data = struct.pack("<Q", len(images))
        for row, image in enumerate(images):
            data += struct.pack("<i7di", row + 1, *image.quat, *image.translation, image.camera_id)
            data += image.name.encode() + b"\0" + struct.pack("<Q", len(image.points))
            data += b"".join(struct.pack("<ddq", *point) for point in image.points)
        (folder / "images.bin").write_bytes(data)
    else:
        lines = ["# Camera list with one line of data per camera:"]
        for number, model, width, height, values in cameras:
            lines.append(f"{number} {model} {width} {height} {' '.join(map(repr, values))}")
        (folder / "cameras.txt").write_text("\n".join(lines) + "\n")
        lines = ["# Image list with two lines of data per image:", "#   IMAGE_ID, QW, ...", ""]
        for row, image in enumerate(images):
            pose = " ".join(map(repr, (*image.quat, *image.translation)))
            lines.append(f"{row + 1} {pose} {image.camera_id} {image.name}")
            lines.append(" ".join(f"{x!r} {y!r} {number}" for x, y, number in image.points))
        (folder / "images.txt").write_text("\n".join(lines) + "\n")
    return folder


quats = st.tuples(*[st.floats(-2, 2)] * 4).filter(lambda q: max(map(abs, q)) > 0.1)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(quats, st.tuples(*[st.floats(-1e3, 1e3)] * 3), st.sampled_from(FORMS))
def test_the_pose_is_camera_from_world(tmp_path, quat, translation, form):
    images = [Image(quat=quat, translation=translation)]
    (camera,) = load_cameras(write(tmp_path / form, form, images=images))
    np.testing.assert_allclose(camera.viewmat[:3, :3], rotation_matrices(np.array([quat]))[0], atol=1e-14)
    np.testing.assert_array_equal(camera.viewmat[:3, 3], translation)


LENS_OF = {"SIMPLE_PINHOLE": (1, 0), "PINHOLE": (2, 0), "SIMPLE_RADIAL": (1, 1), "RADIAL": (1, 2)}
LENS_OF |= {"OPENCV": (2, 4), "FULL_OPENCV": (2, 8)}


@for_each("form", FORMS)
@for_each("model, numbers", LENS_OF.items())
def test_every_pinhole_model_gives_its_intrinsics_and_size(tmp_path, form, model, numbers):
    num_focal, num_more = numbers
    values = (500.0, 510.0)[:num_focal] + (300.0, 250.0) + (0.0,) * num_more
    (camera,) = load_cameras(write(tmp_path, form, [(1, model, 640, 480, values)]))
    focal = (500, 510) if num_focal == 2 else (500, 500)
    assert (camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]) == (*focal, 300, 250)
    assert (camera.width, camera.height, camera.near) == (640, 480, 0.01)


@for_each("form", FORMS)
@for_each(
    "model, values, listed",
    [
        ("SIMPLE_RADIAL", (500.0, 3.0, 2.0, 0.1), r"k1 = 0\.1"),
        ("RADIAL", (500.0, 3.0, 2.0, 0.0, -0.2), r"k2 = -0\.2"),
        ("OPENCV", (5.0, 5.0, 3.0, 2.0, 0.1, 0.0, 0.01, 0.0), r"k1 = 0\.1, p1 = 0\.01"),
        ("FULL_OPENCV", (5.0, 5.0, 3.0, 2.0, *[0.0] * 7, 0.5), r"k6 = 0\.5"),
    ],
)
def test_distortion_is_ignored_with_one_warning(tmp_path, form, model, values, listed):
    what = rf"cameras\.{form}: the distortion of camera model {model} was ignored \({listed}\); pictures are"
    with pytest.warns(SceneWarning, match=what) as caught:
        load_cameras(write(tmp_path, form, [(1, model, 640, 480, values)], [Image("a"), Image("b")]))
    assert len(caught) == 1


@for_each("form", FORMS)
def test_cameras_are_sorted_by_the_name_of_their_image(tmp_path, form):
    other = (7, "SIMPLE_PINHOLE", 100, 50, (80.0, 50.0, 25.0))
    points = [(1.5, 2.5, -1), (3.0, 4.0, 12)]
    images = [
        Image("b 2.jpg", translation=(2, 0, 0), camera_id=7),
        Image("sub/ä.jpg", translation=(4, 0, 0), points=points),
        Image("b 10.jpg", translation=(1, 0, 0), points=points * 100),
        Image("c" * 1000, translation=(3, 0, 0)),
    ]
    cameras = load_cameras(write(tmp_path, form, [PINHOLE, other], images))
    assert [camera.viewmat[0, 3] for camera in cameras] == [1, 2, 3, 4]
    assert [camera.width for camera in cameras] == [640, 100, 640, 640]


# --- what cannot be used


def fails(path, sentence):
    refuse(path, sentence, load_cameras)


def test_half_a_model(tmp_path):
    folder = write(tmp_path / "model", "txt")
    (folder / "images.txt").unlink()
    fails(folder, r"images\.txt: there is no such file, but a sparse model needs it; copy it too")
    fails(folder / "images.txt", r"images\.txt: there is no such file; check the path")


NO_PINHOLE = r"is not a pinhole; a pinhole is needed \(SIMPLE_PINHOLE, .*undist"
LENSES = [
    *(((4, model, 64, 48, (1.0,) * 8), f"{model} {NO_PINHOLE}") for model in ("OPENCV_FISHEYE", "FOV")),
    ((4, "PERISCOPE", 64, 48, (1.0,) * 8), "(PERISCOPE|number 99) is not a known camera model; a pinhole is"),
    ((4, "PINHOLE", 0, 480, (1.0, 1.0, 1.0, 1.0)), "the size must be at least 1x1, got 0x480"),
    ((4, "PINHOLE", 64, 48, (0.0, 1.0, 1.0, 1.0)), "the focal length must be above 0, got 0"),
    ((4, "PINHOLE", 64, 48, (1.0, 1.0, float("nan"), 1.0)), "the parameters must be finite, got "),
]
IMAGES = [
    (Image(quat=(0.0,) * 4), r"image 'a\.jpg': the quaternion must be finite and not zero, got \(0\.0"),
    (Image(quat=(float("nan"), 0.0, 0.0, 1.0)), "the quaternion must be finite and not zero"),
    (Image(translation=(0.0, float("inf"), 0.0)), "the translation must be finite"),
    (Image(camera_id=7), "camera 7 is not in the cameras file; copy both files from one model"),
]


@for_each("form", FORMS)
@for_each("camera, sentence", LENSES)
def test_a_camera_without_use_is_named(tmp_path, form, camera, sentence):
    fails(write(tmp_path / "model", form, [camera]), rf"cameras\.{form}: camera 4: .*{sentence}")


@for_each("form", FORMS)
@for_each("image, sentence", IMAGES)
def test_an_image_without_use_is_named(tmp_path, form, image, sentence):
    fails(write(tmp_path / "model", form, images=[image]), rf"images\.{form}: .*{sentence}")


@for_each("name", ["cameras.bin", "images.bin"])
def test_counts_that_a_file_cannot_hold_and_cuts_are_refused(tmp_path, name):
    images = [Image("a.jpg", points=[(1.0, 2.0, 3)]), Image("b.jpg")]
    path = write(tmp_path / "model", "bin", images=images) / name
    whole = path.read_bytes()
    for count in (20, 10**6, 2**64 - 1):
        path.write_bytes(struct.pack("<Q", count) + whole[8:])
        fails(path, rf"{name}: claims {count} \w+, for which its [0-9,]+ bytes are too few; copy or export")
    for length in range(0, len(whole), 3):
        path.write_bytes(whole[:length])
        fails(path, rf"{name}: (ends too early, after {length} bytes|claims|holds no images)")


def test_an_image_name_without_end(tmp_path):
    path = write(tmp_path / "model", "bin") / "images.bin"
    path.write_bytes(path.read_bytes()[:72] + b"x" * 200_000)
    fails(path, r"images\.bin: has no image name at byte 72; copy or export it again")


@for_each(
    "name, line, sentence",
    [
        ("cameras.txt", "1 PINHOLE", "must hold CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS; export"),
        ("cameras.txt", "1 PINHOLE 64 48 1 1 1", "camera model PINHOLE must have 4 parameters, got 3"),
        ("images.txt", "1 1 0 0 0 1 2 3 1", "must hold IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"),
    ],
)
def test_a_line_at_fault_is_named(tmp_path, name, line, sentence):
    folder = write(tmp_path / "model", "txt")
    (folder / name).write_text(line + "\n")
    fails(folder, rf"{name}: line 1: {sentence}")
