"""Streamed SOG: one level of a set as splat-transform writes it, by an encoder of the tests."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats import read_scene
from brushgs.formats.scenes import streamed
from tests.io.scenes.sog_maker import decode, make, write_folder
from tests.io.scenes.witness import NAMES
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse

BOUND = {"min": [0, 0, 0], "max": [1, 1, 1]}


def node(*children):
    return {"bound": BOUND, "children": list(children)}


def leaf(lods):
    """Of levels, each with file, offset and count."""
    keys = "file", "offset", "count"
    entries = {str(level): dict(zip(keys, values, strict=True)) for level, values in lods.items()}
    return {"bound": BOUND, "lods": entries}


def write_set(folder, scenes, tree, num_levels, **keys):
    """A set of SOG scenes with its index; returns the index."""
    for name, scene in scenes.items():
        write_folder(folder / name, scene)
    index = {"version": 1, "lodLevels": num_levels, "filenames": [f"{name}/meta.json" for name in scenes]}
    path = folder / "lod-meta.json"
    path.write_text(json.dumps(index | {"tree": tree} | keys))
    return path


@pytest.fixture
def scenes():
    """Two chunks of the finest level, one of the next, one of the coarsest."""
    finest = {"0_0": make(120, 2, seed=1), "0_1": make(80, 1, seed=2)}
    return finest | {"1_0": make(60, 2, seed=3), "2_0": make(9)}


@pytest.fixture
def index(tmp_path, scenes):
    coarse = node(leaf({0: (1, 0, 80), 1: (2, 40, 20)}), leaf({0: (0, 70, 50), 1: (2, 60, 0)}))
    tree = node(leaf({0: (0, 0, 70), 1: (2, 0, 40), 2: (3, 0, 9)}), coarse)
    return write_set(tmp_path / "set", scenes, tree, 3, counts=[200, 60, 9], count=269)


def assert_rows(gaussians, *parts):
    """Of each part a scene and which of its rows; what a part lacks of the harmonics is 0."""
    found, num_terms = [decode(scene, list(rows)) for scene, rows in parts], gaussians.sh.shape[1]
    for part in found:
        part["sh"] = np.pad(part["sh"], ((0, 0), (0, num_terms - part["sh"].shape[1]), (0, 0)))
    for name in NAMES:
        expected = np.concatenate([part[name] for part in found])
        np.testing.assert_allclose(getattr(gaussians, name), expected, rtol=2e-6, atol=1e-7, err_msg=name)
    assert not gaussians.sh[expected == 0].any()


def test_a_level_is_the_rows_of_its_files_with_harmonics_of_the_highest_degree(index, scenes, monkeypatch):
    gaussians, notes = read_scene(index, lod=0)
    assert_rows(gaussians, (scenes["0_0"], range(120)), (scenes["0_1"], range(80)))
    assert (notes.rows_read, notes.sh_degree_stored) == (200, 2)
    assert notes.format == "streamed SOG, level 0 of 0 to 2 (200, 60, 9 Gaussians)"
    assert_rows(bg.load(index, lod=1), (scenes["1_0"], range(60)))
    assert_rows(bg.load(index, lod=2), (scenes["2_0"], range(9)))
    assert streamed.DEFAULT_MOST == 2_000_000
    for most, expected in ((200, 200), (199, 60), (60, 60), (10, 9), (3, 9)):  # the finest not too large
        monkeypatch.setattr(streamed, "DEFAULT_MOST", most)
        assert len(bg.load(index)) == expected


def test_only_the_rows_that_a_leaf_names_are_read(tmp_path):
    scene = make(100, 1)
    tree = node(leaf({0: (0, 90, 10)}), leaf({0: (0, 20, 30)}))
    index = write_set(tmp_path, {"x/y": scene}, tree, 1)
    assert_rows(bg.load(index), (scene, (*range(20, 50), *range(90, 100))))
    columns, _ = streamed.open_scene(index).read_columns(is_raw=True)
    assert len(columns.means) == 40


TWICE = node(leaf({0: (0, 0, 20)}), leaf({0: (0, 10, 20)}))
ONE_FILE = {"filenames": ["0_0/meta.json", "0_0/./meta.json"]}
ONE_FILE["tree"] = node(leaf({0: (0, 0, 9)}), leaf({0: (1, 0, 9)}))


@for_each(
    "keys, sentence",
    [
        ({"version": 2}, "must be of version 1, got version 2"),
        ({"filenames": ["../a/meta.json"]}, "names the file '../a/meta.json', which lies outside its folder"),
        ({"filenames": ["none/meta.json"]}, "none/meta.json: there is no such file"),
        ({"tree": None}, "tree must be made of objects with children or lods, got null"),
        ({"tree": leaf({0: (1, 0, 9)})}, "a leaf must name file, offset and count .* file 1"),
        ({"tree": leaf({0: (0, 0, 31)})}, "names row 31 of '0_0/meta.json', which has 30"),
        ({"tree": TWICE}, "names rows 10 to 20 of .* twice in one"),
        ({"tree": node()}, "holds no Gaussians in any of its 1 levels"),
        (ONE_FILE, "filenames must be different, got one twice in a level"),
    ],
)
def test_a_field_at_fault_is_named(tmp_path, keys, sentence):
    tree = {"tree": leaf({0: (0, 0, 30)})}
    refuse(write_set(tmp_path / "set", {"0_0": make(30)}, **({"num_levels": 1} | tree | keys)), sentence)


def test_a_level_or_index_at_fault_is_refused_and_other_levels_still_open(index, tmp_path):
    for lod in (3, 10**30):
        refuse(index, r"has levels of detail 0 \(the finest\) to 2, got", lod=lod)
    (index.parent / "0_1" / "meta.json").write_text("{}")
    refuse(index, r"0_1/meta\.json: means is missing, it must be an object", lod=0)
    assert len(bg.load(index, lod=1)) == 60
    index = write_set(tmp_path, {"0_0": make(30)}, leaf({0: (0, 0, 30), 1: (0, 0, 0)}), 2)
    refuse(index, "holds no Gaussians in level 1; choose another level", lod=1)
    index.write_text(index.read_text()[:-20])
    refuse(index, "is not JSON .*; download or export the scene again")
    index.write_text('{"lodLevels": 1, "filenames"' + "[" * (1 << 21))
    refuse(index, "would take .* MiB of memory")
