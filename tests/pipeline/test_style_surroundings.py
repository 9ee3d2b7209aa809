"""Paintings in the hand of a style: black and white stays so, and dials take back what they name."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.formats.styles_write import write_style
from brushgs.options.painting import ViewConfig
from brushgs.outlets.learn_style import learn_style
from brushgs.pipeline.styling import styled
from brushgs.still_life import still_life_camera
from brushgs.values.colors import oklab_of
from tests.scenes import still_life_of

CAMERA = still_life_camera(width=96, height=72)
LOOK = bg.Look.open("oil").config
COLORS = {  # of paper and ink
    "grey": ((0.95, 0.95, 0.95), (0.05, 0.05, 0.05)),
    "cream": ((0.93, 0.9, 0.82), (0.1, 0.09, 0.09)),
    "blue": ((0.3, 0.45, 0.75), (0.1, 0.15, 0.4)),
}
LEAST = 0.002  # OKLab chroma that nobody sees
SMALL = replace(
    LOOK,
    cluster=replace(LOOK.cluster, strokes=400),
    strokes=replace(LOOK.strokes, see="off"),
    view=ViewConfig(size=(96, 72)),
)


def chroma(rgb):
    return float(np.hypot(*oklab_of(np.reshape(rgb, (-1, 3)).astype(np.float64))[:, 1:].T).mean())


def drawing(paper, ink, height=160, width=200):
    """Bent black bands on paper."""
    y, x = np.mgrid[:height, :width]
    bands = np.sin(0.11 * x + 3 * np.sin(0.03 * y)) > 0.3
    picture = np.where(bands[..., None], ink, paper) + np.random.default_rng(0).normal(
        0, 0.01, (height, width, 1)
    )
    return np.clip(picture, 0, 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("hands")
    for name, colors in COLORS.items():
        picture = drawing(*colors)
        frame = bg.Frame(np.float32(picture), np.ones(picture.shape[:2], np.float32))
        bg.save(frame, path / f"{name}.png")
        write_style(learn_style(path / f"{name}.png"), path / f"{name}.style")
    return path


def painted(folder, text):
    config = SMALL if text is None else styled(SMALL, f"{folder}/{text}")
    return bg.paint(still_life_of(1000), config, camera=CAMERA).over((1.0, 1.0, 1.0))


@pytest.mark.parametrize("name", ["grey", "cream"])
def test_a_painting_in_black_and_white_stays_so(folder, name):
    assert chroma(painted(folder, f"{name}.style")) <= 1.3 * chroma(drawing(*COLORS[name])) + LEAST


def test_dials_take_back_what_they_name(folder):
    plain, whole = painted(folder, None), painted(folder, "blue.style")
    assert np.abs(whole - plain).mean() > 0.05
    none = painted(folder, "blue.style;color=0;marks=0;direction=0;line=0;stage=0")
    assert np.abs(none - plain).mean() < 0.2 * np.abs(whole - plain).mean()
