"""From the flags of a command line to frozen configuration; the namespace is read and never changed."""

from argparse import Namespace
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from brushgs.cli.flags import given
from brushgs.options.choices import PLAIN_SCENE, PRESETS

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.options.sequence import PathConfig

NOTHING: Mapping[str, Any] = MappingProxyType({})
NOT_FRAMING = {"size", "camera_file", "view"}  # fields of a view that do not place the camera
RENAMED = {
    "fov_y": "fov-deg",
    "is_resumed": "resume",
    "side": "from",
}  # field -> flag, where messages name it


def scene_source(args: Namespace) -> "SceneSource":
    """The scene that a command reads."""
    from brushgs.options.scene_source import SceneSource

    return SceneSource(tuple(args.scene), args.lod)


def paint_config(args: Namespace, **defaults: Mapping[str, Any]) -> "PaintConfig":
    """How a command makes and draws strokes.

    A field is what its flag says, else what the preset says or, without one, `--stroke gaussian`, else the
    default of the command, else that of its class.

    Args:
        args: parsed flags; a command may have only some of those of a painting.
        **defaults: of the command, by step and field, such as `view={"size": (640, 360)}`.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.painting import (
        CleanConfig,
        ClusterConfig,
        DrawConfig,
        PaintConfig,
        PaletteConfig,
        PruneConfig,
        StrokesConfig,
        ViewConfig,
    )

    preset = PRESETS[getattr(args, "preset", "default")]
    is_plain = given(args, "draw").get("stroke") == "gaussian" and not preset
    plain = PLAIN_SCENE if is_plain else NOTHING

    def fields(step: str) -> dict[str, Any]:
        layers = (defaults, preset, plain)
        return {name: value for layer in layers for name, value in layer.get(step, {}).items()} | given(
            args, step
        )

    _check_view(given(args, "view"))
    palette = given(args, "palette")
    if palette and "file" not in palette:
        raise ValueError(
            f"--palette-{next(iter(palette))} needs --palette, the picture whose colours are taken"
        )
    return PaintConfig(
        prune=PruneConfig(**fields("prune")),
        cluster=ClusterConfig(**fields("cluster")),
        palette=PaletteConfig(**fields("palette")) if palette else None,
        view=ViewConfig(**fields("view")),
        draw=DrawConfig(**fields("draw")),
        clean=CleanConfig(**fields("clean")),
        strokes=StrokesConfig.of(**fields("strokes")),
    )


def path_config(args: Namespace, *, default_orbit: int | None = None) -> "PathConfig | None":
    """The path of the camera; None for a single picture.

    Args:
        args: parsed flags.
        default_orbit: frames of the orbit that is the default path; None where that is a single picture.

    Raises:
        ValueError: if flags exclude each other, or need a path and there is none.
    """
    path, view = given(args, "path"), given(args, "view")
    if default_orbit is not None and not {"orbit", "file"} & set(path):
        path["orbit"] = default_orbit
    if not {"orbit", "file"} & set(path):
        for field in path | given(args, "sequence"):
            raise ValueError(f"{_flag(field)} needs --orbit or --path; a single picture does not use it")
        if given(args, "draw").get("lock") == "track":
            raise ValueError("--lock track needs --orbit or --path; only along a path are strokes tracked")
        return None
    from brushgs.options.sequence import PathConfig

    flag = "--path" if "file" in path else "--orbit"
    placing = [name for name in view if name != "size" and ("file" in path or name == "camera_file")]
    _refuse(placing, f"{flag}, which places the cameras")
    return PathConfig(**path)


def _check_view(view: Mapping[str, Any]) -> None:
    if "camera_file" in view:
        _refuse([name for name in view if name not in NOT_FRAMING], "--camera-file, which places the camera")
    elif "view" in view:
        raise ValueError("--view needs --camera-file, which lists the views")
    if "side" in view:
        _refuse([name for name in ("azimuth",) if name in view], "--from, which is an azimuth")
        if view["side"] == "top":
            _refuse([name for name in ("elevation",) if name in view], "--from top, which is 90 degrees")


def _refuse(fields: Iterable[str], other: str) -> None:
    for field in fields:
        raise ValueError(f"{_flag(field)} cannot be combined with {other}")


def _flag(field: str) -> str:
    return f"--{RENAMED.get(field, field).replace('_', '-')}"
