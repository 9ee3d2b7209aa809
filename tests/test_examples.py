"""Every example runs, and writes what it says first."""

import base64
import json
import re
import runpy
import subprocess
import sys
from functools import partial
from pathlib import Path

import av
import pytest

import brushgs as bg
import brushgs.outlets.demo
import brushgs.still_life.moving
from brushgs.formats.pictures.images import read_image
from brushgs.pipeline import kept
from brushgs.still_life import still_life
from brushgs.still_life.moving import still_life_moving
from tests.kit.for_each import for_each
from tests.kit.kept import FOLDER as SHARED_FOLDER

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
GUIDES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [*GUIDES, ROOT / "strokes" / "README.md", *sorted((EXAMPLES / "measured").glob("*.md"))]


def commands_of(pages):
    """The commands of some pages, each once, but those of `demo` and `painter`, which `.ci/run` runs."""
    texts = [page.read_text(encoding="utf-8") for page in pages]
    blocks = [
        block for text in texts for block in re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    ]
    return list(dict.fromkeys(re.findall(r"^brushgs (?!demo|painter).+$", "".join(blocks), re.MULTILINE)))


COMMANDS = commands_of(GUIDES)


def run(name, *words, monkeypatch, num_gaussians=4000):
    """Run an example as its own program, on a small still life."""
    small, moving = partial(still_life, num_gaussians), partial(still_life_moving, num_gaussians)
    monkeypatch.setattr(brushgs.still_life, "still_life", small)
    monkeypatch.setattr(brushgs.outlets.demo, "still_life", small)
    monkeypatch.setattr(brushgs.still_life.moving, "still_life_moving", moving)
    monkeypatch.syspath_prepend(EXAMPLES)  # as Python does for a script
    monkeypatch.setattr(sys, "argv", [name, *map(str, words)])
    monkeypatch.setenv(kept.FOLDER, SHARED_FOLDER)  # the program itself is as it was
    runpy.run_path(str(EXAMPLES / name), run_name="__main__")


def is_a_picture(path, width, height):
    pixels = read_image(path)
    return pixels.shape[:2] == (height, width) and float(pixels[..., :3].std()) > 0.02


PICTURES = {"still_life.jpg": (250, 187), "looks.jpg": (326, 156), "strokes.jpg": (318, 430)}
PICTURES |= {"options.jpg": (312, 222), "styles.jpg": (418, 222), "layers.jpg": (372, 252)}
PICTURES |= dict.fromkeys(("grow.webp", "sway.webp", "film.webp"), (120, 90))
PICTURES |= dict.fromkeys(("hold.webp", "boil.webp", "redraw.webp"), (80, 60))
RUN = {  # name -> words, without the folder to write to; what is written there, and how large
    "ten_lines.py": ("", {"swirl.png": (800, 600)}),
    "paint_still_life.py": (
        "flat ink --strokes 300 --size 96 72 -o",
        {"flat.png": (96, 72), "ink.png": (96, 72)},
    ),
    "paint_over.py": ("", {"paint_over.jpg": (720, 540)}),
    "contact_sheet.py": ("--width 64 --counts 50 200 --strokes ellipse dab -o", {"sheet.png": (128, 96)}),
    "plain_3dgs.py": ("--frames 2 --size 80 60 -o", {"plain_0.png": (80, 60), "plain_1.png": (80, 60)}),
    "make_pictures.py": ("--frames 3 --quick -o", PICTURES),
}
APART = {"moving_still_life.py", "film.py", "page_screenshots.py", "blender_addon.py"}  # by own tests


def test_every_example_is_run_by_this_file():
    assert {path.name for path in EXAMPLES.glob("[!_]*.py")} == RUN.keys() | APART


@pytest.mark.parametrize("name", RUN)
def test_an_example_writes_its_pictures(name, tmp_path, monkeypatch, capfd):
    words, pictures = RUN[name]
    target = tmp_path / "sheet.png" if name == "contact_sheet.py" else tmp_path
    run(name, *words.split(), target, monkeypatch=monkeypatch, num_gaussians=1000)
    for picture, size in pictures.items():
        assert is_a_picture(tmp_path / picture, *size), picture
    assert capfd.readouterr().err == ""  # no progress bar in a pipe


def test_moving_still_life(tmp_path, monkeypatch):
    words = "-o", tmp_path / "a.mp4", "--strokes", 300, "--frames", 5, "--size", 80, 60
    run("moving_still_life.py", *words, monkeypatch=monkeypatch)
    with av.open(tmp_path / "a.mp4") as video:
        frames = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert [frame.shape for frame in frames] == [(60, 80, 3)] * 4
    assert all(frame.std() > 5 for frame in frames)


def test_film(tmp_path, monkeypatch, capsys):
    words = "-o", tmp_path / "a.mp4", "--look", "plain", "--seconds", 0.1, "--size", 80, 60
    run("film.py", *words, monkeypatch=monkeypatch)
    with av.open(tmp_path / "a.mp4") as video:
        assert sum(1 for _ in video.decode(video=0)) == 3
    assert "73% rest" in capsys.readouterr().out


def test_page_screenshots(tmp_path, browser):
    scene = tmp_path / "pears.ply"
    bg.save(brushgs.still_life.still_life(1000), scene)
    # A process of its own: Playwright runs once in one.
    command = [sys.executable, EXAMPLES / "page_screenshots.py", "-o", tmp_path, "--scene", scene, "--quick"]
    subprocess.run(list(map(str, command)), check=True, timeout=300)
    assert is_a_picture(tmp_path / "page.jpg", 1408, 484)


EXECUTE = """
import sys
import nbformat
from nbclient import NotebookClient
book = nbformat.read(sys.argv[1], as_version=4)
for cell in book.cells:  # a small scene in small pictures
    sizes = ("still_life(12_000)", "still_life(1_500)"), ("480, 360", "160, 120"), ("[:24]", "[:3]")
    for whole, small in sizes:
        cell.source = cell.source.replace(whole, small)
NotebookClient(book, timeout=300, resources={"metadata": {"path": sys.argv[2]}}).execute()
nbformat.write(book, sys.argv[2] + "/executed.ipynb")
"""


def test_the_notebook_runs_from_top_to_bottom(tmp_path):
    # A process of its own: what its libraries warn of is not for us to mend.
    command = [sys.executable, "-c", EXECUTE, str(EXAMPLES / "notebook.ipynb"), str(tmp_path)]
    subprocess.run(command, check=True, timeout=600)
    cells = json.loads((tmp_path / "executed.ipynb").read_text(encoding="utf-8"))["cells"]
    shown = [output.get("data", {}) for cell in cells for output in cell.get("outputs", [])]
    assert not [
        output for cell in cells for output in cell.get("outputs", []) if output["output_type"] == "stream"
    ]
    pictures = [data["image/png"] for data in shown if "image/png" in data]
    assert len(pictures) == 9
    for number, picture in enumerate(pictures):
        (tmp_path / f"{number}.png").write_bytes(base64.b64decode(picture))
        assert float(read_image(tmp_path / f"{number}.png")[..., :3].std()) > 0.05
    assert "data:video/mp4;base64," in "".join(shown[-1]["text/html"])
    with av.open(tmp_path / "turn.mp4") as video:
        assert sum(1 for _ in video.decode(video=0)) == 6
    assert is_a_picture(tmp_path / "painting.png", 160, 120)
    assert {"strokes.ply", "painting.html"} <= {path.name for path in tmp_path.iterdir()}


def test_the_notebook_is_kept_without_what_it_shows():
    cells = json.loads((EXAMPLES / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@for_each("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#]+)", page.read_text(encoding="utf-8"))
    files = [page.parent / link for link in links if not link.startswith("http")]
    assert [file for file in files if not file.exists()] == []


WRITERS = [path for path in sorted(EXAMPLES.glob("[!_]*.py")) if path.name != "blender_addon.py"]


@for_each("path", WRITERS, ids=lambda p: p.name)
def test_an_example_opens_by_saying_what_it_writes(path):
    assert path.read_text(encoding="utf-8").startswith('"""Writes ')
