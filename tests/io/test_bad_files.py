"""Scene files that are no scenes, and PLY files at fault: each gives a sentence with the cure."""

import numpy as np
import pytest

import brushgs.formats.files
from tests.io.ply_maker import element_bytes, scene_columns, write_ply_file, write_scene
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

FACES = (b"element face 2\nproperty list uchar int vertex_indices\n", (b"\x03" + b"\0" * 12) * 2)


@for_each(
    "error, sentence",
    [
        (PermissionError(13, "Permission denied"), "may not be read; change its permissions"),
        (OSError(5, "I/O error"), r"\(I/O error\)"),
    ],
)
def test_errors_of_the_system_are_reported_in_a_sentence(tmp_path, error, sentence):
    def fail(*args, **kwargs):
        raise error

    path = write_scene(tmp_path / "a.ply", scene_columns(3))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(brushgs.formats.files.Path, "open", fail)
        refuse(path, sentence)


LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n"
NO_SCENE = "is of no scene format that is read"


@for_each(
    "name, content, sentence",
    [
        ("a.ply", b"", "is empty; copy or download it again"),
        ("a.ply", LFS, "LFS pointer.* run 'git lfs pull'"),
        ("a.ply", b"\xef\xbb\xbf\n<html>", "is a web page or XML, not a scene"),
        ("a.sog", b"PK\x03\x04abc", r"is a damaged zip archive \(File is not a zip file\); download or copy"),
        ("a.json", b'{"camera_angle_x": 1}', "is JSON, but of no SOG scene .* and no glTF model; name the"),
        ("cameras.json", b"\xef\xbb\xbf [{}]", "is JSON, as lists of cameras are, not a scene; name the"),
        ("a.splat", b"<!DOCTYPE html><html>", "is a web page or XML, not a scene"),
        ("a.ksplat", LFS, "LFS pointer"),
        ("a.glb", b"glTF\x02", r"is damaged: it has no JSON chunk; export it again"),
        ("a.lcc", b"\0" * 64, r"is a \.lcc scene, which is not read; convert it"),
        ("a.ply", b"\0" * 64, rf"{NO_SCENE}: it begins with b'.*'; export it as \.ply"),
        ("a.ply", b"plywood", NO_SCENE),
    ],
)
def test_a_file_of_another_kind_is_named(tmp_path, name, content, sentence):
    refuse_bytes(tmp_path / name, content, sentence)


HEAD = "ply\nformat binary_little_endian 1.0\nelement vertex "


@for_each(
    "header, sentence",
    [
        ("ply\nformat ascii 1.0\nelement vertex 1\n", "the header has no 'end_header' line; .* get it again"),
        ("ply\nelement vertex 1\nend_header\n", "the header has no 'format' line; .* get it again"),
        ("ply\nformat middle_endian 1.0\nend_header\n", "header line 'format middle_endian 1.0' is not PLY"),
        (HEAD + "-1\nend_header\n", "element 'vertex' must have a whole number of rows, got '-1'"),
        (HEAD + "1\nproperty quad x\nend_header\n", "'x' has the unknown type 'quad'; write .* double"),
        (HEAD + "1\n" + "property float x\n" * 2 + "end_header\n", "'x' stands twice in the header"),
    ],
)
def test_a_header_that_makes_no_sense(tmp_path, header, sentence):
    refuse_bytes(tmp_path / "a.ply", header.encode(), sentence)


@for_each("count", [10**18, 10**30, 1_500_000_000])
@for_each("encoding", ["ascii", "binary_little_endian"])
def test_an_absurd_count_is_refused_before_memory_is_allocated(tmp_path, count, encoding):
    path = write_scene(tmp_path / "a.ply", scene_columns(3), encoding, count=count)
    refuse(path, rf"is cut off: of {count} rows of element 'vertex' \d+ are complete and .*\d+ bytes are")
    camera = element_bytes("camera", {"a": np.arange(3.0)}, encoding, count=count)
    vertex = element_bytes("vertex", scene_columns(3), encoding)
    path = write_ply_file(tmp_path / "a.ply", [camera, vertex], encoding)
    refuse(path, "is cut off: .* rows of element 'vertex'.*; copy or export it again")


def test_a_binary_file_cut_off_says_how_many_rows_and_bytes(tmp_path):
    content = write_scene(tmp_path / "a.ply", scene_columns(50), "binary_big_endian").read_bytes()
    sentence = "of 50 rows of element 'vertex' 48 are complete and 75 bytes are missing; copy or export"
    refuse_bytes(tmp_path / "a.ply", content[:-75], sentence)  # a row has 17 * 4 = 68 bytes


@for_each(
    "change, sentence",
    [
        (lambda row: [*row[:2], "1,5", *row[3:]], "row 12 has '1,5' in column 'z', which is not a number"),
        (lambda row: [*row, "1.0"], "row 12 has 18 values where the header names 17 properties; export it"),
        (lambda row: row[:-1], "row 12 has 16 values where the header names 17 properties; export it again"),
    ],
)
def test_a_row_of_text_at_fault_is_named(tmp_path, change, sentence):
    path = write_scene(tmp_path / "a.ply", scene_columns(50), "ascii")
    lines = path.read_text().splitlines()
    place = lines.index("end_header") + 1 + 12
    lines[place] = " ".join(change(lines[place].split()))
    refuse_bytes(path, "\n".join(lines).encode(), sentence)


def without(name: str) -> dict[str, np.ndarray]:
    return {other: values for other, values in scene_columns(3).items() if other != name}


def ending(columns: dict[str, np.ndarray], more: bytes) -> tuple[bytes, bytes]:
    header, data = element_bytes("vertex", columns)
    return header + more, data


CLOUD = {name: np.zeros(3) for name in (*"xyz", "red", "green", "blue")}
LIST = b"property list uchar int vertex_indices\n"
IS_LIST = "the list property 'vertex_indices' of element"
SCENE_OF_LISTS = "so its rows cannot be found; export it without lists"
NO_SCENES = [
    ([element_bytes("vertex", {n: CLOUD[n] for n in "xyz"}), FACES], r"is a mesh \(2 faces\), not a 3D Gaus"),
    ([element_bytes("vertex", CLOUD)], "is a plain point cloud without scales and rotations; train it as a"),
    ([ending(without("rot_0"), b"property list uchar float rot_0\n")], "property 'rot_0' is a list; export"),
    ([FACES, ending(scene_columns(3), b"")], f"{IS_LIST} 'face' before element 'vertex', {SCENE_OF_LISTS}"),
    ([ending(scene_columns(3), LIST)], f"{IS_LIST} 'vertex' in element 'vertex', {SCENE_OF_LISTS}"),
]
for name in ("x", "f_dc_1", "opacity"):
    sentence = f"no property '{name}' among 16 read; export it as a 3D"
    NO_SCENES.append(([element_bytes("vertex", without(name))], sentence))
for count in (3, 44, 72):
    sentence = rf"must have 0, 9, 24 or 45 f_rest .*, got {count}; export it"
    rest = {f"f_rest_{index}": np.zeros(3) for index in range(count)}
    NO_SCENES.append(([element_bytes("vertex", scene_columns(3) | rest)], sentence))


@for_each("elements, sentence", NO_SCENES)
def test_elements_that_are_no_scene_are_named(tmp_path, elements, sentence):
    refuse(write_ply_file(tmp_path / "a.ply", elements), sentence)
