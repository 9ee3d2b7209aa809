import os
from pathlib import Path

import numpy as np
import pytest

import brushgs.formats.files
from tests.io.ply_maker import element_bytes, scene_columns, write_ply_file, write_scene
from tests.kit.refused import refuse

FACES = (b"element face 2\nproperty list uchar int vertex_indices\n", (b"\x03" + b"\0" * 12) * 2)


def test_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.ply")
    refuse(tmp_path / "a.ply", "is a pipe or device, which cannot be read twice; save it to a file first")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "a.ply", scene_columns(3))
    path.chmod(0)
    refuse(path, "may not be read; change its permissions")


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (PermissionError(13, "Permission denied"), "may not be read"),
        (OSError(5, "I/O error"), r"\(I/O error\)"),
    ],
)
def test_errors_of_the_system_are_reported_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, sentence: str
) -> None:
    def fail(*args: object, **kwargs: object) -> None:
        raise error

    path = write_scene(tmp_path / "a.ply", scene_columns(3))
    monkeypatch.setattr(brushgs.formats.files.Path, "open", fail)
    refuse(path, sentence)


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("a.ply", b"", "is empty; copy or download it again"),
        (
            "a.ply",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
            "LFS pointer.* run 'git lfs pull'",
        ),
        ("a.ply", b"<!DOCTYPE html><html>", "is a web page or XML, not a scene"),
        ("a.ply", b"\xef\xbb\xbf\n<html>", "is a web page or XML, not a scene"),
        (
            "a.sog",
            b"PK\x03\x04abc",
            r"is a damaged zip archive \(File is not a zip file\); download or copy it again",
        ),
        (
            "a.json",
            b'{"camera_angle_x": 1}',
            "is JSON, but of no SOG scene .* and no glTF model; name the scene",
        ),
        (
            "cameras.json",
            b"\xef\xbb\xbf [{}]",
            "is JSON, as lists of cameras are, not a scene; name the scene",
        ),
        ("a.splat", b"<!DOCTYPE html><html>", "is a web page or XML, not a scene"),
        ("a.ksplat", b"version https://git-lfs.github.com/spec/v1\n", "LFS pointer"),
        ("a.glb", b"glTF\x02", r"is damaged: it has no JSON chunk; export it again"),
        ("a.lcc", b"\0" * 64, r"is a \.lcc scene, which is not read; convert it"),
        (
            "a.ply",
            b"\0" * 64,
            r"is of no scene format that is read: it begins with b'.*'; export it as \.ply",
        ),
        ("a.ply", b"plywood", "is of no scene format that is read"),
    ],
)
def test_a_file_of_another_kind_is_named(tmp_path: Path, name: str, content: bytes, sentence: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    refuse(path, sentence)


HEAD = "ply\nformat binary_little_endian 1.0\n"


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        ("ply\nformat ascii 1.0\nelement vertex 1\n", "the header has no 'end_header' line; .* get it again"),
        ("ply\nelement vertex 1\nend_header\n", "the header has no 'format' line; .* get it again"),
        ("ply\nformat middle_endian 1.0\nend_header\n", "header line 'format middle_endian 1.0' is not PLY"),
        (
            HEAD + "element vertex -1\nend_header\n",
            "element 'vertex' must have a whole number of rows, got '-1'",
        ),
        (
            HEAD + "element vertex 1\nproperty quad x\nend_header\n",
            "'x' has the unknown type 'quad'; write .* double",
        ),
        (
            HEAD + "element vertex 1\n" + "property float x\n" * 2 + "end_header\n",
            "'x' stands twice in the header",
        ),
    ],
)
def test_a_header_that_makes_no_sense(tmp_path: Path, header: str, sentence: str) -> None:
    path = tmp_path / "a.ply"
    path.write_text(header)
    refuse(path, sentence)


@pytest.mark.parametrize("count", [10**18, 10**30, 1_500_000_000])
@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_an_absurd_count_is_refused_before_memory_is_allocated(
    tmp_path: Path, count: int, encoding: str
) -> None:
    path = write_scene(tmp_path / "a.ply", scene_columns(3), encoding, count=count)
    refuse(
        path, rf"is cut off: of {count} rows of element 'vertex' \d+ are complete and .*\d+ bytes are missing"
    )


@pytest.mark.parametrize("encoding", ["binary_little_endian", "binary_big_endian"])
def test_a_binary_file_cut_off_says_how_many_rows_and_bytes(tmp_path: Path, encoding: str) -> None:
    path = write_scene(tmp_path / "a.ply", scene_columns(50), encoding)
    path.write_bytes(path.read_bytes()[:-75])  # a row has 17 * 4 = 68 bytes
    refuse(
        path,
        "of 50 rows of element 'vertex' 48 are complete and 75 bytes are missing; copy or export it again",
    )


def test_a_word_in_an_ascii_file_is_named_with_row_and_column(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "a.ply", scene_columns(50), "ascii")
    lines = path.read_text().splitlines()
    begin = lines.index("end_header") + 1
    tokens = lines[begin + 12].split()
    tokens[2] = "1,5"
    lines[begin + 12] = " ".join(tokens)
    path.write_text("\n".join(lines))
    refuse(path, "row 12 has '1,5' in column 'z', which is not a number; export it again")


@pytest.mark.parametrize(("change", "found"), [(" 1.0", 18), ("", 16)])
def test_an_ascii_row_of_another_length_is_named(tmp_path: Path, change: str, found: int) -> None:
    path = write_scene(tmp_path / "a.ply", scene_columns(50), "ascii")
    lines = path.read_text().splitlines()
    row = lines.index("end_header") + 1 + 7
    lines[row] = lines[row] + change if change else " ".join(lines[row].split()[:-1])
    path.write_text("\n".join(lines))
    refuse(path, f"row 7 has {found} values where the header names 17 properties; export it again")


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_an_absurd_count_before_the_gaussians(tmp_path: Path, encoding: str) -> None:
    camera = element_bytes("camera", {"a": np.arange(3.0)}, encoding, count=10**30)
    vertex = element_bytes("vertex", scene_columns(3), encoding)
    path = write_ply_file(tmp_path / "a.ply", [camera, vertex], encoding)
    refuse(path, "is cut off: .* rows of element 'vertex'.*; copy or export it again")


def test_a_mesh(tmp_path: Path) -> None:
    vertex = element_bytes("vertex", {name: np.zeros(3) for name in "xyz"})
    refuse(
        write_ply_file(tmp_path / "a.ply", [vertex, FACES]),
        r"is a mesh \(2 faces\), not a 3D Gaussian scene; train",
    )


def test_a_plain_point_cloud(tmp_path: Path) -> None:
    columns = {name: np.zeros(3) for name in ("x", "y", "z", "red", "green", "blue")}
    path = write_scene(tmp_path / "a.ply", columns, types={"red": "uchar", "green": "uchar", "blue": "uchar"})
    refuse(path, "is a plain point cloud without scales and rotations; train it as a 3DGS scene first")


@pytest.mark.parametrize("name", ["x", "f_dc_1", "opacity"])
def test_a_missing_property_is_named(tmp_path: Path, name: str) -> None:
    columns = scene_columns(3)
    del columns[name]
    path = write_scene(tmp_path / "a.ply", columns)
    refuse(path, f"no property '{name}' among 16 read; export it as a 3D Gaussian scene")


def test_a_property_that_is_a_list(tmp_path: Path) -> None:
    columns = scene_columns(3)
    del columns["rot_0"]
    header, data = element_bytes("vertex", columns)
    path = write_ply_file(tmp_path / "a.ply", [(header + b"property list uchar float rot_0\n", data)])
    refuse(path, "property 'rot_0' is a list; export it as a 3D Gaussian scene")


@pytest.mark.parametrize(("place", "elements"), [("before", 2), ("in", 1)])
def test_a_list_before_or_in_the_gaussians_is_refused_by_name(
    tmp_path: Path, place: str, elements: int
) -> None:
    header, data = element_bytes("vertex", scene_columns(3))
    if place == "in":
        header += b"property list uchar int vertex_indices\n"
    path = write_ply_file(tmp_path / "a.ply", [FACES, (header, data)][-elements:])
    other = "face" if place == "before" else "vertex"
    what = f"the list property 'vertex_indices' of element '{other}' {place} element 'vertex'"
    refuse(path, f"{what}, so its rows cannot be found; export it without lists")


@pytest.mark.parametrize("count", [3, 10, 44, 72])
def test_f_rest_that_are_no_whole_bands(tmp_path: Path, count: int) -> None:
    columns = scene_columns(3)
    columns.update({f"f_rest_{index}": np.zeros(3) for index in range(count)})
    refuse(
        write_scene(tmp_path / "a.ply", columns),
        rf"must have 0, 9, 24 or 45 f_rest .*, got {count}; export it",
    )
