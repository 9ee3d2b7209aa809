"""What makes frames parts of one painting: everything they depend on, in a form that a manifest keeps.

Arrays go in as digests. The strokes stand for the scene, and for all that was done to it: should clustering
round otherwise on another machine, those are other strokes, and this shows it.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs import __version__
from brushgs.cameras.paths import CameraPath
from brushgs.errors import SceneError
from brushgs.io.json_file import shown
from brushgs.io.pictures.numbered import Manifest, NumberedFiles
from brushgs.options.painting import PaintConfig
from brushgs.painting.background import Ground
from brushgs.scene import Camera, Gaussians

_DIGEST = "digest "


def options(config: PaintConfig) -> dict[str, Any]:
    """The options that the frames depend on, known before any work: name -> number, text or None."""
    steps = asdict(config.prune) | asdict(config.cluster) | asdict(config.draw)
    del steps["threads"]
    steps["keep"] = config.prune.share()
    if config.cluster.target is not None:
        steps["strokes"] = str(config.cluster.target)
    if config.palette is not None:
        steps |= {f"palette {name}": str(value) for name, value in asdict(config.palette).items()}
    moving = {
        "lock": config.draw.lock_of(along_path=True),
        "order": config.draw.order_of(along_path=True),
    }
    return {"version": __version__} | steps | moving


def painting(
    config: PaintConfig, path: CameraPath, strokes: Gaussians, coverage: NDArray[np.uint8], ground: Ground
) -> dict[str, Any]:
    """Everything the frames depend on: the options, and digests of what came of the files."""
    return options(config) | {
        "scene": _digest(*vars(strokes).values()),
        "stroke image": _digest(coverage),
        "background image": None if ground is None else _digest(np.asarray(ground)),
        "frames": len(path.cameras),
        "loop": path.is_loop,
        "path": _digest(*map(_numbers, path.cameras)),
    }


def find_manifest(files: NumberedFiles, config: PaintConfig) -> Manifest | None:
    """The manifest of the painting that is to be gone on with; None where nothing is there yet.

    Raises:
        SceneError: if there are frames and no manifest, or options differ from those of the manifest.
    """
    found = Manifest.read(files)
    if found is not None:
        check_same(found, options(config))
    elif numbers := files.numbers():
        raise SceneError(
            files.manifest,
            f"there is no such manifest, so nothing tells of which painting the {len(numbers)} frames "
            f"{files.name} are; leave out --resume to paint all anew",
        )
    return found


def check_same(found: Manifest, asked: Mapping[str, Any]) -> None:
    """Refuse to go on with another painting.

    Raises:
        SceneError: if anything that is asked is otherwise in the manifest; names all that differs.
    """
    differing = []
    for name, value in asked.items():
        there = found.painting.get(name)
        if there != value:
            is_digest = isinstance(value, str) and value.startswith(_DIGEST)
            told = shown(there) if isinstance(there, list | dict) else str(there)[:80]
            differing.append(f"another {name}" if is_digest else f"{name} {told}, asked is {value}")
    if differing:
        raise SceneError(
            found.files.pattern,
            f"the frames there are of another painting ({'; '.join(differing)}); give the options they were "
            "painted with, or leave out --resume to paint all anew",
        )


def _numbers(camera: Camera) -> NDArray[np.float64]:
    size = (camera.width, camera.height, camera.near)
    return np.concatenate([camera.viewmat.ravel(), camera.K.ravel(), size])


def _digest(*arrays: NDArray[Any]) -> str:
    digest = hashlib.blake2b(digest_size=16)
    for array in arrays:
        digest.update(f"{array.shape} {array.dtype.str}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return _DIGEST + digest.hexdigest()
