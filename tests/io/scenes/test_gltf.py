"""glTF with KHR_gaussian_splatting: copied attributes, placed meshes, and what is refused."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.values.sh import C0, sh_basis
from tests.io.scenes import spz_format
from tests.io.scenes.gltf_maker import PREFIX, Attributes, Model, make
from tests.kit.for_each import for_each
from tests.kit.json_changes import with_value
from tests.kit.refusals import refuse, refuse_bytes
from tests.passes.scenes import covariances


def model_of(attributes: Attributes, **options: object) -> Model:
    model = Model()
    model.mesh(attributes, **options)
    return model


def coefficients(attributes: Attributes) -> np.ndarray:
    """[n, terms, 3] in the order of degrees."""
    names = sorted(name for name in attributes if "COEF" in name)
    return np.stack([attributes[name] for name in names], axis=1)


def assert_copied(gaussians: bg.Gaussians, attributes: Attributes) -> None:
    """Means and coefficients are copied; scales and opacities pass through logs and logits."""
    np.testing.assert_array_equal(gaussians.means, attributes["POSITION"])
    np.testing.assert_array_equal(gaussians.quats, attributes[f"{PREFIX}ROTATION"][:, [3, 0, 1, 2]])
    np.testing.assert_allclose(gaussians.scales, attributes[f"{PREFIX}SCALE"], rtol=2e-6)
    np.testing.assert_allclose(gaussians.opacities, attributes[f"{PREFIX}OPACITY"][:, 0], atol=2e-7)
    np.testing.assert_array_equal(gaussians.sh, coefficients(attributes))


@for_each("degree", range(4))
@for_each("name", ["a.glb", "a.gltf", "no_suffix"])
def test_attributes_are_copied(tmp_path, degree, name):
    attributes = make(70, degree)
    gaussians, notes = read_scene(model_of(attributes).write(tmp_path / name))
    assert_copied(gaussians, attributes)
    assert (gaussians.opacities[0], gaussians.opacities[1]) == (0, 1)
    assert (notes.format, notes.up) == ("glTF with KHR_gaussian_splatting", "+y")
    assert notes.sh_degree_stored == notes.sh_degree_used == degree
    assert notes.unknown == ()


def test_interleaved_attributes_and_a_file_beside_are_read(tmp_path):
    attributes = make(70, 1)
    model = Model()
    model.interleaved(attributes)
    (tmp_path / "große daten.bin").write_bytes(model.data)
    for uri in ("gro%C3%9Fe%20daten.bin", "große daten.bin", "./große daten.bin"):
        model.top["buffers"][0]["uri"] = uri
        (tmp_path / "a.gltf").write_bytes(model.json())
        assert_copied(bg.load(tmp_path / "a.gltf"), attributes)


def test_normalized_integers_are_fractions(tmp_path):
    attributes = make(9)
    attributes[f"{PREFIX}ROTATION"] = np.tile(np.array([[0, -128, 127, 1]], np.int8), (9, 1))
    attributes[f"{PREFIX}OPACITY"] = np.arange(0, 65536, 8191, dtype=np.uint16)[:9, None]
    attributes[f"{PREFIX}SCALE"] = np.tile(np.array([[1, 2, 32767]], np.int16), (9, 1))
    normalized = tuple(f"{PREFIX}{name}" for name in ("ROTATION", "OPACITY", "SCALE"))
    gaussians = bg.load(model_of(attributes, normalized=normalized).write(tmp_path / "a.glb"))
    np.testing.assert_allclose(gaussians.quats[0], [1 / 127, 0, -1, 1], rtol=1e-6)
    np.testing.assert_allclose(gaussians.scales[0], [1 / 32767, 2 / 32767, 1], rtol=2e-6)
    np.testing.assert_allclose(gaussians.opacities, np.arange(0, 65536, 8191)[:9] / 65535, atol=2e-7)


def test_names_and_colors_of_the_first_draft_are_read(tmp_path):
    attributes = make(20)
    rgba = np.random.default_rng(0).integers(0, 256, (20, 4), dtype=np.uint8)
    stored = {"POSITION": attributes["POSITION"], "COLOR_0": rgba}
    stored |= {f"_{name}": attributes[f"{PREFIX}{name}"] for name in ("ROTATION", "SCALE")}
    rest = np.random.default_rng(1).normal(size=(3, 20, 3)).astype(np.float32)
    stored |= {f"_SH_DEGREE_1_COEFF_{index}": rest[index] for index in range(3)}
    gaussians = bg.load(model_of(stored).write(tmp_path / "a.glb"))
    np.testing.assert_allclose(0.5 + C0 * gaussians.sh[:, 0], rgba[:, :3] / 255, atol=1e-6)
    np.testing.assert_allclose(gaussians.opacities, rgba[:, 3] / 255, atol=2e-7)
    np.testing.assert_array_equal(gaussians.sh[:, 1:].transpose(1, 0, 2), rest)


# ---- nodes


def colors_seen(sh: np.ndarray, direction: np.ndarray) -> np.ndarray:
    degree = int(np.sqrt(sh.shape[1])) - 1
    return np.einsum("k,nkc->nc", sh_basis(direction[None], degree)[0], sh.astype(np.float64))


def assert_placed(placed: bg.Gaussians, plain: bg.Gaussians, matrix: np.ndarray, turn: np.ndarray) -> None:
    """Float32 columns: 1e-6 of the largest value."""
    linear = matrix[:3, :3]
    means = plain.means @ linear.T + matrix[:3, 3]
    np.testing.assert_allclose(placed.means, means, atol=2e-6 * np.abs(means).max())
    expected = linear @ covariances(plain) @ linear.T
    np.testing.assert_allclose(covariances(placed), expected, atol=3e-6 * np.abs(expected).max())
    np.testing.assert_allclose(placed.opacities, plain.opacities, atol=1e-7)
    for direction in np.random.default_rng(0).normal(size=(20, 3)):
        direction /= np.linalg.norm(direction)
        seen = colors_seen(placed.sh, turn @ direction)
        np.testing.assert_allclose(seen, colors_seen(plain.sh, direction), atol=4e-6)


TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.3])
TRANSLATION = [0.5, -2.0, 1.25]


@for_each("stretch", [(2.0, 0.5, 1.0), (-1.0, 1.0, 1.0), (3.0, 3.0, -0.1)])
def test_an_unevenly_scaled_mesh_has_the_covariances_of_its_image(tmp_path, stretch):
    attributes = make(60, 2)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = TURN.as_matrix() @ np.diag(stretch), TRANSLATION
    model = model_of(attributes)
    model.top["nodes"] = [{"matrix": matrix.T.ravel().tolist(), "mesh": 0}]
    placed = bg.load(model.write(tmp_path / "a.glb"))
    plain = bg.load(model_of(attributes).write(tmp_path / "b.glb"))
    assert_placed(placed, plain, matrix, TURN.as_matrix() @ np.diag(np.sign(stretch)))


def test_meshes_of_a_tree_of_nodes_follow_each_other(tmp_path):
    first, second = make(30, 1, seed=1), make(20, 0, seed=2)
    model = Model()
    model.mesh(first)
    model.mesh(second)
    model.top["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]})  # no splats
    nodes = [{"mesh": 1, "translation": [0, 0, 1]}, {"children": [0, 2], "translation": [0, 5, 0]}]
    nodes += [{"mesh": 0, "scale": [2, 2, 2]}, {"mesh": 2}, {"mesh": 0}]  # the last in no scene
    model.top |= {"nodes": nodes, "scenes": [{"nodes": [4]}, {"nodes": [1, 3]}], "scene": 1}
    gaussians = bg.load(model.write(tmp_path / "a.glb"))
    np.testing.assert_allclose(gaussians.means[:20], second["POSITION"] + [0, 5, 1], atol=1e-6)
    np.testing.assert_allclose(gaussians.means[20:], 2 * first["POSITION"] + [0, 5, 0], atol=1e-6)
    np.testing.assert_allclose(gaussians.scales[20:], 2 * first[f"{PREFIX}SCALE"], rtol=3e-6)
    np.testing.assert_array_equal(gaussians.sh[:20, 0], second[f"{PREFIX}SH_DEGREE_0_COEF_0"])
    assert not gaussians.sh[:20, 1:].any()
    np.testing.assert_array_equal(gaussians.sh[20:], coefficients(first))


# ---- what is not read, is refused, or is damaged


def packed_model(content, kind, view):
    """A model as Cesium writes it: accessors without data, and a buffer view with the SPZ file."""
    model = Model()
    model.data = bytes(4) + content
    model.top["bufferViews"] = [{"buffer": 0, "byteOffset": 4, "byteLength": len(content)}]
    model.top["accessors"] = [{"componentType": 5126, "count": 50, "type": "VEC3"}]
    extensions = {kind: view}
    if kind.startswith("KHR_gaussian_splatting"):
        extensions = {"KHR_gaussian_splatting": {"extensions": extensions}}
    primitive = {"attributes": {"POSITION": 0, "COLOR_0": 0}, "mode": 0, "extensions": extensions}
    model.top["meshes"] = [{"primitives": [primitive]}]
    return model


SPZ = "KHR_gaussian_splatting_compression_spz"
CESIUM = "KHR_spz_gaussian_splats_compression"


@for_each("kind", [f"{SPZ}_2", SPZ, CESIUM])
@for_each("degree", [0, 3])
def test_splats_packed_as_spz_are_those_of_the_spz_file(tmp_path, kind, degree):
    content = spz_format.encode(spz_format.make(50, degree), 2, flags=1)
    (tmp_path / "a.spz").write_bytes(content)
    plain, plain_notes = read_scene(tmp_path / "a.spz")
    model = packed_model(content, kind, {"bufferView": 0})
    packed, notes = read_scene(model.write(tmp_path / "a.glb"))
    assert (notes.training, plain_notes.training) == ("antialiased", "antialiased")
    assert notes.format == "glTF with KHR_gaussian_splatting, packed as SPZ"
    for name in ("means", "quats", "sh"):
        np.testing.assert_array_equal(getattr(packed, name), getattr(plain, name))
    np.testing.assert_allclose(packed.opacities, plain.opacities, atol=1e-7)
    placed = {"mesh": 0, "rotation": TURN.as_quat().tolist(), "translation": TRANSLATION}
    model.top["nodes"] = [placed, {"mesh": 0}]
    both = bg.load(model.write(tmp_path / "b.glb"))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = TURN.as_matrix(), TRANSLATION
    assert_placed(both.take(slice(0, 50)), plain, matrix, TURN.as_matrix())
    np.testing.assert_array_equal(both.means[50:], plain.means)


WHOLE = spz_format.encode(spz_format.make(50, 0), 2)


@for_each(
    "content, kind, view, sentence",
    [
        (WHOLE[:-30], SPZ, {"bufferView": 0}, "is cut off|cannot be decompressed"),
        (b"hello" * 9, SPZ, {"bufferView": 0}, "no SPZ scene|hold"),
        (WHOLE, SPZ, {"bufferView": "x"}, 'refers to bufferViews "x", which is'),
        (WHOLE, SPZ, {"bufferView": []}, "refers to bufferViews .*, which is"),
        (WHOLE, SPZ, {"bufferView": 7}, "refers to bufferViews 7, which is"),
        (WHOLE, CESIUM, 3, "must be an object, got 3"),
    ],
)
def test_packed_splats_at_fault_are_refused(tmp_path, content, kind, view, sentence):
    refuse(packed_model(content, kind, view).write(tmp_path / "a.glb"), sentence)


def test_models_without_splats_and_with_others_are_told(tmp_path):
    model = model_of(make(9), kernel="box")
    extensions = model.top["meshes"][0]["primitives"][0]["extensions"]
    extensions["EXT_something"] = {}
    assert read_scene(model.write(tmp_path / "a.glb"))[1].unknown == ("EXT_something", "kernel box")
    inner = {"EXT_compression_of_something": {"bufferView": 0}}
    extensions["KHR_gaussian_splatting"] = {"extensions": inner}
    sentence = "holds splats compressed by EXT_compression_of_something, which is not read; export it without"
    refuse(model.write(tmp_path / "a.glb"), sentence)
    extensions.clear()
    for name in ("a.glb", "a.gltf"):
        sentence = r"is a glTF model without Gaussian splats; export the splats as \.ply"
        refuse(model.write(tmp_path / name), sentence)
    path = model_of(make(9), colorSpace="lin_rec709_display").write(tmp_path / "a.glb")
    with pytest.warns(bg.SceneWarning, match=r"trained in linear colors .*, which are painted too dark"):
        bg.load(path)


ATTRIBUTES = "meshes/0/primitives/0/attributes"
FAULTS = [
    ("asset/version", "1.0", 'asset.version must be 2.0, as of glTF of version 2, got "1.0"'),
    (f"{ATTRIBUTES}/POSITION", ..., "a primitive of splats has no attribute POSITION"),
    (f"{ATTRIBUTES}/POSITION", 99, "attribute POSITION refers to accessors 99, which is missing"),
    (f"{ATTRIBUTES}/{PREFIX}SCALE", ..., "has no attribute KHR_gaussian_splatting:SCALE"),
    (f"{ATTRIBUTES}/{PREFIX}OPACITY", ..., "has no attribute KHR_gaussian_splatting:OPACITY"),
    (f"{ATTRIBUTES}/{PREFIX}SH_DEGREE_0_COEF_0", ..., "has no attribute .*:SH_DEGREE_0_COEF_0"),
    (f"{ATTRIBUTES}/{PREFIX}SH_DEGREE_1_COEF_2", ..., "must have all 3 coefficients of degree 1, got 2"),
    (f"{ATTRIBUTES}/{PREFIX}ROTATION", 0, r"attribute .*ROTATION must have 4 numbers a splat, got 3"),
    (ATTRIBUTES, [], r"meshes\[0\]\.primitives\[0\]\.attributes must be an object, got \[\]"),
    ("accessors/0/sparse", {"count": 1}, "attribute POSITION is a sparse accessor, which is not read"),
    ("accessors/0/componentType", 5130, "attribute POSITION must be a scalar or vector of numbers, got"),
    ("accessors/0/count", 31, "attribute POSITION lacks 12 bytes of its buffer view"),
    ("accessors/0/count", 29, "attributes of splats must all have 29 rows, like POSITION, got 30"),
    ("accessors/0/count", 1e18, r"accessors.0.\.count must be a whole number 0 to 10{12}, got 1e\+18"),
    ("accessors/0/bufferView", ..., "attribute POSITION refers to bufferViews null, which is missing"),
    ("bufferViews/0/byteStride", 4, "attribute POSITION has a stride of 4"),
    ("bufferViews/0/byteLength", 1e6, "buffer view 0 lacks .* bytes of its buffer"),
    ("bufferViews/0/extensions", {"EXT_meshopt_compression": {}}, "is compressed by EXT_meshopt_compression"),
    ("bufferViews/0/buffer", 1, "buffer view 0 refers to buffers 1, which is missing"),
    ("buffers/0/uri", "../a.bin", "names the file '../a.bin', which lies outside its folder"),
    ("buffers/0/uri", "%2e%2e/a.bin", "names the file '../a.bin', which lies outside its folder"),
    ("buffers/0/uri", "none.bin", "none.bin: there is no such model"),
    ("buffers/0/uri", "data:;base64,a", "buffer 0 is no base64 data URI"),
    ("buffers/0/uri", 7, r"buffers\[0\]\.uri must be text, got 7"),
    ("nodes", [{"mesh": 3}], "a node refers to meshes 3, which is missing"),
    ("nodes", [{"children": [1], "mesh": 0}, {"children": [1]}], "its nodes form a ring"),
    ("nodes", [{"mesh": 0, "rotation": [0, 0, 0, 0]}], "rotation of node 0 must not be zero"),
    ("nodes", [{"mesh": 0, "scale": [1, 1]}], r"nodes\[0\]\.scale must be 3 numbers, got \[1, 1\]"),
    ("nodes", [{"mesh": 0, "matrix": [1.0] * 16}], "matrix of node 0 must be affine"),
    ("nodes", [{"mesh": 0, "translation": [1e300, 0, 0]}], r"translation\[0\] must be a number below 1e18"),
    ("scenes", [{"nodes": [7]}], "a scene or node refers to nodes"),
]


@for_each("place, value, sentence", FAULTS)
def test_a_field_at_fault_is_named(tmp_path, place, value, sentence):
    model = model_of(make(30, 1))
    if place == "scenes":
        model.top["nodes"] = [{"mesh": 0}]
    model.top = with_value(model.top, place, value)
    refuse_bytes(tmp_path / "a.glb", model.glb(), sentence)


def test_nodes_beyond_all_measure_are_refused(tmp_path):
    model = model_of(make(9000))
    nodes = [{"scale": [1e17] * 3, "children": [index + 1]} for index in range(50)]
    model.top |= {"nodes": [*nodes, {"mesh": 0}], "scenes": [{"nodes": [0]}]}
    refuse(model.write(tmp_path / "a.glb"), "its nodes scale beyond all numbers")
    model.top |= {"nodes": [{"mesh": 0}] * 9000, "scenes": [{"nodes": list(range(9000))}]}
    sentence = "81000000 Gaussians take 4325 MiB in memory and 0 MiB in the file"
    refuse(model.write(tmp_path / "a.glb"), sentence)
    model.top |= {"nodes": [{"mesh": 0}] * 20_000, "scenes": [{"nodes": list(range(20_000))}]}
    refuse(model.write(tmp_path / "a.glb"), "its nodes form a ring, or there are too many")


def test_a_damaged_file_is_refused(tmp_path):
    content, path = model_of(make(30)).glb(), tmp_path / "a.glb"
    for damaged, sentence in (
        (content[:-100], f"is cut off: 100 of {len(content)} bytes are missing; download or copy it again"),
        (content[:4] + b"\1\0\0\0" + content[8:], "must be glTF of version 2, got version 1"),
        (content[:12] + b"\xff\xff\xff\x0f" + content[16:], "is damaged: a chunk is longer than the file"),
        (content.replace(b'"asset"', b'"asset '), "is not JSON .*; export it again"),
        (b'{"asset" "meshes"' + b"[" * (1 << 21), "would take .* MiB of memory"),
    ):
        refuse_bytes(path, damaged, sentence)
    refuse_bytes(tmp_path / "b.gltf", json.dumps([1]).encode(), "must be a JSON object, got")
