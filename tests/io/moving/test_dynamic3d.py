"""The params.npz of Dynamic3DGaussians."""

import io
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.moving import dynamic3d as npz
from brushgs.formats.moving import load_moving
from tests.io.moving.params_maker import C0, params


def write(path: Path, arrays: dict, *, packed: bool = False) -> Path:
    (np.savez_compressed if packed else np.savez)(path, **arrays)
    return path


def meaning(arrays: dict, moment: int) -> dict[str, np.ndarray]:
    """One moment in float64: the definition."""
    a = {name: values.astype(np.float64) for name, values in arrays.items()}
    return {
        "means": a["means3D"][moment],
        "quats": a["unnorm_rotations"][moment],
        "scales": np.exp(a["log_scales"]),
        "opacities": 1 / (1 + np.exp(-a["logit_opacities"][:, 0])),
        "sh": ((a["rgb_colors"][moment] - 0.5) / C0)[:, None],
    }


@pytest.mark.parametrize("packed", [False, True])
def test_every_moment_is_what_its_arrays_say(tmp_path, packed):
    arrays = params(12, 40)
    moving = load_moving(write(tmp_path / "params.npz", arrays, packed=packed))
    assert (moving.duration, moving.has_rows, moving.resting) == (11 / 30, True, None)
    assert moving.times is not None
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
    assert moving.notes is not None
    assert (moving.notes.format, moving.notes.unknown) == ("Dynamic3DGaussians, 12 moments", ())


def test_colours_and_sizes_may_be_of_all_moments_or_of_each(tmp_path):
    arrays = params(4, 10)
    arrays["rgb_colors"] = arrays["rgb_colors"][:1]
    arrays["log_scales"] = np.stack([arrays["log_scales"] + moment for moment in range(4)])
    moving = load_moving(write(tmp_path / "a.npz", arrays))
    np.testing.assert_allclose(moving.at(0.1).scales, np.exp(arrays["log_scales"][3]), rtol=1e-5)
    np.testing.assert_array_equal(moving.at(0.1).sh, moving.at(0).sh)


def test_a_file_of_splatam_is_a_scene_at_rest(tmp_path):
    arrays = {
        name: values[0] if name in ("means3D", "unnorm_rotations", "rgb_colors") else values
        for name, values in params(1, 10).items()
    }
    arrays["log_scales"] = arrays["log_scales"][:, :1]
    moving = load_moving(write(tmp_path / "params.npz", arrays | {"w2c": np.eye(4)}))
    assert moving.duration == 0
    assert moving.resting is not None
    assert moving.resting.all()
    scales = moving.at(0).scales
    np.testing.assert_allclose(scales, np.exp(arrays["log_scales"]).repeat(3, axis=1), rtol=1e-6)


def test_rows_that_cannot_be_drawn_are_unseen_and_told_once(tmp_path):
    arrays = params(5, 20)
    arrays["means3D"][2, 3, 1] = np.inf
    arrays["unnorm_rotations"][3, 4] = 0
    moving = load_moving(write(tmp_path / "a.npz", arrays))
    with pytest.warns(
        bg.SceneWarning, match=r"a\.npz: 1 of 20 rows were dropped: .* row 3, y = inf"
    ) as caught:
        found = [moving.at(moment / 30) for moment in range(5)]
    assert len(caught) == 1
    assert [len(moment) for moment in found] == [20] * 5
    assert [np.flatnonzero(moment.opacities == 0).tolist() for moment in found] == [[], [], [3], [4], []]
    np.testing.assert_array_equal(found[2].means[3], found[0].means[3])


def test_a_clip_crosses_processes(tmp_path):
    moving = load_moving(write(tmp_path / "a.npz", params(3, 10), packed=True))
    other = pickle.loads(pickle.dumps(moving))
    np.testing.assert_array_equal(other.at(0.05).means, moving.at(0.05).means)


# What is refused


class Trap:
    """Unpickling it would be noticed."""

    def __reduce__(self):
        return exec, ("raise AssertionError('unpickled')",)


def test_an_array_of_objects_is_refused_by_name_and_never_unpickled(tmp_path):
    objects = np.empty(2, object)
    objects[:] = Trap()
    for name in ("means3D", "logit_opacities"):
        path = write(tmp_path / "params.npz", params(2, 5) | {name: objects})
        with pytest.raises(
            bg.SceneError, match=rf"its array '{name}' holds Python objects, which only a pick"
        ):
            load_moving(path)
    path = write(tmp_path / "params.npz", params(2, 5) | {"camera": objects})
    assert load_moving(path).duration == 1 / 30  # nothing that is read


CHANGES = {
    "a missing array": (lambda a: a.pop("rgb_colors"), "has no array 'rgb_colors' among: 'means3D', "),
    "whole numbers": (
        lambda a: a.update(log_scales=np.ones((6, 3), int)),
        "'log_scales' must hold floats, got int",
    ),
    "complex numbers": (
        lambda a: a.update(log_scales=np.ones((6, 3), complex)),
        "must hold floats, got complex",
    ),
    "text": (lambda a: a.update(means3D=np.array(["a"])), "must hold floats, got <U1"),
    "records": (lambda a: a.update(means3D=np.zeros(3, [("x", "f4")])), "'means3D' must hold floats"),
    "a wide float": (lambda a: a.update(means3D=np.zeros((3, 6, 3), np.longdouble)), "must hold floats, got"),
    "other rows": (
        lambda a: a.update(log_scales=np.ones((5, 3))),
        r"'log_scales' must have the shape \[3, 6, 3\]",
    ),
    "other moments": (lambda a: a.update(rgb_colors=np.ones((2, 6, 3))), r"must .* got \[2, 6, 3\]"),
    "other width": (lambda a: a.update(unnorm_rotations=np.ones((3, 6, 3))), r"must .* got \[3, 6, 3\]"),
    "a flat array": (lambda a: a.update(means3D=np.ones(18)), r"'means3D' must have the shape .* got \[18\]"),
    "columns first": (
        lambda a: a.update(means3D=np.asfortranarray(a["means3D"])),
        "'means3D' is stored column by column; save numpy.ascontiguousarray of it",
    ),
    "no rows": (lambda a: a.update({n: v[..., :0, :] for n, v in a.items()}), "holds no Gaussians"),
    "no moments": (lambda a: a.update(means3D=a["means3D"][:0]), "holds no Gaussians|must have the shape"),
    "nothing sound": (lambda a: a["means3D"].fill(np.nan), "no row of 6 can be used"),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("change", CHANGES)
def test_arrays_that_do_not_fit_are_refused_by_name(tmp_path, change, packed):
    alter, match = CHANGES[change]
    arrays = params(3, 6)
    alter(arrays)
    path = write(tmp_path / "params.npz", arrays, packed=packed)
    with pytest.raises(bg.SceneError, match=rf"params\.npz: .*{match}"):
        load_moving(path).at(0)


@pytest.mark.parametrize("packed", [False, True])
def test_a_file_that_is_cut_off_or_damaged_is_refused(tmp_path, packed):
    whole = write(tmp_path / "params.npz", params(3, 6), packed=packed)
    content = whole.read_bytes()
    for length in (30, len(content) // 2, len(content) - 30):
        whole.write_bytes(content[:length])
        with pytest.raises(bg.SceneError, match=r"params\.npz: is a damaged zip archive"):
            load_moving(whole)
    if packed:
        whole.write_bytes(content[:200] + b"\xff" * 40 + content[240:])
    else:
        rewrite(whole, content, lambda data: data.replace(b"NUMPY", b"NUMPX"))
    with pytest.raises(bg.SceneError, match=r"its array '\w+' (is damaged|has no header)"):
        load_moving(whole)


def rewrite(path: Path, content: bytes, change) -> None:
    """An archive with changed members and right checksums."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: change(archive.read(name)) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, member in members.items():
            archive.writestr(name, member)


def test_a_header_that_claims_more_than_there_is_is_refused(tmp_path):
    path = tmp_path / "params.npz"
    write(path, params(3, 6))
    content = path.read_bytes()
    for shape, match in (
        (b"(9, 6, 3)", r"'means3D' has \d+ bytes, and \d+ by its header"),
        (b"(-3,6,-3)", r"'means3D' has the shape \(-3, 6, -3\)"),
        (b"(3, 6.,3)", "'means3D' has no header that can be read"),
        (b"(3, 6, (3", "'means3D' has no header that can be read"),
        (b"[9] * 9999", "'means3D' has no header that can be read"),
    ):
        rewrite(path, content, lambda data, shape=shape: data.replace(b"(3, 6, 3)", shape.ljust(9), 1))
        with pytest.raises(bg.SceneError, match=match):
            load_moving(path)


def test_an_archive_that_would_grow_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(npz, "_SMALL", 0)
    path = write(
        tmp_path / "a.npz", params(3, 6) | {"means3D": np.zeros((3, 6000, 3), np.float32)}, packed=True
    )
    with pytest.raises(bg.SceneError, match="'means3D' would grow from"):
        load_moving(path)


def test_encrypted_and_oddly_packed_members_are_refused(tmp_path):
    path = tmp_path / "params.npz"
    write(path, params(3, 6))
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_BZIP2) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with pytest.raises(bg.SceneError, match="'means3D' is packed in a way that is not read"):
        load_moving(path)
    write(path, params(3, 6))
    content = bytearray(path.read_bytes())
    entry = content.index(b"PK\1\2")
    content[entry + 8 : entry + 10] = struct.pack("<H", 1)
    path.write_bytes(content)
    with pytest.raises(bg.SceneError, match="'means3D' is encrypted"):
        load_moving(path)


def test_a_file_that_becomes_shorter_is_told(tmp_path):
    path = write(tmp_path / "params.npz", params(30, 60))
    moving = load_moving(path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(bg.SceneError, match="became shorter while it was read"):
        moving.at(0.9)
