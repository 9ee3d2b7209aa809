"""The inputs of a run, as stored in a manifest or a checkpoint and compared by `--resume`.

Arrays are recorded as digests. The digest of the strokes covers the scene and all work on it: if clustering
rounds differently on another machine, the strokes differ, and the comparison shows it.
"""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.pictures.numbered import Manifest, NumberedFiles
from brushgs.formats.schema import shown
from brushgs.options.clip import ClipConfig
from brushgs.options.media import Medium
from brushgs.options.painting import PaintConfig
from brushgs.options.sequence import GrowConfig
from brushgs.options.stroke_target import UsualCount
from brushgs.options.table import Options, changed, values_of
from brushgs.pipeline.outputs import digest_of
from brushgs.pipeline.prepare import Prepared
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.version import __version__

if TYPE_CHECKING:
    from brushgs.pipeline.moving import Moving

_DIGEST = "digest"
_OF_LOOKS = (
    "brushes",
    "color",
    "ground",
    "light",
    "media",
    "adjust",
    "output",
    "hand",
    "projection",
)  # steps without an effect on plain paintings


def describe_options(
    config: PaintConfig, grow: GrowConfig | None = None, clip: ClipConfig | None = None
) -> dict[str, Any]:
    """The options that frames depend on, known before any work: name -> number, text or None."""
    along_path = grow is None or grow.is_along_path
    moving: dict[str, Any] = {
        "lock": config.draw.lock_of(along_path=along_path, is_spherical=config.projection.is_spherical),
        "order": config.draw.order_of(along_path=along_path),
        "grow": None,
    }
    if grow is not None:
        moving |= {"grow": grow.seconds, "fps": grow.rate}
    if clip is not None:
        moving |= {
            f"clip {name}": None if value is None else str(value) for name, value in values_of(clip).items()
        }
    return {"version": __version__} | _of_painting(config) | moving


def _of_painting(config: PaintConfig) -> dict[str, Any]:
    """The options that every frame of a painting depends on."""
    steps = values_of(config.prune) | values_of(config.cluster) | values_of(config.draw)
    del steps["threads"]
    steps["keep"] = config.prune.share()
    if config.cluster.target is not None:
        steps["strokes"] = str(config.cluster.target)
    elif isinstance(config.cluster.strokes, UsualCount):
        steps["strokes"] = config.cluster.strokes.count
    steps |= values_of(config.strokes)
    for name in ("focus", "direction"):
        steps[name] = None if steps[name] is None else str(steps[name])
    steps["maps"] = ", ".join(map(str, steps["maps"])) or None
    steps |= {step: _changed(getattr(config, step)) for step in _OF_LOOKS}
    if config.palette is not None:
        steps |= {f"palette {name}": str(value) for name, value in values_of(config.palette).items()}
    rules = (
        None if config.rules is None else digest(np.frombuffer(repr(config.rules.rules).encode(), np.uint8))
    )
    named = {"style": config.style, "rules": rules, "where": config.painted}
    return steps | {name: str(part) for name, part in named.items() if part is not None}


def _changed(part: Options) -> str:
    """The fields of a step that differ from its defaults, in words such as "relief 0.5, canvas linen"."""
    kind = {"kind": part.kind} if isinstance(part, Medium) and part.kind != "paint" else {}
    values = kind | {name: value for name, value in changed(part).items() if name != "are_usual"}
    return ", ".join(f"{name} {value}" for name, value in values.items()) or "plain"


def describe_painting(
    config: PaintConfig,
    prepared: Prepared,
    grow: GrowConfig | None = None,
    clip: ClipConfig | None = None,
) -> dict[str, Any]:
    """All inputs of frames: the options, and digests of strokes and other prepared data."""
    strokes, path, background = prepared.strokes, prepared.path, prepared.background
    plain = prepared.plain
    assert path is not None
    hand = {"frames a second": path.fps} if any(pace.redraw for pace in config.paces) else {}
    waves = {"redraw from": digest_of(config.hand.files)} if config.hand.files else {}
    moving = {} if prepared.moving is None else {"motion": motion_digest(prepared.moving)}
    return (
        describe_options(config, grow, clip)
        | hand
        | waves
        | moving
        | {
            "scene": digest(*content_of(strokes), *([] if plain is None else content_of(plain))),
            "stroke image": digest(*prepared.texture.coverages),
            "background image": None if background is None else digest(np.asarray(background)),
            "frames": len(path.cameras),
            "loop": path.is_loop,
            **({} if prepared.painting.rig is None else {"eyes apart": prepared.painting.rig.ipd}),
            "path": digest(*map(_numbers, path.cameras)),
        }
    )


def read_manifest(
    files: NumberedFiles,
    config: PaintConfig,
    grow: GrowConfig | None = None,
    clip: ClipConfig | None = None,
) -> Manifest | None:
    """Read the manifest of the painting to resume; None if there are no frames yet.

    Raises:
        SceneError: if there are frames without a manifest, or options differ from those of the manifest.
    """
    manifest = Manifest.read(files)
    if manifest is not None:
        check_same_painting(manifest, describe_options(config, grow, clip))
    elif numbers := files.numbers():
        raise SceneError(
            files.manifest,
            f"there is no such manifest, so it is not known which painting the {len(numbers)} frames "
            f"{files.name} belong to; omit --resume to paint them all again",
        )
    return manifest


def check_same_painting(manifest: Manifest, expected: Mapping[str, Any]) -> None:
    """Refuse to resume another painting.

    Raises:
        SceneError: if the manifest differs; names all differences.
    """
    if differing := differences(manifest.painting, expected):
        raise SceneError(
            manifest.files.pattern,
            f"the frames there are of another painting ({differing}); give the options they were "
            "painted with, or omit --resume to paint them all again",
        )


def differences(found: Mapping[str, Any], expected: Mapping[str, Any]) -> str:
    """All differences of `found` from `expected`, in words such as "seed 0, now 5"; "" if none.

    A value is a number, text, a digest, or what `named_digest` gives.
    """
    differing = []
    for name, value in expected.items():
        there = found.get(name)
        before, now = _label(there), _label(value)
        if _content(there) == _content(value):
            continue
        if isinstance(value, str) and value.startswith(_DIGEST):
            differing.append(f"another {name}")
        else:
            differing.append(f"another {name} {now}" if before == now else f"{name} {before}, now {now}")
    return "; ".join(differing)


def _content(value: Any) -> Any:
    """The compared content: files may be renamed, and fields of a step may come in another order."""
    if isinstance(value, str):
        return sorted(value.split(", "))
    return value.get(_DIGEST) if isinstance(value, dict) else value


def _label(value: Any) -> str:
    """A value in words; it may come from any file."""
    value = value.get("name", value) if isinstance(value, dict) else value
    return shown(value) if isinstance(value, list | dict) else str(value)[:80]


def content_of(gaussians: Gaussians) -> list[NDArray[Any]]:
    """All arrays in a digest of Gaussians; antialiased ones, and those with brushes, have more."""
    brushes = [] if gaussians.brushes is None else [gaussians.brushes]
    return [*gaussians.columns().values(), *[np.ones(1)] * gaussians.antialiased, *brushes]


def named_digest(name: str, *arrays: NDArray[Any]) -> dict[str, str]:
    """A digest of a file's content, with the name for messages."""
    return {"name": name, _DIGEST: digest(*arrays)}


def named_file_digest(path: Path) -> dict[str, str]:
    """The same for a file that is not read as arrays."""
    with path.open("rb") as file:
        return {"name": path.name, _DIGEST: f"{_DIGEST} {hashlib.file_digest(file, 'blake2b').hexdigest()}"}


def motion_digest(moving: "Moving") -> str:
    """A digest of the motion of strokes, one moment at a time: the table may be larger than memory."""
    film, motion = moving.film, moving.motion
    poses = (np.asarray(numbers) for numbers in motion.table)
    return digest(film.times, film.others, film.shares, motion.ids, motion.pivots, *poses)


def _numbers(camera: Camera) -> NDArray[np.float64]:
    size = (camera.width, camera.height, camera.near)
    return np.concatenate([camera.viewmat.ravel(), camera.K.ravel(), size])


def digest(*arrays: NDArray[Any]) -> str:
    """A digest of arrays as text: of their shapes, types and bytes."""
    hashed = hashlib.blake2b(digest_size=16)
    for array in arrays:
        hashed.update(f"{array.shape} {array.dtype.str}".encode())
        hashed.update(np.ascontiguousarray(array).tobytes())
    return f"{_DIGEST} {hashed.hexdigest()}"
