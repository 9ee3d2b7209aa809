"""Strokes of a painting as a scene file, and scenes in another format."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats import read_scene
from brushgs.formats.pictures.images import read_image
from brushgs.options.painting import PaintConfig
from brushgs.outlets.export_strokes import export_strokes
from brushgs.pipeline.still import paint_file
from tests.kit import BLIND, changed, for_each, still_life_of, without_look

FLAT = without_look("flat", 150, (64, 36), strokes=BLIND)  # formats are the matter here


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "life.ply"
    life = still_life_of(1000)
    bg.save(replace(life, sh=life.sh[:, :1]), path)  # 8 bits of harmonics would add errors of their own
    return path


def picture(path: Path, config: PaintConfig, tmp_path: Path) -> np.ndarray:
    paint_file(path, tmp_path / "picture.png", config)
    return 255 * read_image(tmp_path / "picture.png")[..., :3]


@pytest.fixture(scope="module")
def ply_of_strokes(scene: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("strokes") / "b.ply"
    export_strokes(scene, path, FLAT)
    return path


@for_each("suffix", [".spz", ".sog", ".compressed.ply", ".usdz"])
def test_strokes_of_every_format_are_painted_as_those_of_a_ply(
    scene: Path, ply_of_strokes: Path, tmp_path: Path, suffix: str
) -> None:
    export_strokes(scene, tmp_path / f"a{suffix}", FLAT)
    found = []
    for path in (tmp_path / f"a{suffix}", ply_of_strokes):
        gaussians, notes = read_scene(path)
        assert (len(gaussians), notes.is_strokes, notes.scene) == (150, True, "life")
        assert notes.first_view is not None
        found.append(picture(path, PaintConfig(draw=FLAT.draw, view=FLAT.view), tmp_path))
    assert np.abs(found[0] - found[1]).mean() < 1.0


@pytest.mark.filterwarnings("ignore:.*a .splat file does not hold")
@for_each("suffix", [".ply", ".splat", ".sog"])
def test_the_gaussian_stroke_is_a_change_of_format(scene: Path, tmp_path: Path, suffix: str) -> None:
    config = changed(PaintConfig(), draw={"stroke": "gaussian"}, strokes=BLIND)
    report = export_strokes(scene, tmp_path / f"a{suffix}", config)
    found, notes = read_scene(tmp_path / f"a{suffix}")
    assert len(found) == len(bg.load(scene))
    assert not notes.is_strokes
    assert (report.output, report.stages[-1].name) == (str(tmp_path / f"a{suffix}"), "write")
    with pytest.raises(ValueError, match=r"output must end in \.ply, "):
        export_strokes(scene, tmp_path / "a.ksplat", FLAT)


def test_the_command_writes_them_by_suffix(scene: Path, tmp_path: Path) -> None:
    words = ["export", str(scene), "--strokes", "60", "--quiet", "-o"]
    assert main([*words, str(tmp_path / "a.spz")]) == 0
    gaussians, notes = read_scene(tmp_path / "a.spz")
    assert (len(gaussians), notes.is_strokes, bool(notes.brushes)) == (60, True, True)
    assert main([*words, str(tmp_path / "a.compressed.ply"), "--stroke", "gaussian"]) == 0
    assert len(bg.load(tmp_path / "a.compressed.ply")) == len(bg.load(scene))
