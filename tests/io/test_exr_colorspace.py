"""Color spaces of EXR files: known patches, and what the header says of them."""

import numpy as np
import OpenImageIO
import pytest

from brushgs import Frame, cli
from brushgs.formats.pictures.exr.planes import SPACES, colors_in
from brushgs.formats.pictures.images import read_image, write_frame
from brushgs.values.colors import linear_from_srgb
from tests.io.exr_reader import channels_of
from tests.kit.commands import refused
from tests.kit.for_each import for_each
from tests.outlets.page.paintings import some_strokes
from tests.scenes import save_upright

HALF = 2.0**-11  # the largest relative error of rounding to a half float
# From linear light with Rec. 709 primaries, after Bradford adaptation. Sources: ACES documentation (AP1 and
# AP0), ITU-R BT.2087 (Rec. 2020), SMPTE EG 432-1 (P3-D65).
MATRICES = {
    "lin_srgb": np.eye(3),
    "acescg": [0.613097, 0.339523, 0.047379, 0.070194, 0.916354, 0.013452, 0.020616, 0.10957, 0.869815],
    "aces2065_1": [0.439633, 0.382989, 0.177378, 0.089776, 0.813439, 0.096784, 0.017541, 0.111547, 0.870912],
    "lin_rec2020": [0.627404, 0.329283, 0.043313, 0.069097, 0.91954, 0.011362, 0.016391, 0.088013, 0.895595],
    "lin_p3d65": [0.822462, 0.177538, 0, 0.033194, 0.966806, 0, 0.017083, 0.072397, 0.91052],
}
PATCHES = np.zeros((2, 4, 3), np.float32)
PATCHES[0, 1:] = (1, 1, 1), (1, 0, 0), (0, 1, 0)
PATCHES[1] = (0, 0, 1), (0.46, 0.46, 0.46), (0.8, 0.5, 0.2), (0.1, 0.3, 0.7)
RED_OF_AP1 = (0.713, 0.293)


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("OCIO", "/no/such/config.ocio")  # what a studio sets there changes nothing


def stored(path):
    channels = channels_of(path)
    return np.stack([channels[name] for name in "RGBA"], axis=-1)


@for_each("space", MATRICES)
def test_patches_have_the_values_of_the_reference(space):
    wanted = linear_from_srgb(PATCHES) @ np.reshape(MATRICES[space], (3, 3)).T
    assert np.abs(colors_in(PATCHES, space) - wanted).max() < 1e-4
    alpha = np.full(PATCHES.shape[:2], 0.5, np.float32)
    write_frame(Frame(PATCHES * 0.5, alpha), "a.exr", colorspace=space)
    pixels = stored("a.exr")
    assert (pixels[..., 3] == 0.5).all()
    assert np.abs(pixels[..., :3] - wanted * 0.5).max() < 1e-4 + HALF


@for_each("space", SPACES)
def test_a_file_names_its_space_and_is_read_in_it(space):
    alpha = np.ones(PATCHES.shape[:2], np.float32)
    write_frame(Frame(PATCHES, alpha), "a.exr", colorspace=space)
    spec = OpenImageIO.ImageInput.open("a.exr").spec()
    assert spec.get_string_attribute("colorInteropID") == SPACES[space].interop_id
    assert np.allclose(spec.getattribute("chromaticities"), SPACES[space].chromaticities)
    read = linear_from_srgb(read_image("a.exr")[..., :3])
    assert np.abs(read - linear_from_srgb(PATCHES)).max() < 3 * HALF  # matrices have rows of up to 4.04


WORDS = ["render", "a.ply", "--strokes", "30", "--size", "32x24", "--see", "off", "--quiet"]


def test_pictures_and_films_take_the_flag():
    save_upright(some_strokes(60), "a.ply")
    for words in (["-o", "a.exr"], ["-o", "b.exr", "--colorspace", "acescg"]):
        assert cli.main([*WORDS, *words]) == 0
    wanted = stored("a.exr")[..., :3] @ np.reshape(MATRICES["acescg"], (3, 3)).T
    assert np.abs(wanted - stored("b.exr")[..., :3]).max() < 1e-4 + 2 * HALF
    assert cli.main([*WORDS, "-o", "c/%d.exr", "--colorspace", "acescg", "--orbit", "3"]) == 0
    spec = OpenImageIO.ImageInput.open("c/1.exr").spec()
    assert np.allclose(spec.getattribute("chromaticities")[:2], RED_OF_AP1)
    assert cli.main([*WORDS, "-o", "d.png", "--colorspace", "srgb"]) == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "a.png"], "must be srgb for a.png, which is display-encoded, got acescg; write a.exr"),
        (["-o", "a.mp4", "--orbit", "3"], "must be omitted for a.mp4, a film; write numbered .exr"),
        (["-o", "a.exr", "--deep"], "colorspace must be srgb or omitted with deep"),
        (["-o", "a.ora"], "colorspace must be omitted for a.ora"),
    ],
)
def test_files_that_do_not_hold_a_space_refuse_it(words, said, capsys):
    save_upright(some_strokes(60), "a.ply")
    assert said in refused(capsys, *WORDS, *words, "--colorspace", "acescg")
