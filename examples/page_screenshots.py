"""Writes the screenshots of the README: pages of `brushgs export`, `brushgs view` and `brushgs painter`.

page.jpg     a painting in its page, and in the viewer, side by side, of the example still life
painter.jpg  with --painter: the page that paints, before and after a scene is dropped on it; needs ziglang

Chromium makes them on a software renderer, driven by Playwright (`pip install playwright`): no GPU is
needed. It takes about a minute.

python examples/page_screenshots.py [-o FOLDER] [--scene FILE] [--quick] [--painter]
"""

import argparse
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, ViewportSize, sync_playwright

import brushgs as bg
from brushgs.cli import main as brushgs
from brushgs.outlets.painter.page import write_painter
from brushgs.still_life import still_life

VIEW = "--zoom", "0.8"
WINDOW, SMALL_WINDOW = {"width": 1100, "height": 760}, {"width": 550, "height": 380}
QUICK = *VIEW, "--strokes", "100", "--backdrop", "off", "--see", "off"
WIDTH, GAP = 700, 8  # of one screenshot in the picture, and between them; pixels
# The page's own policy forbids what Playwright would wait with.
SETTLED = """async () => {
  while (!window.brushgs?.studio?.isSettled) await new Promise((done) => setTimeout(done, 50));
  await window.brushgs.ready;
}"""
PAINTED = """async () => {
  while (!document.getElementById("drop").hidden) await new Promise((done) => setTimeout(done, 50));
}"""
CHROMIUM_FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "-o", "--output", type=Path, default=Path(__file__).parent / "pictures", help="folder"
    )
    parser.add_argument("--scene", type=Path, help="in place of the example still life")
    parser.add_argument("--quick", action="store_true", help="few strokes in a small window: to try a change")
    parser.add_argument("--painter", action="store_true", help="painter.jpg in place of page.jpg")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    words, window = (QUICK, SMALL_WINDOW) if args.quick else (VIEW, WINDOW)
    with tempfile.TemporaryDirectory() as name, chromium_page(window) as page:
        folder = Path(name)
        scene = folder / "still_life.ply"
        if args.scene is None:
            bg.save(still_life(), scene)
        else:
            scene = args.scene.resolve()
        if args.painter:
            write_painter(folder / "painter.html")
            shots = dropped(page, folder / "painter.html", scene, folder)
        else:
            run("export", scene, *words, "-o", folder / "painting.html")
            shots = [exported(page, folder / "painting.html", folder), viewed(page, scene, folder, words)]
        picture = side_by_side([Image.open(shot).convert("RGB") for shot in shots])
    path = args.output / ("painter.jpg" if args.painter else "page.jpg")
    picture.save(path, quality=86)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def exported(page: Page, painting: Path, folder: Path) -> Path:
    """The page that opens by double click, with its bar."""
    page.goto(painting.as_uri())
    page.evaluate("brushgs.ready")
    return screenshot(page, folder / "exported.png")


def dropped(page: Page, painter: Path, scene: Path, folder: Path) -> list[Path]:
    """The page that paints, empty and with a scene."""
    page.goto(painter.as_uri())
    page.evaluate("brushgs.ready")
    empty = screenshot(page, folder / "empty.png")
    page.set_input_files("input[type=file]", scene)
    page.evaluate(PAINTED)
    return [empty, screenshot(page, folder / "painted.png")]


def viewed(page: Page, scene: Path, folder: Path, words: Sequence[str]) -> Path:
    """The page of `brushgs view`, with its studio."""
    command = [
        sys.executable,
        "-m",
        "brushgs",
        "view",
        scene,
        *words,
        "--look",
        "impressionist",
        "--no-browser",
        "--quiet",
    ]
    with subprocess.Popen(list(map(str, command)), cwd=folder, stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = next(word for line in server.stdout for word in line.split() if "token=" in word)
            page.goto(address)
            page.evaluate(SETTLED)
            return screenshot(page, folder / "viewed.png")
        finally:
            page.goto("about:blank")
            server.terminate()


def screenshot(page: Page, path: Path) -> Path:
    """The window, with the bar that fades where nothing is touched."""
    page.mouse.move(400, 300)
    page.mouse.move(420, 310)
    page.wait_for_timeout(600)
    page.screenshot(path=path)
    return path


def side_by_side(shots: list[Image.Image]) -> Image.Image:
    height = round(WIDTH * WINDOW["height"] / WINDOW["width"])
    picture = Image.new("RGB", (len(shots) * WIDTH + (len(shots) - 1) * GAP, height), "white")
    for i, shot in enumerate(shots):
        picture.paste(shot.resize((WIDTH, height), Image.Resampling.LANCZOS), (i * (WIDTH + GAP), 0))
    return picture


def run(*words: str | Path) -> None:
    """Run a command of brushgs; it prints nothing."""
    if brushgs([*map(str, words), "--quiet"]) != 0:
        raise SystemExit(f"brushgs {shlex.join(map(str, words))} failed")


@contextmanager
def chromium_page(window: ViewportSize) -> Iterator[Page]:
    """A tab in which nothing turns by itself."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium-headless-shell") or shutil.which("chromium")
        browser = playwright.chromium.launch(executable_path=path, args=CHROMIUM_FLAGS)
        yield browser.new_page(viewport=window, reduced_motion="reduce")
        browser.close()


if __name__ == "__main__":
    main()
