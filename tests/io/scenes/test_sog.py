"""SOG scenes against a decode row by row of the specification, a second library, and real twins."""

import json
import struct
import zipfile

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from tests.io.scenes.sog_maker import decode_row, files_of, make, webp, write_bundle, write_folder, zipped
from tests.kit.refused import refuse
from tests.scenes import real_scene

CASES = [(version, degree) for version in (1, 2) for degree in range(4)]


def assert_decoded(gaussians: bg.Gaussians, scene: dict, rows: range) -> None:
    """Float32 arithmetic on values up to 32: relative 1e-6 and as much of the range near 0."""
    assert len(gaussians) == len(rows)
    expected = [decode_row(scene, row) for row in rows]
    for name in ("means", "quats", "scales", "opacities", "sh"):
        values = np.array([row[name] for row in expected])
        np.testing.assert_allclose(getattr(gaussians, name), values, rtol=2e-6, atol=3e-7, err_msg=name)


@pytest.mark.parametrize(("version", "degree"), CASES)
def test_a_scene_equals_a_decode_row_by_row(tmp_path, version, degree):
    scene = make(250, degree, version)
    gaussians, notes = read_scene(write_bundle(tmp_path / "a.sog", scene))
    assert_decoded(gaussians, scene, range(250))
    assert (notes.format, notes.rows_read) == (f"SOG version {version}", 250)
    assert notes.sh_degree_stored == notes.sh_degree_used == degree
    assert notes.up is None


@pytest.mark.parametrize("version", [1, 2])
def test_folder_meta_and_archive_are_one_scene(tmp_path, version):
    scene = make(40, 1, version)
    folder = write_folder(tmp_path / "scene", scene)
    nested = {f"top/{name}": content for name, content in files_of(scene).items()}
    (tmp_path / "nested").write_bytes(zipped(nested, zipfile.ZIP_DEFLATED))
    packed = write_bundle(tmp_path / "a.PLY", scene, packing=zipfile.ZIP_DEFLATED)
    (folder / "meta.json").rename(folder / "other.name")
    (tmp_path / "copy").symlink_to(folder)
    first = bg.load(folder / "other.name")
    (folder / "other.name").rename(folder / "meta.json")
    for path in (folder, tmp_path / "copy", folder / "meta.json", packed, tmp_path / "nested"):
        other = bg.load(path)
        for name in ("means", "quats", "scales", "opacities", "sh"):
            np.testing.assert_array_equal(getattr(other, name), getattr(first, name))


def test_a_codebook_that_begins_with_null_is_extrapolated_as_the_engine_does(tmp_path):
    scene = make(64)
    codebook = scene["meta"]["sh0"]["codebook"]
    expected = codebook[1] + (codebook[1] - codebook[255]) / 255
    scene["sh0"][0, 0, 0] = 0
    codebook[0] = None
    gaussians = bg.load(write_bundle(tmp_path / "a.sog", scene))
    assert gaussians.sh[0, 0, 0] == pytest.approx(expected)


# ---- real scenes: each was re-encoded as PLY by a decoder of its own


@pytest.mark.parametrize("source", ["made 1", "made 2", "made 3", "skull.sog"])
def test_a_second_library_reads_the_same(tmp_path, source):
    """`gaussforge` decodes SOG 2 on its own; it stores logits, so ends of the opacities are cut off.

    It takes e^|x| - 1 in float32, whose rounding is 1.2e-7 times e^|x|: up to 2 for the skull, 4.5 for the
    others.
    """
    gaussforge = pytest.importorskip("gaussforge")
    kind, _, degree = source.partition(" ")
    is_made = kind == "made"
    path = write_bundle(tmp_path / "a.sog", make(300, int(degree))) if is_made else real_scene(source)
    converted = gaussforge.GaussForge().convert(path.read_bytes(), "sog", "ply")
    ply = tmp_path / "a.ply"
    ply.write_bytes(converted["data"])
    expected, gaussians = bg.load(ply), bg.load(path)
    np.testing.assert_allclose(gaussians.means, expected.means, rtol=1e-6, atol=6e-7)
    np.testing.assert_allclose(gaussians.scales, expected.scales, rtol=1e-6)
    np.testing.assert_allclose(gaussians.opacities, expected.opacities, atol=2e-6)
    np.testing.assert_allclose(gaussians.sh, expected.sh, atol=1e-6)
    cosines = (gaussians.quats * expected.quats).sum(axis=1)
    lengths = np.linalg.norm(gaussians.quats, axis=1) * np.linalg.norm(expected.quats, axis=1)
    np.testing.assert_allclose(np.abs(cosines) / lengths, 1, atol=1e-6)


# ---- damaged input: one sentence each


META_FAULTS = [
    ({"version": 3.0}, r"must be SOG of version 1 or 2, got version 3"),
    ({"count": 0}, r"count must be 1 to 33554432 Gaussians, got 0"),
    ({"count": 1e18}, r"count must be 1 to 33554432 Gaussians, got 1e\+18"),
    ({"count": 2.5}, "count must be 1 to"),
    ({"count": -3}, "count must be 1 to"),
    ({"count": None}, "count must be 1 to 33554432 Gaussians, got null"),
    ({"count": 250}, r"picture 'means_l.webp' must have 250 to 66536 pixels, .* got 8x8"),
    ({"means": None}, "means must be an object, got null"),
    ({"quats": {"files": []}}, r"quats.files must be a list of 1 or more, got \[\]"),
    ({"means": {"mins": [0, 0], "maxs": [1, 1, 1], "files": ["a", "b"]}}, "means.mins must be 3 numbers"),
    (
        {"sh0": {"codebook": ["x"], "files": ["sh0.webp"]}},
        r'sh0.codebook\[0\] must be a finite number, got "x"',
    ),
    (
        {"sh0": {"codebook": [0.0] * 257, "files": ["sh0.webp"]}},
        "sh0.codebook must be a list of 1 to 256, got 257",
    ),
    ({"quats": {"files": ["none.webp"]}}, r"names the file 'none.webp', which is not (there|in the archive)"),
    (
        {"shN": {"count": 70000, "bands": 1, "codebook": [1.0], "files": ["a", "b"]}},
        "shN.count must be a whole number 1 to 65536, got 70000",
    ),
    (
        {"shN": {"count": 7, "bands": 4, "codebook": [1.0], "files": ["a", "b"]}},
        "shN.bands must be a whole number 1 to 3, got 4",
    ),
]


@pytest.mark.parametrize("form", ["folder", "archive"])
@pytest.mark.parametrize(("keys", "sentence"), META_FAULTS, ids=[fault[1][:30] for fault in META_FAULTS])
def test_a_field_at_fault_is_named(tmp_path, form, keys, sentence):
    scene = make(50)
    scene["meta"] |= keys
    if form == "folder":
        refuse(write_folder(tmp_path / "a", scene), sentence)
    else:
        refuse(write_bundle(tmp_path / "a.sog", scene), sentence)


@pytest.mark.parametrize("name", ["../a.webp", "/etc/passwd", "x/../../a.webp", "C:\\a.webp", ""])
def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path, name):
    (tmp_path / "a.webp").write_bytes(webp(np.zeros((8, 8, 4), np.uint8)))
    scene = make(50)
    scene["meta"]["quats"]["files"] = [name]
    refuse(write_folder(tmp_path / "scene", scene), "which lies outside its folder; put it beside")


def damage(files: dict[str, bytes], name: str, content: bytes | None) -> dict[str, bytes]:
    files = dict(files)
    if content is None:
        del files[name]
    else:
        files[name] = content
    return files


LOSSY = webp(np.zeros((8, 8, 3), np.uint8), lossless=False)
FILE_FAULTS = {
    "missing": ("scales.webp", None, "'scales.webp', which is not"),
    "no picture": ("scales.webp", b"hello", "picture 'scales.webp' must be a WebP, but is not"),
    "empty": ("scales.webp", b"", "picture 'scales.webp' must be a WebP, but is not"),
    "small": (
        "quats.webp",
        webp(np.zeros((4, 4, 4), np.uint8)),
        "'quats.webp' must have 50 to 65736 pixels, .* 4x4",
    ),
    "lossy": ("sh0.webp", LOSSY, "'sh0.webp' must be a lossless WebP, got a lossy one"),
    "cut off": ("sh0.webp", webp(make(50)["sh0"])[:100], "(sh0.webp|picture).*(damaged|cannot be read)"),
    "no JSON": ("meta.json", b'{"means" 1 "files"}', "is not JSON .*; export it as SOG again"),
    "JSON cut off": ("meta.json", json.dumps(make(50)["meta"]).encode()[:300], "is not JSON"),
    "not UTF-8": ("meta.json", b'{"means":"\xff","files"}', "is not JSON"),
    "too large": ("meta.json", b'{"means" "files"' + b"[" * (1 << 21), "would take .* MiB of memory"),
}


@pytest.mark.parametrize("form", ["folder", "archive"])
@pytest.mark.parametrize("fault", FILE_FAULTS)
def test_a_file_at_fault_is_named(tmp_path, form, fault):
    name, content, sentence = FILE_FAULTS[fault]
    files = damage(files_of(make(50)), name, content)
    if form == "archive":
        (tmp_path / "a.sog").write_bytes(zipped(files))
        refuse(tmp_path / "a.sog", sentence)
    else:
        (tmp_path / "a").mkdir()
        for file, content in files.items():
            (tmp_path / "a" / file).write_bytes(content)
        refuse(tmp_path / "a", sentence)


def huge_webp(width: int, height: int) -> bytes:
    """A few bytes that claim to be a picture of so many pixels."""
    bits = (width - 1) | (height - 1) << 14
    body = b"VP8L" + struct.pack("<IBI", 25, 0x2F, bits) + bytes(20)
    return b"RIFF" + struct.pack("<I", len(body) + 4) + b"WEBP" + body


def test_a_picture_with_far_more_pixels_than_gaussians_is_not_decoded(tmp_path, monkeypatch):
    monkeypatch.setattr("OpenImageIO.ImageInput.open", lambda *_: pytest.fail("a decoder saw it"))
    (tmp_path / "a.sog").write_bytes(zipped(files_of(make(50)) | {"sh0.webp": huge_webp(9000, 9000)}))
    refuse(tmp_path / "a.sog", "picture 'sh0.webp' must have 50 to 65736 pixels, .*, got 9000x9000")


def test_few_bytes_that_claim_many_gaussians_are_refused_before_memory_is_asked_for(tmp_path):
    scene = make(50)
    scene["meta"]["count"] = 16_000_000
    files = files_of(scene) | {
        f"{name}.webp": huge_webp(4000, 4000) for name in ("means_l", "means_u", "quats", "scales", "sh0")
    }
    (tmp_path / "a.sog").write_bytes(zipped(files))
    refuse(tmp_path / "a.sog", "16000000 Gaussians take 854 MiB in memory and 0 MiB in the file")


@pytest.mark.parametrize(
    ("pixels", "keys", "sentence"),
    [
        ((3, 64 * 8), {}, "must hold 64 centroids of 1 bands, 150 of them, in a row, got 512x3"),
        ((2, 64 * 3), {}, "must hold 64 centroids of 1 bands, 150 of them, in a row, got 192x2"),
        ((3, 64 * 3), {"count": 100}, r"'shN_labels.webp' must hold labels below 100, got 1[0-4]\d"),
    ],
)
def test_a_palette_that_does_not_fit_is_refused(tmp_path, pixels, keys, sentence):
    scene = make(500, 1)
    scene["shN_centroids"] = np.zeros((*pixels, 3), np.uint8)
    scene["meta"]["shN"] |= keys
    refuse(write_bundle(tmp_path / "a.sog", scene), sentence)


# ---- archives


def test_an_archive_without_a_scene_says_what_it_holds(tmp_path):
    (tmp_path / "a.zip").write_bytes(zipped({"x/garden.ply": b"ply", **{f"{i}.jpg": b"" for i in range(9)}}))
    refuse(
        tmp_path / "a.zip",
        "without a SOG scene: it holds 'x/garden.ply', '0.jpg', '1.jpg' and 7 more; unpack",
    )
    (tmp_path / "b.zip").write_bytes(zipped({"garden.ply": b"ply"}))
    refuse(tmp_path / "b.zip", "it holds 'garden.ply'; unpack it and name the scene inside")
    (tmp_path / "c.zip").write_bytes(zipped({}))
    refuse(tmp_path / "c.zip", "is a zip archive without files")
    (tmp_path / "d.zip").write_bytes(
        zipped({"s/lod-meta.json": b"{}", "s/0_0/meta.json": b"{}", "t/meta.json": b""})
    )
    refuse(tmp_path / "d.zip", "zip archive of a streamed SOG scene; unpack it and name its lod-meta.json")
    (tmp_path / "e.zip").write_bytes(zipped({"s/meta.json": b"{}", "t/meta.json": b""}))
    refuse(tmp_path / "e.zip", "zip archive of 2 SOG scenes in folders of their own; unpack")


def test_a_damaged_archive_is_refused(tmp_path):
    content = write_bundle(tmp_path / "whole", make(50)).read_bytes()
    path = tmp_path / "a.sog"
    path.write_bytes(content[: len(content) // 2])
    refuse(path, "is a damaged zip archive .*; download or copy it again")
    path.write_bytes(b"PK\x03\x04abc")
    refuse(path, "is a damaged zip archive")
    place = content.index(b"WEBP") + 200
    path.write_bytes(content[:place] + bytes([content[place] ^ 255]) + content[place + 1 :])
    refuse(path, "its member 'means_l.webp' is damaged .*CRC")


def test_a_huge_directory_of_an_archive_is_not_read(tmp_path):
    (tmp_path / "a.sog").write_bytes(zipped({f"{i:0100d}": b"" for i in range(10_000)}))
    refuse(tmp_path / "a.sog", "its directory is larger than 1 MiB")


def test_a_member_that_unpacks_to_far_more_than_its_picture_needs_is_refused(tmp_path):
    files = files_of(make(50))
    files["sh0.webp"] += bytes(1 << 22)
    (tmp_path / "a.sog").write_bytes(zipped(files, zipfile.ZIP_DEFLATED))
    refuse(tmp_path / "a.sog", "its member 'sh0.webp' must have at most 0.1 MiB, got more")
    files["meta.json"] += bytes(1 << 26)
    (tmp_path / "a.sog").write_bytes(zipped(files, zipfile.ZIP_DEFLATED))
    refuse(tmp_path / "a.sog", "its member 'meta.json' must have at most 32.0 MiB, got more")


def test_packings_that_take_much_memory_and_encryption_are_refused(tmp_path):
    path = write_bundle(tmp_path / "a.sog", make(50), packing=zipfile.ZIP_LZMA)
    refuse(path, "its member 'meta.json' is packed in a way that is not read; unpack it")
    content = bytearray(write_bundle(path, make(50)).read_bytes())
    content[content.rindex(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    refuse(path, "its member 'meta.json' is encrypted; unpack it")


def test_nothing_of_an_archive_stays_on_the_disk(tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    bg.load(write_bundle(tmp_path / "a.sog", make(50, 1)))
    files = files_of(make(50)) | {"sh0.webp": webp(make(50)["sh0"])[:100]}
    (tmp_path / "b.sog").write_bytes(zipped(files))
    with pytest.raises(bg.SceneError, match=r"b\.sog: its member 'sh0.webp'"):
        bg.load(tmp_path / "b.sog")
    assert list((tmp_path / "temporary").iterdir()) == []
