"""The memory that large files take, sound and malicious ones: `python -m tests.fuzz.large [NAME ...]`.

The fuzzer's inputs are small, so that what it sees is the constant part; here the part that grows with the
file is measured. Every file is read in a process of its own, and the peak of its memory is printed.
"""

import json
import struct
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.fuzz.corpus import written
from tests.fuzz.judge import judged
from tests.fuzz.reader import SEPARATOR
from tests.fuzz.readers import READERS
from tests.fuzz.reading import ALLOWED, memory
from tests.io import test_cameras, test_compressed_ply
from tests.io.ply_maker import element_bytes, scene_columns, write_ply_file, write_scene

Made = tuple[str, Callable[[Path], object]]  # which reader, and what writes the file


def _scene(
    degree: int, encoding: str = "binary_little_endian", kind: str = "float"
) -> Callable[[Path], object]:
    num_rows = {0: 1_500_000, 3: 400_000}[degree] // (10 if encoding == "ascii" else 1)
    columns = scene_columns(num_rows, degree)
    if kind != "float" or encoding == "ascii":
        columns = {name: np.rint(values).astype(np.int8) for name, values in columns.items()}
    return lambda path: write_scene(path, columns, encoding, dict.fromkeys(columns, kind))


def _compressed(path: Path, degree: int) -> None:
    num_rows = 2_560_000 >> degree
    rng = np.random.default_rng(0)
    packed = {name: rng.integers(0, 1 << 32, num_rows, np.uint32) for name in test_compressed_ply.PACKED}
    names = [f"{end}_{axis}" for end in ("min", "max") for axis in (*"xyz", "scale_x", "scale_y", "scale_z")]
    chunk = element_bytes("chunk", dict.fromkeys(names, np.zeros(num_rows // 256)))
    elements = [chunk, element_bytes("vertex", packed, types=test_compressed_ply.PACKED)]
    if degree:
        rest = {f"f_rest_{i}": np.full(num_rows, 7, np.uint8) for i in range(45)}
        elements.append(element_bytes("sh", rest, types=dict.fromkeys(rest, "uchar")))
    write_ply_file(path, elements)


def _views(path: Path) -> None:
    frame = json.dumps({"camera_to_world": (np.eye(4)).tolist(), "fov": 50.0})
    frame = frame.replace(".0", ".000000000000000")
    head = json.dumps({k: v for k, v in test_cameras.CAMERA_PATH.items() if k != "camera_path"})[:-1]
    path.write_text(f'{head}, "camera_path": [' + ",".join([frame] * 40_000) + "]}")


def _colmap(path: Path) -> None:
    count = 50_000
    lens = struct.pack("<iiQQ4d", 1, 1, 64, 48, 50.0, 50.0, 32.0, 24.0)
    cameras = b"".join(struct.pack("<i", i) + lens[4:] for i in range(count))
    path.with_stem("cameras").write_bytes(struct.pack("<Q", count) + cameras)
    tail = struct.pack("<7d", 1, 0, 0, 0, 1, 2, 3)
    images = b"".join(
        struct.pack("<i", i) + tail + struct.pack("<i", i) + f"{i}\0".encode() + b"\0" * 8
        for i in range(count)
    )
    path.write_bytes(struct.pack("<Q", count) + images)


def _picture(
    suffix: str, channels: int = 4, width: int = 7680, **attributes: object
) -> Callable[[Path], object]:
    dtype = np.float32 if suffix in (".exr", ".hdr") else np.uint8
    pixels = np.zeros(((1 << 25) // width - 1, width, channels), dtype)
    pixels[9:, 9:] = 1
    return lambda path: written(path, pixels, **attributes)


def _bytes(content: Callable[[], bytes]) -> Callable[[Path], object]:
    return lambda path: path.write_bytes(content())


CASES: dict[str, Callable[[], Made]] = {
    "scene, degree 0": lambda: ("scene", _scene(0)),
    "scene, degree 3": lambda: ("scene", _scene(3)),
    "scene, degree 0, bytes for numbers": lambda: ("scene", _scene(0, kind="char")),
    "scene, degree 3, bytes for numbers": lambda: ("scene", _scene(3, kind="char")),
    "scene as text, one digit a number": lambda: ("scene-text", _scene(0, "ascii")),
    "scene as text, a line of 100 MB": lambda: (
        "scene-text",
        lambda path: path.write_bytes(
            READERS["scene-text"].seeds(path.parent)[0].partition(b"end_header\n")[0]
            + b"end_header\n"
            + b"1 " * (50 << 20)
        ),
    ),
    "compressed scene, degree 0": lambda: ("scene-compressed", lambda path: _compressed(path, 0)),
    "compressed scene, degree 3": lambda: ("scene-compressed", lambda path: _compressed(path, 3)),
    "camera path of 40,000 views": lambda: ("cameras", _views),
    "JSON, empty lists": lambda: ("cameras", _bytes(lambda: b"[" + b"[]," * 8_000_000 + b"0]")),
    "JSON, 2 MB of lists of one number": lambda: (
        "cameras",
        _bytes(lambda: b"[" + b"[0]," * 450_000 + b"0]"),
    ),
    "JSON, a text of 30 MB": lambda: (
        "cameras",
        _bytes(lambda: b'["\\ud83d\\ude00' + b"a" * (30 << 20) + b'"]'),
    ),
    "JSON, a number of 30 MB": lambda: ("cameras", _bytes(lambda: b"[" + b"7" * (30 << 20) + b"]")),
    "COLMAP, 50,000 cameras and images": lambda: ("colmap", _colmap),
    "COLMAP as text, a line of 100 MB": lambda: (
        "colmap-text",
        lambda path: READERS["colmap-text"].write(
            b"1 PINHOLE 64 48 50 50 32 24" + SEPARATOR + b"1 1 0 0 0 1 2 3 1 a\n" + b"1 2 3 " * (17 << 20),
            path.parent,
        ),
    ),
    "manifest of 8 MB": lambda: (
        "manifest",
        _bytes(lambda: b'{"painting": {}}\n' + b'{"frame":1,"bytes":1}\n' * 370_000),
    ),
    "manifest of 8 MB, empty lines": lambda: (
        "manifest",
        _bytes(lambda: b'{"painting": {}}\n' + b"1\n" * 4_000_000),
    ),
    "PNG, 33 million pixels": lambda: ("png", _picture(".png")),
    "JPEG, 33 million pixels": lambda: ("jpeg", _picture(".jpg", 3)),
    "JPEG, 33 million pixels, progressive": lambda: ("jpeg", _picture(".jpg", 3, **{"jpeg:progressive": 1})),
    "TIFF, 33 million pixels, deflate": lambda: ("tiff", _picture(".tif", compression="zip")),
    "EXR, 33 million pixels": lambda: ("exr", _picture(".exr", compression="zip")),
    "WebP, 16,000 x 2,000": lambda: ("webp", _picture(".webp", width=16_000)),
    "BMP, 33 million pixels": lambda: ("bmp", _picture(".bmp", 3)),
    "HDR, 33 million pixels": lambda: ("hdr", _picture(".hdr", 3)),
}


def _as_image(path: Path) -> object:
    from brushgs.formats.pictures.images import read_image

    return read_image(path)


def _as_stroke(path: Path) -> object:
    from brushgs.brushes.texture import StrokeTexture

    return StrokeTexture.open(path).height


def _as_background(path: Path) -> object:
    from brushgs.pipeline.background import open_background

    return open_background(str(path), 1280, 720)


USES = {"picture": _as_image, "stroke": _as_stroke, "background": _as_background}


def _measured(reader: str, path: Path, use: str) -> None:
    """Read one file and print the peak of the memory, bytes, seconds and what was wrong or refused."""
    read = USES[use] if use else READERS[reader].read
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():  # what is loaded once
        warnings.simplefilter("ignore")
        small = READERS[reader].write(READERS[reader].seeds(Path(folder))[0], Path(folder))
        judged(read, small)
    Path("/proc/self/clear_refs").write_text("5")
    before, start = memory("VmRSS"), time.monotonic()
    outcome = "read"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            value = read(path)
        del value
    except ValueError as error:
        outcome = str(error).replace(f"{path.parent}/", "")[:90]
    print(json.dumps([memory("VmHWM") - before, time.monotonic() - start, outcome]))


def main() -> None:
    """Write, read and report, one case after the other."""
    if sys.argv[1:2] == ["--read"]:
        _measured(sys.argv[2], Path(sys.argv[3]), sys.argv[4])
        return
    print(f"{'file':48} {'MiB':>6} {'memory':>7} {'of rule':>7} {'s':>5}")
    for name in sys.argv[1:] or CASES:
        reader, write = CASES[name]()
        is_picture = READERS[reader].file.startswith("a.")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / READERS[reader].file
            write(path)
            size = sum(file.stat().st_size for file in Path(folder).iterdir())
            for use in USES if is_picture else [""]:
                arguments = [sys.executable, "-m", "tests.fuzz.large", "--read", reader, str(path), use]
                output = subprocess.run(arguments, capture_output=True, text=True, check=True).stdout
                grown, seconds, outcome = json.loads(output.splitlines()[-1])
                share = grown / (ALLOWED + 2 * size)
                label = f"{name}: {use}" if use else name
                print(
                    f"{label:48} {size / 2**20:6.1f} {grown / 2**20:7.1f} {share:7.2f} {seconds:5.1f}", end=""
                )
                print(f" {outcome}", flush=True)


if __name__ == "__main__":
    main()
