"""How a scene was trained: what PLY files say of it, and what it does to the Gaussians."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from tests.io import test_compressed_ply
from tests.io.ply_maker import decoded, scene_columns, write_scene
from tests.kit.for_each import for_each

SIZE = {"width": 64, "height": 48}
FRONT = bg.Camera.look_at((0, 0, -4), (0, 0, 0), **SIZE)


@for_each(
    ("comments", "training"),
    [
        ([], "default"),
        (["comment SplatRenderMode: default"], "default"),
        (["comment SplatRenderMode: mip"], "antialiased"),
        (["comment Exported from Brush", "comment splatrendermode:mip"], "antialiased"),
        (["comment SplatRenderMode: 2dgs"], "2dgs"),
        (["comment antialiased 0"], "default"),
        (["comment antialiased 1"], "antialiased"),
        (["obj_info antialiased 1"], "antialiased"),
        (["comment antialiased 1", "comment SplatRenderMode: default"], "default"),  # the last one counts
        (["comment not antialiased 1", "comment antialiased 10", "comment SplatRenderMode: new"], "default"),
    ],
)
def test_comments_state_the_training(tmp_path, comments, training):
    path = write_scene(tmp_path / "a.ply", scene_columns(20), comments=comments)
    gaussians, notes = read_scene(path)
    assert notes.training == training
    assert gaussians.antialiased == (training == "antialiased")


# The 3D filter of Mip-Splatting


def filtered(columns: dict[str, np.ndarray], widths: np.ndarray) -> dict[str, np.ndarray]:
    """What the `get_..._with_3D_filter` of Mip-Splatting return, in float64."""
    plain = decoded(columns)
    squares = plain["scales"] ** 2
    grown = squares + widths.astype(np.float64)[:, None] ** 2
    share = np.sqrt(squares.prod(axis=1) / grown.prod(axis=1))
    return plain | {"scales": np.sqrt(grown), "opacities": plain["opacities"] * share}


@for_each("encoding", ["binary_little_endian", "ascii"])
def test_the_3d_filter_is_applied(tmp_path, encoding):
    columns = scene_columns(200, degree=1)
    widths = np.exp(np.random.default_rng(3).normal(-4, 2, 200)).astype(np.float32)
    path = write_scene(tmp_path / "a.ply", columns | {"filter_3D": widths}, encoding)
    gaussians, notes = read_scene(path)
    for name, expected in filtered(columns, widths).items():
        # Logs of up to 10 and logits of up to 15 in float32 are known to some 1e-6.
        np.testing.assert_allclose(getattr(gaussians, name), expected, rtol=4e-6, err_msg=name)
    assert (notes.training, notes.unknown) == ("antialiased", ())


def test_a_broken_filter_drops_its_row(tmp_path):
    widths = np.full(5, 0.1, np.float32)
    widths[[1, 3]] = np.nan, np.inf
    path = write_scene(tmp_path / "a.ply", scene_columns(5) | {"filter_3D": widths})
    with pytest.warns(bg.SceneWarning, match="2 of 5 rows were dropped"):
        assert len(bg.load(path)) == 3


# Scenes of 2D Gaussians


def two_scales(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: values for name, values in columns.items() if name != "scale_2"}


@for_each("encoding", ["binary_little_endian", "binary_big_endian", "ascii"])
def test_two_scales_make_flat_discs(tmp_path, encoding):
    columns = scene_columns(50, degree=2)
    gaussians, notes = read_scene(write_scene(tmp_path / "a.ply", two_scales(columns), encoding))
    expected = decoded(columns)
    np.testing.assert_allclose(gaussians.scales[:, :2], expected["scales"][:, :2], rtol=1e-6)
    assert not gaussians.scales[:, 2].any()
    np.testing.assert_array_equal(gaussians.sh, expected["sh"].astype(np.float32))
    assert (notes.training, notes.rows_dropped, gaussians.antialiased) == ("2dgs", 0, False)


def test_compressed_discs_are_flat(tmp_path):
    path = test_compressed_ply.encode(tmp_path / "a.ply", test_compressed_ply.make(300))
    gaussians, notes = read_scene(path)
    assert gaussians.scales[:, 2].all()
    assert notes.training == "default"
    path.write_bytes(path.read_bytes().replace(b"ply\n", b"ply\ncomment SplatRenderMode: 2dgs\n", 1))
    gaussians, notes = read_scene(path)
    assert notes.training == "2dgs"
    assert not gaussians.scales[:, 2].any()


def test_a_disc_seen_from_the_front_is_round_and_from_the_side_as_thin_as_the_low_pass(tmp_path):
    columns = {name: np.zeros(1, np.float32) for name in two_scales(scene_columns(1))}
    columns |= {"scale_0": np.log([0.5]), "scale_1": np.log([0.5]), "rot_0": np.ones(1)}
    disc = bg.load(write_scene(tmp_path / "a.ply", columns))
    pixels = FRONT.K[0, 0] / 4 * 0.5
    np.testing.assert_allclose(bg.project(disc, FRONT).half_extents[0], 2 * np.hypot(pixels, 0.3**0.5), 1e-5)
    side = bg.Camera.look_at((-4, 0, 0), (0, 0, 0), **SIZE)
    assert bg.project(disc, side).half_extents[0, 1] == pytest.approx(2 * 0.3**0.5, rel=1e-5)
    path = write_scene(tmp_path / "b.ply", two_scales(scene_columns(500)))
    assert not [f for f in bg.examine(path) if f.severity == "fault"]
    bg.save(bg.load(path), tmp_path / "c.ply")
    assert not bg.load(tmp_path / "c.ply").scales[:, 2].any()
