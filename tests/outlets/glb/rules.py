"""The rules of the glTF validator that such files can break, checked one by one."""

import numpy as np

from tests.outlets.glb.glb import COMPONENTS, TYPES

TARGETS = {"POSITION": 34962, "NORMAL": 34962, "TEXCOORD_0": 34962, "COLOR_0": 34962}
LISTS = {"accessors", "bufferViews", "buffers", "cameras", "images", "materials", "meshes", "nodes"}
LISTS |= {"samplers", "scenes", "textures"}


def check_rules(glb):
    top = glb.top
    assert top["asset"]["version"] == "2.0"
    known = LISTS | {"asset", "scene", "extensionsUsed"}
    assert set(top) <= known
    assert all(top[name] for name in LISTS if name in top)  # no empty list
    assert glb.text.rstrip(b" ").endswith(b"}")
    _check_buffer(glb)
    used = {name: set() for name in LISTS}
    used["scenes"].add(top["scene"])
    for scene in top["scenes"]:
        used["nodes"].update(scene["nodes"])
    _check_nodes(top, used)
    for mesh in top["meshes"]:
        for primitive in mesh["primitives"]:
            _check_primitive(glb, primitive, used)
    for material in top["materials"]:
        _check_material(material, used)
    for texture in top["textures"]:
        used["samplers"].add(texture["sampler"])
        used["images"].add(texture["source"])
    for sampler in top["samplers"]:
        assert sampler["magFilter"] in (9728, 9729)
        assert sampler["minFilter"] in (9728, 9729, 9984, 9985, 9986, 9987)
        assert {sampler["wrapS"], sampler["wrapT"]} <= {33071, 33648, 10497}
    for image in top["images"]:
        assert image["mimeType"] == "image/png"
        assert not set(image) & {"uri"}
        used["bufferViews"].add(image["bufferView"])
        assert "target" not in top["bufferViews"][image["bufferView"]]
    for camera in top["cameras"]:
        _check_camera(camera)
    for number in used["accessors"]:
        used["bufferViews"].add(top["accessors"][number]["bufferView"])
    used["buffers"] = {view["buffer"] for view in top["bufferViews"]}
    for name in LISTS:
        assert used[name] == set(range(len(top.get(name, [])))), f"{name}: missing or unused"
    extensions = set().union(*(material.get("extensions", ()) for material in top["materials"]))
    assert sorted(extensions) == top.get("extensionsUsed", [])


def _check_camera(camera):
    lens = camera["perspective"]
    assert camera["type"] == "perspective"
    assert 0 < lens["yfov"] < np.pi
    assert min(lens["aspectRatio"], lens["znear"]) > 0


def _check_buffer(glb):
    (buffer,) = glb.top["buffers"]
    assert "uri" not in buffer
    assert 0 <= len(glb.binary) - buffer["byteLength"] < 4
    assert not any(glb.binary[buffer["byteLength"] :])
    end = 0
    for view in glb.top["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] >= end  # none overlaps another
        assert view["byteLength"] > 0
        assert "byteStride" not in view
        end = view["byteOffset"] + view["byteLength"]
    assert end <= buffer["byteLength"]


def _check_nodes(top, used):
    parents = {}
    for number, node in enumerate(top["nodes"]):
        assert set(node) <= {"name", "rotation", "translation", "children", "camera", "mesh"}
        assert np.isfinite(node.get("translation", [0, 0, 0])).all()
        assert abs(np.linalg.norm(node.get("rotation", [0, 0, 0, 1])) - 1) < 1e-6
        for child in node.get("children", []):
            assert child not in parents, "a node has one parent"
            parents[child] = number
        used["nodes"].update(node.get("children", []))
        used["cameras"].update([node["camera"]] if "camera" in node else [])
        used["meshes"].update([node["mesh"]] if "mesh" in node else [])
    for scene in top["scenes"]:
        assert not set(scene["nodes"]) & set(parents), "a scene has roots only"


def _check_primitive(glb, primitive, used):
    assert primitive.get("mode", 4) == 4
    counts = set()
    for name, number in primitive["attributes"].items():
        accessor = glb.top["accessors"][number]
        used["accessors"].add(number)
        _check_accessor(glb, accessor, TARGETS[name])
        counts.add(accessor["count"])
        kind = accessor["type"], accessor["componentType"], accessor.get("normalized", False)
        allowed = {
            "POSITION": [("VEC3", 5126, False)],
            "NORMAL": [("VEC3", 5126, False)],
            "TEXCOORD_0": [("VEC2", 5126, False), ("VEC2", 5121, True), ("VEC2", 5123, True)],
            "COLOR_0": [("VEC4", 5126, False), ("VEC4", 5121, True), ("VEC4", 5123, True)],
        }
        assert kind in allowed[name]
    assert len(counts) == 1
    if "NORMAL" in primitive["attributes"]:
        normals = glb.array(primitive["attributes"]["NORMAL"])
        assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-5
    positions = glb.top["accessors"][primitive["attributes"]["POSITION"]]
    values = glb.array(primitive["attributes"]["POSITION"])
    assert np.isfinite(values).all()
    assert np.array_equal(np.float32(positions["min"]), values.min(axis=0))
    assert np.array_equal(np.float32(positions["max"]), values.max(axis=0))
    colors = glb.array(primitive["attributes"]["COLOR_0"])
    assert colors.min() >= 0
    assert colors.max() <= 1
    indices = glb.top["accessors"][primitive["indices"]]
    used["accessors"].add(primitive["indices"])
    _check_accessor(glb, indices, 34963)
    assert (indices["type"], indices["componentType"]) in [("SCALAR", code) for code in (5121, 5123, 5125)]
    rows = glb.array(primitive["indices"])
    assert len(rows) % 3 == 0
    assert int(rows.max()) < counts.pop()
    faces = rows.reshape(-1, 3)
    assert (np.sort(faces, axis=1)[:, 1:] != np.sort(faces, axis=1)[:, :-1]).all()  # no empty triangle
    used["materials"].add(primitive["material"])


def _check_accessor(glb, accessor, target):
    view = glb.top["bufferViews"][accessor["bufferView"]]
    size = np.dtype(COMPONENTS[accessor["componentType"]]).itemsize
    row = size * TYPES[accessor["type"]]
    start = accessor.get("byteOffset", 0)
    assert view["target"] == target
    assert (view["byteOffset"] + start) % size == 0
    assert target == 34963 or row % 4 == 0
    assert accessor["count"] >= 1
    assert start + row * accessor["count"] <= view["byteLength"]


def _check_material(material, used):
    assert material["alphaMode"] in ("OPAQUE", "MASK", "BLEND")
    assert "alphaCutoff" not in material
    base = material["pbrMetallicRoughness"]
    assert 0 <= base["metallicFactor"] <= 1
    assert 0 <= base["roughnessFactor"] <= 1
    used["textures"].add(base["baseColorTexture"]["index"])
    if "normalTexture" in material:
        assert material["normalTexture"]["scale"] >= 0
        used["textures"].add(material["normalTexture"]["index"])
