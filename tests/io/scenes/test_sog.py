"""What SOG scenes alone have: archives and folders, codebooks, pictures; `test_contract` has the rest."""

import json
import struct
import zipfile
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from tests.io.scenes.sog_maker import files_of, make, webp, write_bundle, write_folder, zipped
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes
from tests.scenes import still_life_of


@for_each("version", [1, 2])
def test_folder_meta_and_archive_are_one_scene(tmp_path, version):
    tmp_path = tmp_path / str(version)
    scene = make(40, 1, version)
    folder = write_folder(tmp_path / "scene", scene)
    nested = {f"top/{name}": content for name, content in files_of(scene).items()}
    (tmp_path / "nested").write_bytes(zipped(nested, zipfile.ZIP_DEFLATED))
    packed = write_bundle(tmp_path / "a.PLY", scene, packing=zipfile.ZIP_DEFLATED)
    (tmp_path / "copy").symlink_to(folder)
    (folder / "other.name").write_bytes((folder / "meta.json").read_bytes())
    first = bg.load(folder / "other.name")
    for path in (folder, tmp_path / "copy", folder / "meta.json", packed, tmp_path / "nested"):
        for name, column in bg.load(path).columns().items():
            np.testing.assert_array_equal(column, first.columns()[name])


def test_a_codebook_that_begins_with_null_is_extrapolated_as_the_engine_does(tmp_path):
    scene = make(64)
    codebook = scene["meta"]["sh0"]["codebook"]
    expected = codebook[1] + (codebook[1] - codebook[255]) / 255
    scene["sh0"][0, 0, 0] = 0
    codebook[0] = None
    assert bg.load(write_bundle(tmp_path / "a.sog", scene)).sh[0, 0, 0] == pytest.approx(expected)


# ---- damaged input: one sentence each


def bands(**fields):
    return {"shN": {"count": 7, "bands": 1, "codebook": [1.0], "files": ["a", "b"]} | fields}


META_FAULTS = [
    ({"version": 3.0}, r"must be SOG of version 1 or 2, got version 3"),
    ({"count": 0}, r"count must be 1 to 33554432 Gaussians, got 0"),
    ({"count": 1e18}, r"count must be 1 to 33554432 Gaussians, got 1e\+18"),
    ({"count": 2.5}, "count must be 1 to"),
    ({"count": None}, "count must be 1 to 33554432 Gaussians, got null"),
    ({"count": 250}, r"picture 'means_l.webp' must have 250 to 66536 pixels, .* got 8x8"),
    ({"means": None}, "means must be an object, got null"),
    ({"quats": {"files": []}}, r"quats.files must be a list of 1 or more, got \[\]"),
    ({"means": {"mins": [0, 0], "maxs": [1, 1, 1], "files": ["a", "b"]}}, "means.mins must be 3 numbers"),
    ({"sh0": {"codebook": ["x"], "files": ["a"]}}, r'sh0.codebook\[0\] must be a finite number, got "x"'),
    ({"sh0": {"codebook": [0.0] * 257, "files": ["a"]}}, "sh0.codebook must be a list of 1 to 256, got 257"),
    ({"quats": {"files": ["none.webp"]}}, r"names the file 'none.webp', which is not (there|in the archive)"),
    (bands(count=70000), "shN.count must be a whole number 1 to 65536, got 70000"),
    (bands(bands=4), "shN.bands must be a whole number 1 to 3, got 4"),
]
SMALL, LOSSY = webp(np.zeros((4, 4, 4), np.uint8)), webp(np.zeros((8, 8, 3), np.uint8), lossless=False)
FILE_FAULTS = [
    ({"scales.webp": None}, "'scales.webp', which is not"),
    ({"scales.webp": b"hello"}, "picture 'scales.webp' must be a WebP, but is not"),
    ({"scales.webp": b""}, "picture 'scales.webp' must be a WebP, but is not"),
    ({"quats.webp": SMALL}, "'quats.webp' must have 50 to 65736 pixels, .* 4x4"),
    ({"sh0.webp": LOSSY}, "'sh0.webp' must be a lossless WebP, got a lossy one"),
    ({"sh0.webp": webp(make(50)["sh0"])[:100]}, "(sh0.webp|picture).*(damaged|cannot be read)"),
    ({"meta.json": b'{"means" 1 "files"}'}, "is not JSON .*; export it as SOG again"),
    ({"meta.json": json.dumps(make(50)["meta"]).encode()[:300]}, "is not JSON"),
    ({"meta.json": b'{"means":"\xff","files"}'}, "is not JSON"),
    ({"meta.json": b'{"means" "files"' + b"[" * (1 << 21)}, "would take .* MiB of memory"),
]


@for_each("faults, sentence", META_FAULTS + FILE_FAULTS)
def test_a_field_or_file_at_fault_is_named(tmp_path, faults, sentence):
    scene = make(50)
    scene["meta"] |= {key: value for key, value in faults.items() if "." not in key}
    files = files_of(scene) | {key: value for key, value in faults.items() if "." in key}
    files = {name: content for name, content in files.items() if content is not None}
    refuse_bytes(tmp_path / "a.sog", zipped(files), sentence)
    folder = tmp_path / str(len(list(tmp_path.iterdir())))
    folder.mkdir()
    for name, content in files.items():
        (folder / name).write_bytes(content)
    refuse(folder, sentence)


@for_each("name", ["../a.webp", "/etc/passwd", "x/../../a.webp", "C:\\a.webp", ""])
def test_a_name_that_leads_out_of_the_folder_is_refused(tmp_path, name):
    (tmp_path / "a.webp").write_bytes(webp(np.zeros((8, 8, 4), np.uint8)))
    scene = make(50)
    scene["meta"]["quats"]["files"] = [name]
    refuse(write_folder(tmp_path / "scene", scene), "which lies outside its folder; put it beside")


def huge_webp(side):
    """A few bytes that claim to be a picture of so many pixels."""
    body = b"VP8L" + struct.pack("<IBI", 25, 0x2F, (side - 1) | (side - 1) << 14) + bytes(20)
    return b"RIFF" + struct.pack("<I", len(body) + 4) + b"WEBP" + body


def test_pictures_that_claim_to_be_huge_are_refused_before_memory_is_asked_for(tmp_path, monkeypatch):
    monkeypatch.setattr("OpenImageIO.ImageInput.open", lambda *_: pytest.fail("a decoder saw it"))
    content = zipped(files_of(make(50)) | {"sh0.webp": huge_webp(9000)})
    sentence = "picture 'sh0.webp' must have 50 to 65736 pixels, .*, got 9000x9000"
    refuse_bytes(tmp_path / "a.sog", content, sentence)
    scene = make(50)
    scene["meta"]["count"] = 16_000_000
    pictures = ("means_l", "means_u", "quats", "scales", "sh0")
    content = zipped(files_of(scene) | {f"{name}.webp": huge_webp(4000) for name in pictures})
    sentence = "16000000 Gaussians take 854 MiB in memory and 0 MiB in the file"
    refuse_bytes(tmp_path / "a.sog", content, sentence)


@for_each(
    "pixels, keys, sentence",
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


META = {"s/meta.json": b"{}", "t/meta.json": b""}
ARCHIVES = [
    ({"x/garden.ply": b"ply", **{f"{i}.jpg": b"" for i in range(9)}}, "'0.jpg', '1.jpg' and 7 more; unpack"),
    ({"garden.ply": b"ply"}, "SOG scene: it holds 'garden.ply'; unpack it and name the scene inside"),
    ({}, "is a zip archive without files"),
    ({"s/lod-meta.json": b"{}"} | META, "of a streamed SOG scene; unpack it and name its lod-meta.json"),
    (META, "zip archive of 2 SOG scenes in folders of their own; unpack"),
    ({f"{i:0100d}": b"" for i in range(10_000)}, "its directory is larger than 1 MiB"),
]


@for_each("files, sentence", ARCHIVES)
def test_an_archive_without_a_scene_says_what_it_holds(tmp_path, files, sentence):
    refuse_bytes(tmp_path / "a.zip", zipped(files), sentence)


def test_members_at_fault_are_refused_and_nothing_of_them_stays_on_the_disk(tmp_path, monkeypatch):
    path, scene, files = tmp_path / "a.sog", make(50), files_of(make(50))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    content = write_bundle(path, scene).read_bytes()
    assert len(bg.load(path)) == 50
    place = content.index(b"WEBP") + 200
    flipped = content[:place] + bytes([content[place] ^ 255]) + content[place + 1 :]
    refuse_bytes(path, flipped, "its member 'means_l.webp' is damaged .*CRC")
    place = content.rindex(b"PK\x01\x02") + 8
    encrypted = content[:place] + bytes([content[place] | 1]) + content[place + 1 :]
    refuse_bytes(path, encrypted, "its member 'meta.json' is encrypted; unpack it")
    write_bundle(path, scene, packing=zipfile.ZIP_LZMA)  # which takes much memory
    refuse(path, "its member 'meta.json' is packed in a way that is not read; unpack it")
    for name, size, most in (("sh0.webp", 1 << 22, "0.1"), ("meta.json", 1 << 26, "32.0")):
        content = zipped(files | {name: files[name] + bytes(size)}, zipfile.ZIP_DEFLATED)
        refuse_bytes(path, content, f"its member '{name}' must have at most {most} MiB, got more")
    assert list((tmp_path / "temporary").iterdir()) == []


def test_few_sizes_above_one_are_kept_exactly(tmp_path):
    """Fewer levels than a palette holds are padded in order, so that values are still found in it."""
    scene = still_life_of(1000)
    sizes = np.tile(np.exp([1.0, 2.0, 3.0]).astype(np.float32), (len(scene), 1))
    bg.save(replace(scene, scales=sizes, sh=scene.sh[:, :1]), tmp_path / "few.sog")
    np.testing.assert_allclose(bg.load(tmp_path / "few.sog").scales, sizes, rtol=1e-6)
