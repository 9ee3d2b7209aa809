"""Paintings in the hand of a style: black and white stays so, and dials take back what they name."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.styles import read_style, write_style
from brushgs.options.styling import DIALS
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life_camera
from brushgs.values.colors import oklab_of
from brushgs.values.sh import base_colors
from brushgs.values.style import StyleLines
from tests.kit import blind, still_life_of

CAMERA = still_life_camera(width=96, height=72)
COLORS = {  # of paper and ink
    "cream": ((0.93, 0.9, 0.82), (0.1, 0.09, 0.09)),
    "blue": ((0.3, 0.45, 0.75), (0.1, 0.15, 0.4)),
}
LEAST = 0.002  # OKLab chroma that nobody sees
# Strokes that see, and edges, look at colors and brushes.
SMALL = blind("oil", 400, (96, 72), strokes={"edges": 0})


def chroma(rgb):
    return float(np.hypot(*oklab_of(np.reshape(rgb, (-1, 3)).astype(np.float64))[:, 1:].T).mean())


def drawing(paper, ink, height=96, width=120):
    """Bent black bands on paper."""
    y, x = np.mgrid[:height, :width]
    bands = np.sin(0.11 * x + 3 * np.sin(0.03 * y)) > 0.3
    picture = np.where(bands[..., None], ink, paper)
    picture = picture + np.random.default_rng(0).normal(0, 0.01, (height, width, 1))
    return np.clip(picture, 0, 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("hands")
    for name, colors in COLORS.items():
        picture = drawing(*colors)
        frame = bg.Frame(np.float32(picture), np.ones(picture.shape[:2], np.float32))
        bg.save(frame, path / f"{name}.png")
        write_style(bg.learn_style(path / f"{name}.png"), path / f"{name}.style")
    return path


def painted(folder, text):
    config = SMALL if text is None else bg.styled(SMALL, f"{folder}/{text}")
    return bg.paint(still_life_of(1000), config, camera=CAMERA).over((1.0, 1.0, 1.0))


def test_a_painting_in_black_and_white_stays_so(folder):
    assert chroma(painted(folder, "cream.style")) <= 1.3 * chroma(drawing(*COLORS["cream"])) + LEAST


GEOMETRY = "means", "scales", "quats", "opacities"
# Of each dial alone: the coat and the column that it changes, and columns of both coats that it does not.
CHANGED = {
    "color": ("strokes", "sh", GEOMETRY, GEOMETRY),
    "marks": ("strokes", "brushes", GEOMETRY, GEOMETRY),
    "direction": ("strokes", "quats", ("means",), GEOMETRY),
    "line": ("lines", None, (*GEOMETRY, "sh", "brushes"), (*GEOMETRY, "sh", "brushes")),
    "stage": ("backdrop", None, (*GEOMETRY, "brushes"), ()),
}


@pytest.fixture(scope="module")
def coats_with(folder):
    """Name -> strokes of the still life, with some properties of a style with contours."""
    contours = StyleLines(0.3, 0.01, np.array([0.05, 0.05, 0.1]))
    write_style(replace(read_style(folder / "blue.style"), lines=contours), folder / "lined.style")

    def coats(*names):
        dials = ";".join(f"{dial}={int(dial in names)}" for dial in DIALS)
        config = bg.styled(SMALL, f"{folder}/lined.style;{dials}")
        painting = prepare(still_life_of(1000), config, Report(), asks=PICTURE).painting
        return {coat.name: coat.strokes for coat in painting.coats}

    return coats


@pytest.fixture(scope="module")
def without(coats_with):
    return coats_with()


@pytest.mark.parametrize("dial", DIALS)
def test_each_dial_changes_what_it_names_and_nothing_else(coats_with, without, dial):
    name, column, *kept = CHANGED[dial]
    found = coats_with(dial)
    if column is None:
        assert name not in without or len(without[name]) != len(found[name])
    else:
        assert not np.array_equal(getattr(found[name], column), getattr(without[name], column))
    assert set(found) - set(without) == ({"lines"} if dial == "line" else set())
    for coat, columns in zip(("strokes", "backdrop"), kept, strict=True):
        for each in columns:
            np.testing.assert_array_equal(
                getattr(found[coat], each), getattr(without[coat], each), err_msg=f"{coat} {each}"
            )
    light, *tint = mean_lab(found["strokes"]) - mean_lab(without["strokes"])
    assert (np.hypot(*tint) > 0.05) == (dial == "color")
    assert abs(light) < 0.01 or dial in ("color", "stage")  # a stage moves the subject apart from it


def mean_lab(strokes):
    return oklab_of(np.clip(base_colors(strokes.sh), 0, 1).astype(np.float64)).mean(axis=0)


def test_land_seen_from_the_air_has_surroundings_only_in_a_style(folder):
    still = still_life_of(1000)
    land = replace(still, means=still.means * np.float32([1, 0.02, 1]), scales=0.2 * still.scales)

    def coats(config):
        return [coat.name for coat in prepare(land, config, Report(), asks=PICTURE).painting.coats]

    assert coats(bg.styled(SMALL, f"{folder}/blue.style")) == ["backdrop", *coats(SMALL)]
    assert coats(bg.styled(SMALL, f"{folder}/blue.style;stage=0")) == coats(SMALL)
