"""The core as WebAssembly, for a page: compiled once by the Clang of the package ziglang, and kept on disk.

One thread and 128-bit vectors: pages opened from a file have no shared memory. The flags for numbers are
those of the native build, so kernels give the same bits.
"""

import hashlib
import os
import subprocess
import sys
from importlib import resources
from importlib.util import find_spec
from pathlib import Path

from brushgs.formats.files import replacing

SOURCES = (
    "wasm/painter.cpp",
    *(
        f"src/{name}.cpp"
        for name in (
            *("scene_rows", "spz_rows", "scene_strokes", "extent"),
            *("visible_shares", "light_along", "features"),
            *("equal_rows", "floaters", "components", "prune"),
            *("surroundings", "worth", "solid", "stroke_form", "surface_field"),
            *("broken_color", "stroke_relief", "stroke_brushes", "look_colors"),
            *("scene_stage", "stage_ground", "stage_maps", "stage_site", "stage_strokes"),
            *("stage_surface", "stage_tones"),
            *("subject", "view_pictures", "find_up", "find_front", "framing", "crumbs", "cpu"),
            *("project", "project_kernel", "tiles", "raster", "raster_kernel", "soft_queues", "soft_crowd"),
            *("lloyd", "nearest", "reassign", "merge", "gaps", "coverage", "moments", "groups", "key_order"),
        )
    ),
)
FLAGS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-std=c++20", "-O3", "-msimd128", "-s"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),  # BRUSHGS_FLAGS of CMakeLists.txt
    *("-fno-exceptions", "-fno-rtti", "-DBRUSHGS_ALONE", "-DBRUSHGS_ISA=baseline"),
)
ZIG_SOURCE = "wasm/zstd.zig"
# Checks stay, as files may be hostile: what is out of bounds stops the module.
ZIG_FLAGS = ("-target", "wasm32-wasi", "-O", "ReleaseSafe", "-fstrip")
LACKING = (
    "painter: the page is compiled by the package ziglang, which is missing; pip install 'brushgs[browser]'"
)


def painter_module() -> bytes:
    """The module of `core/wasm/painter.cpp`: from the cache, or compiled now, which takes some 20 seconds.

    The first time on a machine, Clang compiles the C++ library as well, which takes another minute.

    Raises:
        ValueError: if ziglang is missing or does not compile the sources.
        SceneError: if the cache cannot be written.
    """
    folder, kept = _folder(), kept_module()
    if kept.is_file():
        return kept.read_bytes()
    if find_spec("ziglang") is None:
        raise ValueError(LACKING)
    kept.parent.mkdir(parents=True, exist_ok=True)
    with replacing(kept) as temporary:
        _compile(folder, temporary, kept.parent / "ziglang")
    return kept.read_bytes()


def kept_module() -> Path:
    """Where the module of these sources is kept; the file may not be there."""
    from platformdirs import user_cache_path

    return user_cache_path("brushgs", appauthor=False) / "browser" / f"{_digest(_folder())}.wasm"


def _folder() -> Path:
    return Path(str(resources.files("brushgs.core")))


def _compile(folder: Path, output: Path, cache: Path) -> None:
    sources = [str(folder / name) for name in SOURCES]
    unpacking = output.with_suffix(".o")
    try:
        _run_zig(["build-obj", *ZIG_FLAGS, str(folder / ZIG_SOURCE), f"-femit-bin={unpacking}"], cache)
        made = ["-I", str(folder / "include"), *sources, str(unpacking)]
        _run_zig(["c++", *FLAGS, *made, "-o", str(output)], cache)
    finally:
        unpacking.unlink(missing_ok=True)


def _run_zig(words: list[str], cache: Path) -> None:
    cached = {"ZIG_GLOBAL_CACHE_DIR": str(cache), "ZIG_LOCAL_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-m", "ziglang", *words],
        env={**cached, **os.environ},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        told = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[-200:])
        raise ValueError(f"painter: ziglang did not compile the core: {told}")


def _digest(folder: Path) -> str:
    """Of all that the module is made of: sources, headers and flags; one ziglang gives one module for it."""
    digest = hashlib.sha256("\n".join((*FLAGS, *ZIG_FLAGS)).encode())
    for path in sorted(
        [*(folder / name for name in (*SOURCES, ZIG_SOURCE)), *(folder / "include" / "brushgs").glob("*.hpp")]
    ):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:32]
