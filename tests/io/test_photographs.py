"""Scenes that were predicted from one photograph, and photographs as scenes."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import brushgs as bg
from brushgs.cameras.paths import plan_path
from brushgs.cli import main
from brushgs.doctor.describe import describe
from brushgs.formats import read_scene
from brushgs.formats.cameras.read import read_cameras
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.passes.add.behind import behind
from brushgs.pipeline.report import Report
from brushgs.pipeline.views import choose_camera, choose_first_view
from tests.first_view.scenes import about
from tests.io.ply_maker import element_bytes, write_ply_file
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse
from tests.scenes import still_life_of

WIDTH, HEIGHT, FOCAL = 96, 64, 80.0
NEAR, FAR = 1.0, 3.0


def run(*words: object) -> None:
    main([str(word) for word in words])


def photographed(path, *, encoding="binary_little_endian", rotation=None, without=(), **changes) -> Path:
    """A scene as SHARP writes it: a Gaussian for each pixel of a square before a wall."""
    turn = np.eye(3) if rotation is None else rotation
    y, x = (np.mgrid[:HEIGHT, :WIDTH] + 0.5).reshape(2, -1)
    is_near = (abs(x - 48) < 16) & (abs(y - 32) < 16)
    depth = np.where(is_near, NEAR, FAR)
    seen = np.stack([(x - 48) / FOCAL * depth, (y - 32) / FOCAL * depth, depth])
    shift = np.array([0.1, -0.2, 0.3])
    means = turn.T @ (seen - shift[:, None])
    columns = dict(zip("xyz", means.astype(np.float32), strict=True))
    for index, shade in enumerate(np.where(is_near, 1.0, -1.0) * np.array([[1], [0.5], [0]])):
        columns[f"f_dc_{index}"] = shade.astype(np.float32)
    columns["opacity"] = np.full(len(x), 5, np.float32)
    for index in range(3):
        columns[f"scale_{index}"] = np.log(0.7 * depth / FOCAL).astype(np.float32)
    columns |= {f"rot_{index}": np.full(len(x), float(index == 0), np.float32) for index in range(4)}
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn, shift
    K = np.array([[FOCAL, 0, 48], [0, FOCAL, 32], [0, 0, 1]])
    beside = {"extrinsic": matrix, "intrinsic": K, "image_size": [WIDTH, HEIGHT], "frame": [1, len(x)]}
    beside |= {"disparity": [0.3, 1.0], "color_space": [1], "version": [1, 5, 0]} | changes
    types = {"image_size": "uint", "frame": "int", "color_space": "uchar", "version": "uchar"}
    elements = [element_bytes("vertex", columns, encoding)]
    for name, values in beside.items():
        if name not in without:
            flat = {name: np.ravel(values).astype(np.float64)}
            elements.append(element_bytes(name, flat, encoding, types))
    return write_ply_file(path, elements, encoding)


TURNED = about((0, 1, 0), np.degrees(0.7))


@for_each("encoding", ["binary_little_endian", "ascii"])
def test_gaussians_project_to_the_pixels_that_they_were_made_of(tmp_path, encoding):
    path = photographed(tmp_path / "a.ply", encoding=encoding, rotation=TURNED)
    camera = read_cameras(path).cameras[0]
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    means = bg.load(path).means.astype(np.float64)
    seen = means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    pixels = (seen @ camera.K.T)[:, :2] / seen[:, 2:]
    expected = (np.mgrid[:HEIGHT, :WIDTH] + 0.5).reshape(2, -1)[::-1].T
    assert np.abs(pixels - expected).max() < 0.01


def test_every_element_is_named(tmp_path):
    told = describe(photographed(tmp_path / "a.ply"))
    text = f"{told['photograph']} {told['not_read']}"
    for name in ("extrinsic", "intrinsic", "image_size", "frame", "disparity", "color_space", "version"):
        assert name in text


def test_the_first_view_and_its_size_are_those_of_the_photograph(tmp_path):
    path = photographed(tmp_path / "a.ply", rotation=TURNED)
    gaussians, notes = read_scene(path)
    view = choose_first_view(gaussians, ViewConfig(), notes, Report())
    expected = read_cameras(path).cameras[0]
    camera = choose_camera(view, ViewConfig(), Report())
    assert np.array_equal(camera.viewmat, expected.viewmat)
    assert np.array_equal(camera.K, expected.K)
    half = choose_camera(view, ViewConfig(size=(48, 32)), Report())
    assert np.allclose(half.K[:2], expected.K[:2] / 2)
    zoomed = choose_camera(view, ViewConfig(zoom=1.5), Report())  # framed, with the lens of the photograph
    assert np.allclose(zoomed.viewmat, expected.viewmat, atol=1e-9)
    assert zoomed.K[1, 1] == pytest.approx(1.5 * FOCAL)


@for_each(
    "changes, sentence",
    [
        ({"extrinsic": np.eye(4)[:3]}, "element 'extrinsic' must have 16 rows of one property, got 12 of 1"),
        ({"extrinsic": np.full(16, np.nan)}, "must be finite"),
        ({"intrinsic": np.ones((3, 3))}, "a pinhole's"),
        ({"without": ("image_size",)}, "no element 'image_size'"),
        ({"without": ("extrinsic", "intrinsic")}, r"no camera of a photograph among its elements \(vertex, "),
    ],
)
def test_a_camera_that_cannot_be_used_is_told_and_the_scene_is_read(tmp_path, changes, sentence):
    path = photographed(tmp_path / "a.ply", **changes)
    refuse(path, sentence, read_cameras)
    if len(changes.get("without", ())) < 2:
        with pytest.warns(bg.SceneWarning, match="the camera of its photograph is not used: "):
            gaussians, notes = read_scene(path)
        assert (len(gaussians), notes.photograph) == (WIDTH * HEIGHT, None)


def test_what_lies_behind_is_painted_over_wherever_the_camera_sways(tmp_path):
    gaussians, notes = read_scene(photographed(tmp_path / "a.ply", rotation=TURNED))
    view = choose_first_view(gaussians, ViewConfig(), notes, Report())
    angle = np.radians(10)
    path = plan_path(view, ViewConfig(), PathConfig(orbit=8, sway=float(angle)))
    added = behind(gaussians, view.photograph, angle)
    filled = bg.Gaussians.joined([gaussians, added])

    def holes(scene) -> float:
        frames = bg.plain_views(scene, path.cameras).frames
        return max(float((frame.alpha < 0.5).mean()) for frame in frames)

    assert holes(gaussians) > 0.04
    assert holes(filled) <= 0.005
    own, other = (bg.plain_views(scene, path.cameras[:1]).frames[0] for scene in (gaussians, filled))
    assert np.abs(own.over("white") - other.over("white")).mean() < 0.01  # the photograph stays what it was


def test_any_scene_can_sway_about_what_the_camera_looks_at():
    view = choose_first_view(still_life_of(1000), ViewConfig(), None, Report())
    point = view.points.min(axis=0)  # a corner of the subject, off its middle
    config = ViewConfig(size=(64, 48), look_at=tuple(point))
    path = plan_path(view, config, PathConfig(orbit=12, sway=0.3))
    assert "17.2 degrees to each side" in path.source
    for camera in path.cameras:
        assert np.arccos(min(camera.viewmat[2, :3] @ path.cameras[0].viewmat[2, :3], 1)) < 0.3 + 1e-9
        ahead = camera.viewmat[:3, :3] @ point + camera.viewmat[:3, 3]
        assert np.abs(ahead[:2]).max() < 1e-9 * ahead[2]


def picture(path: Path, alpha: bool = False) -> Path:
    pixels = np.zeros((48, 64, 4), np.uint8)
    pixels[..., 0], pixels[..., 3] = np.linspace(0, 60, 64), 255
    pixels[20:30, 20:40, 1] = 100 + 100 * np.sin(0.8 * np.arange(20))
    if alpha:
        pixels[:, 32:, 3] = 0
    Image.fromarray(pixels if alpha else pixels[..., :3]).save(path)
    return path


def test_a_photograph_is_a_scene_of_one_layer(tmp_path):
    gaussians, notes = read_scene(picture(tmp_path / "a.png"))
    camera = notes.photograph
    assert (camera.width, camera.height) == (64, 48)
    shown = bg.plain_views(gaussians, [camera]).frames[0]
    expected = read_image(tmp_path / "a.png")[..., :3]
    assert -10 * np.log10(np.mean((shown.over("black") - expected) ** 2)) > 20
    sides = np.unique(gaussians.scales[:, 0])
    assert len(sides) > 2
    small = gaussians.scales[:, 0] == sides[0]  # where there is detail
    at = gaussians.means[small] @ camera.K.T
    assert (abs(at[:, 0] / at[:, 2] - 30) < 20).all()


def test_a_photograph_is_painted_and_sways_with_the_command(tmp_path):
    picture(tmp_path / "a.png")
    run("render", tmp_path / "a.png", "--strokes", 60, "-o", tmp_path / "b.png", "--quiet")
    assert read_image(tmp_path / "b.png").shape[:2] == (48, 64)
    run("render", tmp_path / "a.png", "--strokes", 60, "--orbit", 3, "-o", f"{tmp_path}/f/", "--quiet")
    assert len(list((tmp_path / "f").glob("*.png"))) == 3
