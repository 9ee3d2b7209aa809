"""From the flags of a command line to frozen configuration; the namespace is read and never changed."""

from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from brushgs.cli.flags import given
from brushgs.options.choices import (
    DEFAULT_BACKDROP,
    DEFAULT_LOOK,
    PLAIN_LOOK,
    PLAIN_PRESETS,
    PLAIN_SCENE,
    PRESETS,
    StepValues,
)

if TYPE_CHECKING:
    from brushgs.options.clip import ClipConfig
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.options.sequence import GrowConfig, PathConfig
    from brushgs.options.where import WhereConfig

NOTHING: Mapping[str, Any] = MappingProxyType({})
NOT_FRAMING = {"size", "camera_file", "view"}  # fields of a view that do not place the camera
NO_TRACK = "--lock track needs --orbit or --path; only along a path are strokes tracked"
OF_PATHS = {"frames", "seconds", "loop"}  # fields of a path that a painting that grows does not have
OF_FILMS = {"fps", "loop"}  # those that a film of a moving scene has without a path
RENAMED = {
    "fov_y": "fov-deg",
    "file": "path",
    "is_resumed": "resume",
    "side": "from",
}  # field -> flag, where messages name it


def scene_source(args: Namespace) -> "SceneSource":
    """The scene that a command reads."""
    from brushgs.options.scene_source import SceneSource

    return SceneSource(
        tuple(args.scene),
        args.lod,
        args.time,
        args.moments_per_second,
        getattr(args, "memory", None),
        getattr(args, "seeks_cameras", True),
    )


def paint_config(
    args: Namespace, look_values: StepValues | None = None, **defaults: Mapping[str, Any]
) -> "PaintConfig":
    """How a command makes and draws strokes.

    A field is what its flag says, else what the preset says or, without one, `--stroke gaussian`, else what
    the look says, else the default of the command, else that of its class.

    Args:
        args: parsed flags; a command may have only some of those of a painting.
        look_values: of a look that is no file, in place of those that the flags name.
        **defaults: of the command, by step and field, such as `view={"size": (640, 360)}`.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
        SceneError: if the look is a file that cannot be read.
    """
    from brushgs.options.painting import STEPS, PaintConfig

    preset = PRESETS[preset_of(args)]
    has_method = preset_of(args) in PLAIN_PRESETS
    is_plain = given(args, "draw").get("stroke") == "gaussian" and not has_method
    plain = PLAIN_SCENE if is_plain else NOTHING
    whole = _values_of(look_of(args)) if look_values is None else look_values
    look = _without_replaced(whole, args)
    _check_view(given(args, "view"))
    palette = given(args, "palette")
    if palette and "file" not in palette:
        raise ValueError(
            f"--palette-{next(iter(palette))} needs --palette, the picture whose colours are taken"
        )
    flags = {step: given(args, step) for step in STEPS}
    if painted := where_config(args, "painted"):
        flags["painted"] = vars(painted)
    if flags["style"]:
        flags["style"]["has_brushes"] = not is_plain and "stroke" not in flags["draw"]
    below = _layered([defaults, look, preset, plain])
    values = _layered([_styled(below, flags["style"]), flags])
    values["ground"] |= _backdrop(given(args, "ground").get("backdrop"), whole)
    if look_values is None and look_is_default(args) and "stroke" not in flags["draw"] and not has_method:
        values["brushes"]["are_usual"] = True
    return PaintConfig.of(values)


def preset_of(args: Namespace) -> str:
    """The name of the preset of a command."""
    return str(getattr(args, "preset", "default"))


def look_is_default(args: Namespace) -> bool:
    """Whether nobody asked for a look."""
    return getattr(args, "look", None) is None


def _layered(layers: Iterable[StepValues]) -> dict[str, dict[str, Any]]:
    """All steps, each field as the last layer that has it says."""
    from brushgs.options.painting import STEPS

    return {
        step: {name: value for layer in layers for name, value in layer.get(step, {}).items()}
        for step in STEPS
    }


def _styled(values: StepValues, style: Mapping[str, Any]) -> StepValues:
    """The values of a look on the way to those of its styles."""
    if not style:
        return values
    from brushgs.options.styling import StyleConfig
    from brushgs.pipeline.styling import styled_values

    return styled_values(values, StyleConfig(**style))


def _values_of(look: str) -> StepValues:
    if look == PLAIN_LOOK:  # which adds nothing, and needs no reader of TOML
        return {}
    from brushgs.options.look import Look

    return Look.open(look).values


def look_of(args: Namespace) -> str:
    """The name or the file of the look that a command paints in.

    Raises:
        ValueError: if a look is asked for together with what is the plain one.
    """
    if not hasattr(args, "look"):
        return PLAIN_LOOK
    plain = None
    if preset_of(args) in PLAIN_PRESETS:
        plain = f"--preset {args.preset}"
    elif given(args, "draw").get("stroke") == "gaussian":
        plain = "--stroke gaussian"
    if plain is None:
        return str(getattr(args, "usual_look", DEFAULT_LOOK) if args.look is None else args.look)
    if args.look not in (None, PLAIN_LOOK):
        raise ValueError(f"--look {args.look} cannot be combined with {plain}, which is --look plain")
    return PLAIN_LOOK


def painting_name(args: Namespace, config: "PaintConfig") -> str:
    """What a painting is called after its scene: the stroke where one is named, else the look."""
    if "stroke" in given(args, "draw") or preset_of(args) in PLAIN_PRESETS:
        from brushgs.brushes.brush_set import name_of

        return name_of(config.draw.stroke)
    return Path(look_of(args)).stem


def _without_replaced(look: StepValues, args: Namespace) -> StepValues:
    """The values of a look without what a flag takes the place of."""
    draw, ground = given(args, "draw"), given(args, "ground")
    replaced: set[tuple[str, str]] = set()
    if "stroke" in draw:
        replaced |= {("brushes", name) for name in look.get("brushes", ())}
    if "background" in draw:
        if "ground" in ground:
            raise ValueError("--ground cannot be combined with --background, which takes its place")
        replaced |= {("ground", name) for name in ("ground", "backdrop", "stage")}
    return {
        step: {name: value for name, value in values.items() if (step, name) not in replaced}
        for step, values in look.items()
    }


def _backdrop(asked: bool | int | str | None, look: StepValues) -> dict[str, Any]:
    """The fields of a ground for a value of `--backdrop`; what is asked for is in any scene."""
    if asked is None:
        return {}
    ground = look.get("ground", {})
    if asked is True:
        asked = "loose" if ground.get("backdrop") and not ground.get("stage") else "stage"
    if asked == "stage":
        return {"stage": True, "backdrop": ground.get("backdrop", 0), "backdrop_always": True}
    if asked == "loose":
        asked = ground.get("backdrop") or DEFAULT_BACKDROP
    return {"stage": False, "backdrop": int(asked), "backdrop_always": bool(asked)}


def where_config(args: Namespace, step: str = "where") -> "WhereConfig | None":
    """The part of the scene that a command is limited to; None for all.

    Args:
        args: parsed flags.
        step: that they fill.

    Raises:
        ValueError: if flags need each other.
    """
    where = given(args, step)
    if "expression" not in where:
        for flag, field in (("--where-soft", "soft"), ("--camera-file", "camera_file"), ("--clip", "clip")):
            if field in where:
                raise ValueError(f"{flag} needs --where, the part of the scene that it is for")
        return None
    from brushgs.options.where import WhereConfig

    cameras: dict[str, Any] = {"camera_file": given(args, "view").get("camera_file")}
    return WhereConfig(**cameras | where)


def grow_config(args: Namespace) -> "GrowConfig | None":
    """How a painting grows; None for one that is finished.

    Raises:
        ValueError: if a value is out of range, or a camera path is asked for as well.
    """
    grow, path = given(args, "grow"), given(args, "path")
    if "seconds" not in grow:
        return None
    _refuse([name for name in path if name != "fps"], "--grow, before which the camera stands still")
    if given(args, "draw").get("lock") == "track":
        raise ValueError(NO_TRACK)
    from brushgs.options.sequence import GrowConfig

    return GrowConfig(**grow | path)


def clip_config(args: Namespace, scene: "SceneSource", *, is_moving: bool) -> "ClipConfig | None":
    """Which part of a moving scene a film shows, and how fast; None for a scene that is still.

    Raises:
        ValueError: if a value is out of range, or is asked of a still scene.
    """
    clip = given(args, "clip")
    if not is_moving:
        for field in clip:
            raise ValueError(f"{_flag(field)} needs a moving scene, and {scene} is still; omit it")
        return None
    from brushgs.options.clip import ClipConfig

    if "seconds" in given(args, "grow"):
        raise ValueError(f"--grow needs a still scene, and {scene} moves; add --time, one moment of it")
    path = given(args, "path")
    if not {"orbit", "file"} & set(path) and "fps" in path:
        clip["fps"] = path["fps"]
    return ClipConfig(**clip, loop=path.get("loop", False))


def path_config(
    args: Namespace, *, default_orbit: int | None = None, is_moving: bool = False
) -> "PathConfig | None":
    """The path of the camera; None for a single picture, and for a camera that stands still.

    Args:
        args: parsed flags.
        default_orbit: frames of the orbit that is the default path; None where that is a single picture.
        is_moving: whether the scene moves: without a path the camera then stands still.

    Raises:
        ValueError: if flags exclude each other, or need a path and there is none.
    """
    path, view = given(args, "path"), given(args, "view")
    if default_orbit is not None and not {"orbit", "file"} & set(path):
        path["orbit"] = default_orbit
    if is_moving and not {"orbit", "file"} & set(path):
        for field in set(path) - OF_FILMS:
            raise ValueError(f"{_flag(field)} needs --orbit or --path; a camera that stands still has none")
        return None
    if not {"orbit", "file"} & set(path):
        for field in path | given(args, "sequence"):
            needed = "--orbit or --path" if field in OF_PATHS else "--orbit, --path or --grow"
            raise ValueError(f"{_flag(field)} needs {needed}; a single picture does not use it")
        if given(args, "draw").get("lock") == "track":
            raise ValueError(NO_TRACK)
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
