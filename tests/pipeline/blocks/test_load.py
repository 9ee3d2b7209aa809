"""Scenes that are larger than the memory that may be used."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.formats.scenes.read import open_files
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import SequenceConfig
from brushgs.pipeline.blocks import budget as budgets
from brushgs.pipeline.blocks.budget import Budget
from brushgs.pipeline.blocks.load import load_in_blocks
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import load_scene
from brushgs.still_life import still_life_camera
from tests.io.ply_maker import scene_columns, write_scene
from tests.kit import for_each, stages_of, still_life_of
from tests.passes.scenes import assert_same

PEARS = still_life_of(6000)
NUM, MOST = len(PEARS), 2000
MEMORY = 1 << 20  # less than any scene of these tests takes
CAMERA = still_life_camera(width=160, height=120)


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """So many Gaussians are the least that fit, in place of 16,384."""
    monkeypatch.setattr(budgets, "FEWEST", MOST)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    found = tmp_path_factory.mktemp("blocks") / "pears.ply"
    bg.save(PEARS, found)
    return found


def load(path: Path, workers: SequenceConfig | None = None, block_rows: int | None = None) -> bg.Gaussians:
    files = open_files(path, None)
    return load_in_blocks(files, None, Budget(MEMORY), workers, block_rows=block_rows)[0]


def psnr(one: bg.Frame, other: bg.Frame) -> float:
    return float(-10 * np.log10(np.mean((one.rgb - other.rgb) ** 2) + 1e-12))


def test_strokes_do_not_depend_on_the_blocks_and_are_nearly_those_of_the_scene_in_memory(path: Path) -> None:
    first, *others = [load(path, block_rows=rows) for rows in (NUM, 1000, 777)]
    picture = bg.render(bg.cluster(first, 300), CAMERA, "flat")
    for scene in others:
        np.testing.assert_allclose(scene.means, first.means, rtol=1e-6, atol=1e-7)
        assert psnr(bg.render(bg.cluster(scene, 300), CAMERA, "flat"), picture) > 60
    whole, merged = bg.load(path), load(path)
    assert 0.4 * MOST < len(merged) <= MOST
    plain = bg.render(whole, CAMERA, "gaussian")
    strokes = (bg.cluster(one, 100) for one in (whole, merged))
    in_memory, in_blocks = (psnr(bg.render(one, CAMERA, "gaussian"), plain) for one in strokes)
    assert in_blocks > in_memory - 0.5


def test_processes_give_the_same_bits(path: Path) -> None:
    assert_same(load(path, SequenceConfig(jobs=2), 1000), load(path, block_rows=1000))


def test_rows_that_cannot_be_drawn_are_counted_as_without_blocks(tmp_path: Path) -> None:
    columns = scene_columns(3000)
    columns["x"][[5, 1500, 2999]] = np.nan
    columns["scale_1"][1000:1010] = np.inf
    scene = write_scene(tmp_path / "a.ply", columns)
    message = r"13 of 3000 rows were dropped: 13 hold values .*row 5, x = nan"
    with pytest.warns(bg.SceneWarning, match=message):
        _, expected = load_scene(scene, Report())
    with pytest.warns(bg.SceneWarning, match=message):
        merged, notes = load_in_blocks(open_files(scene, None), None, Budget(MEMORY), block_rows=700)
    assert (notes.rows_read, notes.rows_dropped) == (expected.rows_read, expected.rows_dropped)
    assert notes.rows_each == pytest.approx(2987 / len(merged))
    for name in ("rot_0", "rot_1", "rot_2", "rot_3"):
        columns[name][:] = 0
    scene = write_scene(tmp_path / "b.ply", columns)
    with pytest.raises(bg.SceneError, match="no row of 3000 can be used"):
        load(scene)


@pytest.mark.filterwarnings("ignore::brushgs.SceneWarning")  # .splat has no spherical harmonics
@for_each("suffix", [".compressed.ply", ".splat", ".spz", ".sog"])
def test_other_formats_and_several_files(path: Path, tmp_path: Path, suffix: str) -> None:
    parts = [path, tmp_path / f"half{suffix}"]
    bg.save(PEARS, parts[1])
    merged, notes = load_in_blocks(open_files(parts, None), None, Budget(MEMORY), block_rows=2500)
    assert len(merged) <= MOST
    assert (notes.rows_read, len(notes.files)) == (2 * NUM, 2)
    plain = bg.render(bg.load(parts), CAMERA, "gaussian")
    assert psnr(bg.render(merged, CAMERA, "gaussian"), plain) > 22


def test_strokes_are_never_merged_while_they_are_read(path: Path, tmp_path: Path) -> None:
    strokes = tmp_path / "strokes.ply"
    main(["cluster", str(path), "--strokes", "all", "-o", str(strokes), "--quiet"])
    source = SceneSource((strokes,), memory=MEMORY)
    assert len(load_scene(source, Report(), makes_strokes=True)[0]) > MOST


def test_commands_say_that_it_was_done(path: Path, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command, output in (("render", "a.png"), ("cluster", "a.ply"), ("export", "a.html")):
        words = [command, path, "--strokes", "200", "--memory", "100MB", "-o", output]
        words += [] if command == "cluster" else ["--look", "plain", "--see", "off", "--size", "64x48"]
        loaded = stages_of(capsys, *words)["load"]
        assert loaded["did"].startswith(f"{NUM:,} Gaussians, SH degree 3")
        assert "strokes of them take 217 MB of memory, 100 MB may be used: read in blocks" in loaded["did"]
        assert loaded["counts"]["memory"] == 10**8
        assert Path(output).stat().st_size > 1000


LIMITED = """
import resource, sys
import numpy as np
from brushgs.formats.scenes.read import open_files, read_files
from brushgs.pipeline.blocks.budget import Budget
from brushgs.pipeline.blocks.load import load_in_blocks
# First a small one: imports whatever the large one needs.
load_in_blocks(open_files(sys.argv[2], None), None, Budget(1), block_rows=1 << 14)
size = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (size + (120 << 20),) * 2)
files = open_files(sys.argv[1], None)
try:
    read_files(files)
    print("fits")
except MemoryError:
    print("too large")
print(len(load_in_blocks(files, None, Budget(1), block_rows=1 << 14)[0]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits the address space")
def test_blocks_take_less_memory_than_the_scene(path: Path, tmp_path: Path) -> None:
    columns = scene_columns(1000, degree=3)
    columns = {name: np.tile(values, 700) for name, values in columns.items()}  # 165 MB in memory
    columns["y"] += np.arange(700_000, dtype=np.float32) / 1000
    large = write_scene(tmp_path / "large.ply", columns)
    # The memory that malloc sets aside for each thread is address space too.
    environment = {**os.environ, "MALLOC_ARENA_MAX": "1"}
    command = [sys.executable, "-c", LIMITED, str(large), str(path)]
    run = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert run.returncode == 0, run.stderr
    fits, num = run.stdout.split("\n")[:2]
    assert fits == "too large", run.stderr
    assert 4000 < int(num) <= 1 << 14, run.stderr


def test_a_bar_counts_the_blocks(path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes the pipe of the test for a terminal
    report = Report(shows_progress=True)
    with report.stage("load"):
        load_in_blocks(open_files(path, None), None, Budget(MEMORY), block_rows=1000, report=report)
    report.close()
    num_blocks = -(-len(PEARS) // 1000)
    assert f"{num_blocks}/{num_blocks} blocks" in capsys.readouterr().err
