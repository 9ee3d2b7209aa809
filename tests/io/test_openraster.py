"""OpenRaster files: their layers, laid on each other by another reader, are the picture."""

import io
import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from brushgs import cli
from brushgs.formats.pictures import encoding
from brushgs.formats.pictures.images import write_frame
from brushgs.formats.pictures.layered import write_ora, write_psd
from brushgs.options.painting import PaintConfig
from brushgs.pipeline import outputs
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.rendering.light import Lamp
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import flat
from brushgs.rendering.wanted import Wanted
from brushgs.still_life import still_life_camera
from tests.io.openraster import composite, layers_of, picture_in
from tests.kit.configs import blind
from tests.outlets.page.paintings import CAMERA, some_coat, some_strokes
from tests.scenes import save_upright, still_life_of

SIZE = 96, 72
MOST = 2.0  # of 255: what 8 bits a layer cost
SHEETS = Wanted(sheets=True)


pytestmark = pytest.mark.usefixtures("folder")


@pytest.fixture(scope="module")
def still_life():
    return still_life_of(2000)


def painting_of(look, scene, **draw):
    config = blind(look, 300, SIZE, draw=draw)
    camera = still_life_camera(width=SIZE[0], height=SIZE[1])
    return prepare(scene, config, Report(), views=camera).painting, camera


def difference(frame, background=None):
    """Of the layers from the PNG of the same frame, in 1/255; and the layers."""
    write_ora(frame, "a.ora", background)
    write_frame(frame, "a.png", background)
    with Image.open("a.png") as picture:
        wanted = np.asarray(picture.convert("RGBA"), np.float64) / 255
    wanted[..., :3] *= wanted[..., 3:]
    layers = layers_of("a.ora")
    for _, operation, pixels in layers:
        if operation == "svg:plus":  # programs differ on what alpha does here
            assert set(np.unique(pixels[..., 3])) <= {0.0, 1.0}
    return np.abs(composite(layers) - wanted).max() * 255, layers


@pytest.mark.parametrize("look", ["oil", "watercolour", "charcoal", "ink"])
def test_the_layers_of_every_medium_are_its_picture(look, still_life):
    painting, camera = painting_of(look, still_life)
    frame = painting.frame(camera, wanted=SHEETS)
    most, layers = difference(frame)
    assert most <= MOST
    names = [name for name, *_ in layers]
    assert names[0] == "ground"
    assert any(name.startswith("subject") for name in names)
    assert len(set(names)) == len(names)
    assert np.array_equal(frame.rgb, painting.frame(camera).rgb)  # whether layers are wanted or not


def test_a_photoshop_file_has_the_same_layers(still_life):
    psd_tools = pytest.importorskip("psd_tools")
    painting, camera = painting_of("oil", still_life)
    frame = painting.frame(camera, wanted=SHEETS)
    write_ora(frame, "a.ora", None)
    assert write_psd(frame, "a.psd", None) == len(layers_of("a.ora"))
    modes = {"NORMAL": "src-over", "MULTIPLY": "multiply"}
    modes |= {"COLOR_DODGE": "color-dodge", "LINEAR_DODGE": "plus"}
    layers = psd_tools.PSDImage.open("a.psd")
    for layer, (name, operation, pixels) in zip(layers, layers_of("a.ora"), strict=True):
        assert (layer.name, f"svg:{modes[layer.blend_mode.name]}") == (name, operation)
        left, top, right, bottom = layer.bbox
        np.testing.assert_allclose(layer.numpy(), pixels[top:bottom, left:right], atol=1e-6)
    write_frame(frame, "a.png", None)
    with Image.open("a.png") as picture, Image.open("a.psd") as merged:
        apart = np.asarray(picture.convert("RGB"), int) - np.asarray(merged.convert("RGB"), int)
    assert np.abs(apart).max() <= 3, "what programs without layers show, and psd-tools composes"


def test_a_photoshop_file_needs_its_package(monkeypatch):
    monkeypatch.setattr(encoding, "find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r"a\.psd: Photoshop files need psd-tools; pip install"):
        outputs.check_encoding(Path("a.psd"), PaintConfig())


def lit_painting(surface):
    """Stage, subject, lines and a glaze in relief, under a strong lamp."""
    names, relief = ("backdrop", "strokes", "lines"), Relief(gain=20.0)
    layers = [(name, some_strokes(40, seed=row)) for row, name in enumerate(names)]
    coats = [some_coat(strokes, "impasto", name=name, relief=relief) for name, strokes in layers]
    touches = some_coat(some_strokes(20, seed=5), name="touches", blend="glaze")
    return Painting((*coats[:2], touches, coats[2]), surface, Lamp(strength=0.85, gloss=0.4))


def test_stage_subject_lines_relief_and_light_lie_in_layers_of_their_own():
    painting = lit_painting(flat((0.4, 0.5, 0.6), height=CAMERA.height, width=CAMERA.width))
    most, layers = difference(painting.frame(CAMERA, wanted=SHEETS))
    assert most <= MOST
    names = ["ground", "stage", "subject", "subject: touches", "lines"]
    assert [name for name, *_ in layers] == [*names, "relief shade", "relief light", "light"]
    unlit = replace(painting, lamp=None).frame(CAMERA).rgb.clip(0, 1)
    assert np.abs(composite(layers[:5])[..., :3] - unlit).max() * 255 <= MOST
    for row in range(1, 8):  # each shows something
        away = composite(layers[:row] + layers[row + 1 :])
        assert np.abs(away - composite(layers)).max() * 255 > MOST


def test_a_transparent_painting_is_its_layers_too():
    painting = lit_painting(None)
    frame = painting.frame(CAMERA, wanted=SHEETS)
    assert frame.alpha.min() < 0.1
    assert frame.alpha.max() > 0.9
    for background in (None, (1.0, 0.9, 0.8)):
        most, layers = difference(frame, background)
        assert most <= MOST
        parts = [name for name, *_ in layers if name in ("stage", "subject", "lines")]
        assert parts == ["stage", "subject", "lines"]
    assert not any(name.startswith("relief") for name, *_ in layers)  # the coats are lit


def test_a_painting_without_lamp_lines_and_stage_has_no_such_layers():
    frame = Painting((some_coat(some_strokes(20)),)).frame(CAMERA, wanted=SHEETS)
    for background, names in ((None, ["subject"]), ((0.2, 0.5, 0.9), ["background", "subject"])):
        most, layers = difference(frame, background)
        assert most <= MOST
        assert [name for name, *_ in layers] == names


def test_files_hold_what_programs_ask_for_and_how_they_were_painted(still_life, capsys):
    save_upright(still_life, "pears.ply")
    words = ["render", "pears.ply", "--strokes", "150", "--size", "300x200", "--see", "off", "--json"]
    for name in ("a.png", "a.ora"):
        assert cli.main([*words, "-o", name]) == 0
        told = json.loads(capsys.readouterr().out)
    assert told["stages"][-1]["counts"]["layers"] == len(layers_of("a.ora"))
    with zipfile.ZipFile("a.ora") as archive, Image.open("a.png") as picture:
        assert np.abs(picture_in(archive, "mergedimage.png")[..., :3] * 255 - np.asarray(picture)).max() == 0
        thumbnail = Image.open(io.BytesIO(archive.read("Thumbnails/thumbnail.png")))
        assert thumbnail.size == (256, 171)
    assert cli.main(["info", "a.ora", "--json"]) == 0
    assert "brushgs render pears.ply" in json.loads(capsys.readouterr().out)["painted"]["command"]
    with zipfile.ZipFile("a.ora", "w") as archive:
        archive.writestr("mimetype", "image/openraster")
    assert cli.main(["info", "a.ora"]) == 2
    assert "a.ora: is no OpenRaster file, or damaged; get it again" in capsys.readouterr().err
