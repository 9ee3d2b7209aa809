"""Writes the pictures of README and guides: a painting, five charts and six moving pictures.

still_life.jpg  what `brushgs demo` paints
looks.jpg       the still life in every look
grow.webp       the painting comes into being
strokes.jpg     lemon, pear and apple with every built-in stroke
styles.jpg      four paintings of `tests.kit.mark_paintings`, and the still life in the style of each
layers.jpg      layers of a painting, for compositing
options.jpg     one view of the still life, once for each line of `OPTIONS`
sway.webp       a loop: the camera moves to both sides of the still life and back
film.webp       the still life in motion: the pear rolls, a draught lifts the cloth, the lamp swings
hold.webp       a loop on threes, the camera held as well
boil.webp       the still life before a camera at rest, drawn anew every three frames
redraw.webp     laid anew in waves from the left

Labels and files are made with Pillow (extra test). It takes about a minute.

python examples/make_pictures.py [-o FOLDER] [--frames COUNT] [--quick]
"""

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from moving_still_life import swaying
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from rich.console import Console
from rich.progress import track

import brushgs as bg
from brushgs.brushes.texture import builtin_names
from brushgs.cli import main as brushgs
from brushgs.options.choices import LOOKS as ALL_LOOKS
from brushgs.options.choices import PLAIN_LOOK
from brushgs.still_life import still_life_camera
from brushgs.still_life.moving import still_life_moving
from brushgs.values.layers import Matte

LOOKS = tuple(name for name in ALL_LOOKS if name != PLAIN_LOOK)
TONED, CREAM = "#2e2113", "#eadfc8"  # the background of the demo, and the labels on it
TONED_RGB = 0x2E / 255, 0x21 / 255, 0x13 / 255
FRAMES_PER_SECOND = 15
GAP, LABEL = 6, 36  # between the cells of a chart, and the height of their labels; pixels
BY_HAND = {  # films of the guide on time: sway of the camera in degrees, and options
    "hold.webp": (15, "--hold 3 --hold-camera"),
    "boil.webp": (0, "--boil 0.55"),
    "redraw.webp": (0, "--redraw 2 --redraw-from left"),
}
FRUIT = 105, 290, 535, 357  # lemon, pear and apple in the view of 1000 x 750: left, top, width, height
STROKES_OF_CHART = 3000
OPTIONS = (
    "--strokes 250",
    "--strokes 2000",
    "--strokes 7000",
    "--strokes 2000 --keep 0.3",
    "--strokes 2000 --merge paper",
    "--strokes 2000 --preset paper",
    "--stroke fan --strokes 500",
    "--stroke fan --strokes 500 --features paper",
    "--stroke fan --strokes 500 --background white",
    "--palette autumn.png",
    "--palette dusk.png",
    "--palette dusk.png --palette-strength 0.5",
)
# The two palettes stand for paintings: colors and how many parts of the picture have them.
PALETTES = {
    "autumn.png": (("#20150c", 6), ("#4a2c14", 6), ("#7d4f22", 3), ("#b8863f", 1), ("#dcc28a", 1)),
    "dusk.png": (("#161a2b", 6), ("#2b3550", 6), ("#4c5a78", 3), ("#8b93a3", 1), ("#c58b5a", 1)),
}
PAINTINGS = "hatching", "swirls", "dabs", "washes"
STYLED = (
    *(f"--style {name}.style" for name in PAINTINGS),
    "--style swirls.style:0.5",
    "--style hatching.style:0.5,swirls.style:0.5",
    "--rules parts.toml",
    "--where half:1,0,0,0.2",
)
RULES = """\
[[region]]
name = "fruit"
where = "sphere:-0.3,-0.6,-1,1.3"
style = "hatching.style"

[[region]]
name = "all else"
where = "subject or surroundings"
style = "swirls.style"
"""
# A bar on a terminal, nothing in a pipe.
progress = partial(track, console=Console(stderr=True), disable=not sys.stderr.isatty())


class Cell(NamedTuple):
    """One picture of a chart."""

    label: str
    picture: Image.Image
    mark: Image.Image | None = None  # beside the label: a stroke, a palette


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument(
        "-o", "--output", type=Path, default=Path(__file__).parent / "pictures", help="folder"
    )
    parser.add_argument("--frames", type=int, default=60, help="of each moving picture, 3 or more")
    parser.add_argument(
        "--quick", action="store_true", help="fewer cells in the charts, sides a quarter: to try a change"
    )
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    names = (
        "still_life.jpg",
        "looks.jpg",
        "grow.webp",
        "strokes.jpg",
        "options.jpg",
        "styles.jpg",
        "layers.jpg",
    )
    files = [args.output / name for name in (*names, "sway.webp", "film.webp", *BY_HAND)]
    painting, looks, growing, strokes, options, styles, layers, moving, film, *by_hand = files
    print(f"writes {', '.join(map(str, files))}")

    share = 4 if args.quick else 1
    large, chart_cell, frame = (sides(1000, 750, share), sides(400, 300, share), sides(480, 360, share))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run("demo", *(["--size", "x".join(map(str, large))] if args.quick else []), "-o", folder)
        picture = open_picture(folder / "still_life-oil.png")
        picture.resize(large, Image.Resampling.LANCZOS).save(painting, quality=88)
        looks_chart(folder, LOOKS[:2] if args.quick else LOOKS, sides(640, 480, share)).save(
            looks, quality=88
        )
        save_animation(growing_picture(folder, args.frames, frame), growing)
        options_chart(folder, OPTIONS[::3] if args.quick else OPTIONS, chart_cell).save(options, quality=85)
        paintings = PAINTINGS[:2] if args.quick else PAINTINGS
        styled = STYLED[::2] if args.quick else STYLED
        learned = chart_cell if args.quick else large
        styles_chart(folder, paintings, styled, learned, chart_cell).save(styles, quality=85)
        layers_chart(folder, frame).save(layers, quality=85)
        save_animation(moving_picture(folder, args.frames, frame), moving)
        save_animation(film_of_scene(folder, args.frames, frame), film)
        for file in by_hand:
            degrees, words = BY_HAND[file.name]
            few, small = max(args.frames // 2, 3), sides(320, 240, share)
            save_animation(moving_picture(folder, few, small, words, degrees=degrees), file)
        scene = bg.load(folder / "still_life.ply")
    strokes_chart(scene, 300 // share).save(strokes, quality=85)
    for path in files:
        print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def sides(width: int, height: int, share: int) -> tuple[int, int]:
    """A share of these sides, pixels."""
    return width // share, height // share


def still_camera(size: tuple[int, int]) -> bg.Camera:
    """The view of the still life, `size` pixels wide and high."""
    return still_life_camera(width=size[0], height=size[1])


def strokes_chart(scene: bg.Gaussians, width: int) -> Image.Image:
    """The fruit with every built-in stroke; `gaussian` is the plain picture of the scene."""
    strokes = bg.cluster(bg.prune(scene), STROKES_OF_CHART)
    camera = fruit_camera(width=width)
    cells = []
    for name in progress(builtin_names(), "strokes.jpg"):
        texture = bg.StrokeTexture.open(name)
        frame = bg.render(scene if name == "gaussian" else strokes, camera, texture, depth=False)
        mark = Image.fromarray(texture.coverage) if texture.kind == "image" else None
        cells.append(Cell(name, Image.fromarray(frame.bytes_over(TONED_RGB)), mark))
    return chart(cells, columns=4)


def options_chart(folder: Path, options: Sequence[str], size: tuple[int, int]) -> Image.Image:
    """One view of `still_life.ply` in a folder, painted by the command line with each of some `OPTIONS`."""
    view_file = write_views([still_camera(size)], folder / "cameras.json")
    run_view = ["--camera-file", view_file, "--background", TONED]
    palettes = {file: draw_palette(colors, folder / file) for file, colors in PALETTES.items()}
    cells = []
    for label in progress(options, "options.jpg"):
        words = [folder / word if word in palettes else word for word in shlex.split(label)]
        output = folder / "cell.png"
        run(
            "render",
            folder / "still_life.ply",
            "--look",
            "plain",
            "--stroke",
            "flat",
            *run_view,
            *words,
            "-o",
            output,
        )
        mark = next((palettes[word] for word in label.split() if word in palettes), None)
        cells.append(Cell(label, open_picture(output), mark))
    return chart(cells, columns=3)


def styles_chart(
    folder: Path,
    paintings: Sequence[str],
    labels: Sequence[str],
    painted: tuple[int, int],
    size: tuple[int, int],
) -> Image.Image:
    """Some `PAINTINGS`, `painted` in one size, and `still_life.ply` with some options of `STYLED`."""
    draw = [sys.executable, "-m", "tests.kit.mark_paintings", folder, *map(str, painted)]
    subprocess.run(draw, check=True, cwd=Path(__file__).parent.parent, stdout=subprocess.DEVNULL)
    cells = []
    for name in paintings:
        run("style", "learn", folder / f"{name}.png", "-o", folder / f"{name}.style")
        cells.append(Cell(f"{name}.png", open_picture(folder / f"{name}.png").resize(size)))
    (folder / "parts.toml").write_text(RULES, encoding="utf-8")
    view = write_views([still_camera(size)], folder / "cameras.json")
    left_out = set(PAINTINGS) - set(paintings)
    styled = [label for label in labels if not any(name in label for name in left_out)]
    for label in progress(styled, "styles.jpg"):
        flag, value = label.split()
        if flag == "--style":
            value = ",".join(str(folder / style) for style in value.split(","))
        elif flag == "--rules":
            value = folder / value
        output = folder / "cell.png"
        run("render", folder / "still_life.ply", "--camera-file", view, flag, value, "-o", output)
        cells.append(Cell(label, open_picture(output)))
    return chart(cells, columns=4)


def looks_chart(folder: Path, looks: Sequence[str], size: tuple[int, int]) -> Image.Image:
    """One view of `still_life.ply` in a folder, painted by the command line in each of these looks."""
    view = write_views([still_camera(size)], folder / "cameras.json")
    scene, cells = folder / "still_life.ply", []
    for look in progress(looks, "looks.jpg"):
        run("render", scene, "--look", look, "--camera-file", view, "-o", folder / "cell.png")
        cells.append(Cell(look, open_picture(folder / "cell.png")))
    return chart(cells, columns=2)


def layers_chart(folder: Path, size: tuple[int, int]) -> Image.Image:
    """The still life in oil, and what its layers hold, as colors."""
    view = write_views([still_camera(size)], folder / "cameras.json")
    frame = bg.paint(folder / "still_life.ply", "oil", camera_file=view, layers="all")
    layers, painted = frame.layers, frame.layers["paint"][..., None]
    near, far = np.percentile(layers["depth"][painted[..., 0] > 0.9], (1, 99))
    pictures = {
        "the picture": frame.over("white"),
        "normal": painted * (0.5 + 0.5 * layers["normal"] * (1, -1, -1)),
        "depth": painted * ((far - layers["depth"]) / (far - near))[..., None],
        "uv": np.dstack([layers["uv"], 0 * painted]),
        "stroke": colors_of(layers["stroke"]),
        "height": 0.3 + 0.4 * layers["height"][..., None],
    }
    cells = []
    for name, values in pictures.items():
        pixels = (255 * np.clip(np.broadcast_to(values, frame.rgb.shape), 0, 1)).astype(np.uint8)
        cells.append(Cell(name, Image.fromarray(pixels)))
    return chart(cells, columns=3)


def colors_of(matte: Matte) -> NDArray[np.float64]:
    """A matte in colors, one for each thing, mixed as it covers pixels."""
    colors = np.random.default_rng(0).uniform(0.1, 1, (len(matte.names) + 1, 3))
    return np.einsum("hwk,hwkc->hwc", matte.coverage, colors[matte.rows])


def growing_picture(folder: Path, num_frames: int, size: tuple[int, int]) -> list[Image.Image]:
    """The painting of `still_life.ply` in a folder as it comes into being."""
    view = write_views([still_camera(size)], folder / "cameras.json")
    frames, scene = folder / "growing", folder / "still_life.ply"
    grow = "--grow", num_frames / FRAMES_PER_SECOND, "--fps", FRAMES_PER_SECOND
    run("render", scene, "--camera-file", view, *grow, "-o", frames / "%05d.png")
    return [open_picture(path) for path in sorted(frames.glob("*.png"))]


def moving_picture(
    folder: Path, num_frames: int, size: tuple[int, int], words: str = "", *, degrees: float = 28
) -> list[Image.Image]:
    """Frames of a loop: the camera moves to both sides of the still life and back."""
    cameras = swaying(still_camera(size), num_frames + 1, degrees=degrees)
    path, frames = write_views(cameras, folder / "sway.json"), folder / f"swaying{words}"
    moves = "--path", path, "--loop", "--fps", FRAMES_PER_SECOND
    run("render", folder / "still_life.ply", *moves, *words.split(), "-o", frames / "%05d.png")
    return [open_picture(path) for path in sorted(frames.glob("*.png"))]


def film_of_scene(folder: Path, num_frames: int, size: tuple[int, int]) -> list[Image.Image]:
    """The still life in motion, before a camera that stands still."""
    scene, frames = still_life_moving(), folder / "film"
    clip = bg.ClipConfig(fps=FRAMES_PER_SECOND, speed=scene.duration * FRAMES_PER_SECOND / (num_frames - 1))
    bg.paint_film(scene, frames / "%05d.png", "oil", camera=still_camera(size), clip=clip)
    return [open_picture(path) for path in sorted(frames.glob("*.png"))]


def save_animation(frames: list[Image.Image], path: Path) -> None:
    first, *others = frames
    duration = round(1000 / FRAMES_PER_SECOND)
    animation = {"save_all": True, "append_images": others, "duration": duration, "loop": 0}
    first.save(path, quality=72, method=4, **animation)


def run(*words: str | Path) -> None:
    """Run a command of brushgs; it prints nothing."""
    if brushgs([*map(str, words), "--quiet"]) != 0:
        raise SystemExit(f"brushgs {shlex.join(map(str, words))} failed")


def fruit_camera(*, width: int) -> bg.Camera:
    """The part `FRUIT` of the still life's view, so many pixels wide."""
    left, top, part_width, part_height = FRUIT
    scale = width / part_width
    whole = still_life_camera(width=round(1000 * scale), height=round(750 * scale))
    K = whole.K.copy()
    K[:2, 2] -= left * scale, top * scale
    return replace(whole, K=K, width=width, height=round(part_height * scale))


def write_views(cameras: Iterable[bg.Camera], path: Path) -> Path:
    """A `cameras.json`, as trainers of 3DGS write it."""
    views = [
        {
            "id": index,
            "img_name": f"{index:05d}",
            "width": camera.width,
            "height": camera.height,
            "position": camera.position.tolist(),
            "rotation": camera.viewmat[:3, :3].T.tolist(),
            "fx": camera.K[0, 0],
            "fy": camera.K[1, 1],
        }
        for index, camera in enumerate(cameras)
    ]
    path.write_text(json.dumps(views), encoding="utf-8")
    return path


def draw_palette(colors: Iterable[tuple[str, int]], path: Path) -> Image.Image:
    """Vertical bars, each as wide as its color has parts; written to a file, too."""
    bars = [Image.new("RGB", (3 * parts, 20), color) for color, parts in colors]
    picture = Image.new("RGB", (sum(bar.width for bar in bars), 20))
    for number, bar in enumerate(bars):
        picture.paste(bar, (sum(other.width for other in bars[:number]), 0))
    picture.save(path)
    return picture


def open_picture(path: Path) -> Image.Image:
    with Image.open(path) as picture:
        return picture.convert("RGB")


def chart(cells: Iterable[Cell], *, columns: int) -> Image.Image:
    """Labelled pictures of one size in rows, on the toned background."""
    cells = list(cells)
    width, height = cells[0].picture.size
    rows = -(-len(cells) // columns)
    sheet = Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + LABEL)), TONED)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(17)
    for number, (label, picture, mark) in enumerate(cells):
        x, y = number % columns * (width + GAP), number // columns * (height + LABEL)
        sheet.paste(picture, (x, y))
        draw.text((x + 6, y + height + LABEL // 2), label, CREAM, font, anchor="lm")
        if mark is not None:
            mark.thumbnail((width // 4, LABEL - 8))
            place = x + width - mark.width - 6, y + height + (LABEL - mark.height) // 2
            if mark.mode == "L":  # a stroke: its coverage
                sheet.paste(CREAM, place, mark)
            else:
                sheet.paste(mark, place)
    return sheet


if __name__ == "__main__":
    main()
