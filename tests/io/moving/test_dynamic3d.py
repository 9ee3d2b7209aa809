"""The params.npz of Dynamic3DGaussians."""

import io
import pickle
import struct
import zipfile

import numpy as np
import pytest
from scipy.special import expit

import brushgs as bg
from brushgs.formats.moving import dynamic3d as npz
from tests.io.moving.params_maker import C0, params
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse


def write(path, arrays, *, packed=False):
    (np.savez_compressed if packed else np.savez)(path, **arrays)
    return path


def meaning(arrays, moment):
    """One moment in float64: the definition."""
    a = {name: values.astype(np.float64) for name, values in arrays.items()}
    found = {"means": a["means3D"][moment], "quats": a["unnorm_rotations"][moment]}
    found |= {"scales": np.exp(a["log_scales"]), "opacities": expit(a["logit_opacities"][:, 0])}
    return found | {"sh": ((a["rgb_colors"][moment] - 0.5) / C0)[:, None]}


@for_each("packed", [False, True])
def test_every_moment_is_what_its_arrays_say(tmp_path, packed):
    arrays = params(12, 40)
    moving = bg.load_moving(write(tmp_path / "params.npz", arrays, packed=packed))
    assert (moving.duration, moving.has_rows, moving.resting) == (11 / 30, True, None)
    np.testing.assert_allclose(moving.times, np.arange(12) / 30)
    for moment in (0, 5, 11, 5):
        found = moving.at(moment / 30)
        for name, expected in meaning(arrays, moment).items():
            np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-6, atol=1e-6, err_msg=name)
    one, other = meaning(arrays, 3), meaning(arrays, 4)
    found = moving.at(3.25 / 30)
    for name in ("means", "scales", "opacities", "sh"):
        expected = 0.75 * one[name] + 0.25 * other[name]
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-5, atol=1e-6, err_msg=name)
    assert (moving.notes.format, moving.notes.unknown) == ("Dynamic3DGaussians, 12 moments", ())
    crossed = pickle.loads(pickle.dumps(moving)).at(3.25 / 30)
    np.testing.assert_array_equal(crossed.means, found.means)


def test_colors_and_sizes_may_be_of_all_moments_or_of_each(tmp_path):
    arrays = params(4, 10)
    arrays["rgb_colors"] = arrays["rgb_colors"][:1]
    arrays["log_scales"] = np.stack([arrays["log_scales"] + moment for moment in range(4)])
    moving = bg.load_moving(write(tmp_path / "a.npz", arrays))
    np.testing.assert_allclose(moving.at(0.1).scales, np.exp(arrays["log_scales"][3]), rtol=1e-5)
    np.testing.assert_array_equal(moving.at(0.1).sh, moving.at(0).sh)


def test_a_file_of_splatam_is_a_scene_at_rest(tmp_path):
    arrays = params(1, 10) | {"w2c": np.eye(4)}
    arrays |= {name: arrays[name][0] for name in ("means3D", "unnorm_rotations", "rgb_colors")}
    arrays["log_scales"] = arrays["log_scales"][:, :1]
    moving = bg.load_moving(write(tmp_path / "params.npz", arrays))
    assert moving.duration == 0
    assert moving.resting.all()
    expected = np.exp(arrays["log_scales"]).repeat(3, axis=1)
    np.testing.assert_allclose(moving.at(0).scales, expected, rtol=1e-6)


def test_rows_that_cannot_be_drawn_are_unseen_and_told_once(tmp_path):
    arrays = params(5, 20)
    arrays["means3D"][2, 3, 1] = np.inf
    arrays["unnorm_rotations"][3, 4] = 0
    moving = bg.load_moving(write(tmp_path / "a.npz", arrays))
    words = r"a\.npz: 1 of 20 rows were dropped: .* row 3, y = inf"
    with pytest.warns(bg.SceneWarning, match=words) as caught:
        found = [moving.at(moment / 30) for moment in range(5)]
    assert len(caught) == 1
    assert [np.flatnonzero(moment.opacities == 0).tolist() for moment in found] == [[], [], [3], [4], []]
    np.testing.assert_array_equal(found[2].means[3], found[0].means[3])


# What is refused


class Trap:
    """Unpickling it would be noticed."""

    def __reduce__(self):
        return exec, ("raise AssertionError('unpickled')",)


def test_an_array_of_objects_is_refused_by_name_and_never_unpickled(tmp_path):
    objects = np.empty(2, object)
    objects[:] = Trap()
    path = write(tmp_path / "params.npz", params(2, 5) | {"logit_opacities": objects})
    refuse(path, "its array 'logit_opacities' holds Python objects, which only a pick", bg.load_moving)
    path = write(tmp_path / "params.npz", params(2, 5) | {"camera": objects})
    assert bg.load_moving(path).duration == 1 / 30  # nothing that is read


@for_each(
    "changes, sentence",
    [
        ({"rgb_colors": None}, "has no array 'rgb_colors' among: 'means3D', "),
        ({"log_scales": np.ones((6, 3), int)}, "'log_scales' must hold floats, got int"),
        ({"means3D": np.zeros(3, [("x", "f4")])}, "'means3D' must hold floats"),
        ({"log_scales": np.ones((5, 3))}, r"'log_scales' must have the shape \[3, 6, 3\]"),
        ({"rgb_colors": np.ones((2, 6, 3))}, r"must .* got \[2, 6, 3\]"),
        ({"unnorm_rotations": np.ones((3, 6, 3))}, r"must .* got \[3, 6, 3\]"),
        ({"means3D": np.ones(18)}, r"'means3D' must have the shape .* got \[18\]"),
        ({"means3D": np.ones((3, 6, 3), order="F")}, "'means3D' is stored column by column; save numpy.asc"),
        ({n: v[..., :0, :] for n, v in params(3, 6).items()}, "holds no Gaussians"),
        ({"means3D": np.ones((0, 6, 3))}, "holds no Gaussians|must have the shape"),
        ({"means3D": np.full((3, 6, 3), np.nan, np.float32)}, "no row of 6 can be used"),
    ],
)
def test_arrays_that_do_not_fit_are_refused_by_name(tmp_path, changes, sentence):
    arrays = {name: values for name, values in (params(3, 6) | changes).items() if values is not None}
    path = write(tmp_path / "params.npz", arrays)
    refuse(path, rf"params\.npz: .*{sentence}", lambda path: bg.load_moving(path).at(0))


def rewrite(path, change, packing=zipfile.ZIP_STORED):
    """An archive with changed members and right checksums."""
    with zipfile.ZipFile(io.BytesIO(path.read_bytes())) as archive:
        members = {name: change(archive.read(name)) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", packing) as archive:
        for name, member in members.items():
            archive.writestr(name, member)


def test_archives_that_are_cut_off_damaged_or_of_another_kind_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "params.npz"
    content = write(path, params(3, 6), packed=True).read_bytes()
    for length in (30, len(content) // 2, len(content) - 30):
        path.write_bytes(content[:length])
        refuse(path, r"params\.npz: is a damaged zip archive", bg.load_moving)
    path.write_bytes(content[:200] + b"\xff" * 40 + content[240:])
    refuse(path, r"its array '\w+' is damaged", bg.load_moving)
    rewrite(write(path, params(3, 6)), lambda data: data, zipfile.ZIP_BZIP2)
    refuse(path, "'means3D' is packed in a way that is not read", bg.load_moving)
    content = bytearray(write(path, params(3, 6)).read_bytes())
    entry = content.index(b"PK\1\2")
    content[entry + 8 : entry + 10] = struct.pack("<H", 1)
    path.write_bytes(content)
    refuse(path, "'means3D' is encrypted", bg.load_moving)
    monkeypatch.setattr(npz, "_SMALL", 0)
    zeros = np.zeros((3, 6000, 3), np.float32)
    write(path, params(3, 6) | {"means3D": zeros}, packed=True)
    refuse(path, "'means3D' would grow from", bg.load_moving)


@for_each(
    "old, new, sentence",
    [
        (b"NUMPY", b"NUMPX", r"'\w+' has no header"),
        (b"(3, 6, 3)", b"(9, 6, 3)", r"'means3D' has \d+ bytes, and \d+ by its header"),
        (b"(3, 6, 3)", b"(-3,6,-3)", r"'means3D' has the shape \(-3, 6, -3\)"),
        (b"(3, 6, 3)", b"(3, 6.,3)", "'means3D' has no header that can be read"),
    ],
)
def test_a_header_at_fault_is_refused(tmp_path, old, new, sentence):
    path = write(tmp_path / "params.npz", params(3, 6))
    rewrite(path, lambda data: data.replace(old, new, 1))
    refuse(path, sentence, bg.load_moving)


def test_a_file_that_becomes_shorter_is_told(tmp_path):
    path = write(tmp_path / "params.npz", params(30, 60))
    moving = bg.load_moving(path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(bg.SceneError, match="became shorter while it was read"):
        moving.at(0.9)
