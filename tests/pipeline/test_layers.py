"""Layers and deep samples, from the command line to the files."""

import json

import numpy as np
import OpenImageIO
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.pictures.exr.cryptomatte import ids_of
from brushgs.options.choices import LAYER_CHANNELS, LAYERS
from tests.kit import for_each, names, refused, save_upright, still_life_of

SMALL = ["--quiet", "--size", "128x96", "--strokes", "300", "--clean", "off", "--see", "off"]
PLAIN = [*SMALL, "--look", "plain", "--stroke", "flat", "--background", "transparent"]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "still_life.ply"
    save_upright(still_life_of(3000), path)
    return path


@pytest.fixture(scope="module")
def shots(scene):
    """Four frames of a loop, and the names of the strokes in them."""
    pattern = scene.with_name("shot.%02d.exr")
    assert main(["render", str(scene), *PLAIN, "--orbit", "24", "--layers", "all", "-o", str(pattern)]) == 0
    return [read(pattern.with_name(pattern.name % index)) for index in (0, 1, 22, 23)]


def read(path):
    source = OpenImageIO.ImageInput.open(str(path))
    spec = source.spec()
    pixels = source.read_image(0, 0, 0, spec.nchannels, OpenImageIO.FLOAT)
    source.close()
    return spec, dict(zip(spec.channelnames, np.moveaxis(pixels, -1, 0), strict=True))


def test_a_still_has_all_layers_but_motion(scene, tmp_path):
    path = tmp_path / "oil.exr"
    assert main(["render", str(scene), *SMALL, "--layers", "all", "-o", str(path)]) == 0
    spec, planes = read(path)
    for name in LAYERS:
        for channel in LAYER_CHANNELS[name].removesuffix(" ...").split(" ..., "):
            # A still has no next frame, and this one no regions.
            missing = name == "motion" or channel.startswith("CryptoRegion")
            assert all((each in planes) != missing for each in channel.split()), name
    assert (planes["A"] == 1).all()  # oil has a ground
    assert 0 < planes["paint.A"].mean() < 1
    assert spec.getattribute("worldToCamera") is not None


def test_motion_leads_to_the_same_stroke_in_the_next_frame(shots):
    for (_, here), (_, there) in (shots[:2], shots[2:], (shots[3], shots[0])):  # the last to the first
        ids, next_ids = (plane["CryptoStroke00.R"].view(np.uint32) for plane in (here, there))
        y, x = np.nonzero(here["CryptoStroke00.G"] > 0.9)
        to_x = np.floor(x + 0.5 + here["forward.u"][y, x]).astype(int)
        to_y = np.floor(y + 0.5 - here["forward.v"][y, x]).astype(int)
        inside = (to_x >= 0) & (to_x < 128) & (to_y >= 0) & (to_y < 96)
        x, y, to_x, to_y = (each[inside] for each in (x, y, to_x, to_y))
        found = (ids[y, x] == next_ids[to_y, to_x]).mean()
        assert found > 0.75
        assert found > (ids[y, x] == next_ids[y, x]).mean() + 0.2


def test_deep_frames_name_their_strokes_in_a_file_beside_them(scene, tmp_path):
    pattern = tmp_path / "deep" / "shot_%03d.exr"
    assert main(["render", str(scene), *PLAIN, "--orbit", "3", "--deep", "-o", str(pattern)]) == 0
    names = json.loads((tmp_path / "deep" / "shot.strokes.json").read_text())
    assert list(names) == [*(f"strokes_{row}" for row in range(300)), "other"]
    assert list(names.values()) == [f"{number:08x}" for number in ids_of(list(names)).tolist()]
    source = OpenImageIO.ImageInput.open(str(tmp_path / "deep" / "shot_000.exr"))
    assert source.spec().deep
    deep = source.read_native_deep_image()
    channel = list(source.spec().channelnames).index("id")
    samples = ((pixel, row) for pixel in range(0, deep.pixels, 7) for row in range(deep.samples(pixel)))
    ids = {deep.deep_value_uint(pixel, channel, row) for pixel, row in samples}
    assert min(ids) >= 1
    assert max(ids) <= 300


def test_a_frame_in_python_has_the_layers_that_are_asked_for(scene):
    frame = bg.paint(scene, "oil", size="96x64", strokes=200, layers="normal,id", clean="off", see="off")
    assert set(frame.layers) == {"normal", "brush", "layer", "paint"}
    lengths = np.linalg.norm(frame.layers["normal"], axis=2)
    assert lengths[frame.layers["paint"] > 0.5] == pytest.approx(1, abs=1e-5)
    assert bg.paint(scene, "plain", size="96x64", strokes=200, see="off").layers == {}


@for_each(
    ("words", "sentence"),
    [
        (["--deep", "-o", "a.tif"], "deep must be written to .exr, got a.tif; write a.exr"),
        (["--layers", "motion", "-o", "a.exr"], "layers must not have motion in one picture"),
        (["--layers", "normals", "-o", "a.exr"], "layers must be names out of depth, normal, motion"),
        (["--deep", "--layers", "uv", "-o", "a.exr"], "layers cannot be combined with deep"),
    ],
)
def test_layers_that_cannot_be_written_are_refused_before_any_work(scene, folder, capsys, words, sentence):
    assert sentence in refused(capsys, "render", scene, *words)
    assert names() == []
