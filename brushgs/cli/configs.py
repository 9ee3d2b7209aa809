"""Build frozen option classes from parsed flags; the namespace is never changed."""

from argparse import Namespace
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from brushgs.cli.flags import CLASSES, given
from brushgs.options.choices import (
    DEFAULT_BACKDROP,
    DEFAULT_LOOK,
    PLAIN_LOOK,
    PLAIN_PRESETS,
    PLAIN_SCENE,
    PRESETS,
    StepValues,
)
from brushgs.options.clip import ClipConfig
from brushgs.options.combinations import OF_FILMS, OF_PATHS, PATH_RULES, check_given
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import GrowConfig, PathConfig
from brushgs.options.table import rows_of, values_of
from brushgs.options.where import WhereConfig

NOTHING: Mapping[str, Any] = MappingProxyType({})
NO_TRACK = "--lock track needs --orbit or --path; strokes are tracked only along a path"


def flag_of(dest: str) -> str:
    """The flag of a "STEP.FIELD"."""
    step, _, field = dest.partition(".")
    return next(row.flags[-1] for kind in CLASSES[step] for row in rows_of(kind) if row.field == field)


def scene_source(args: Namespace) -> SceneSource:
    """The scene that a command reads."""
    seeks_cameras = getattr(args, "seeks_cameras", True)
    return SceneSource(tuple(args.scene), **given(args, "source"), seeks_cameras=seeks_cameras)


def paint_config(
    args: Namespace, look_values: StepValues | None = None, **defaults: Mapping[str, Any]
) -> PaintConfig:
    """The options of a painting.

    Precedence of a field: its flag, the preset (or without one `--stroke gaussian`), the quality, the look,
    the default of the command, the default of its class.

    Args:
        args: parsed flags; a command may lack some of a painting's.
        look_values: values of a look, in place of the look of the flags.
        **defaults: of the command, by step and field, such as `view={"size": (640, 360)}`.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
        SceneError: if the look is a file that cannot be read.
    """
    preset = PRESETS[preset_of(args)]
    has_method = preset_of(args) in PLAIN_PRESETS
    is_plain = given(args, "draw").get("stroke") == "gaussian" and not has_method
    plain = PLAIN_SCENE if is_plain else NOTHING
    whole = _values_of(look_of(args)) if look_values is None else look_values
    look = _in_quality(_without_replaced(whole, args), args)
    check_given(vars(args), flag_of)
    flags = {step: given(args, step) for step in STEPS}
    if painted := where_config(args, "painted"):
        flags["painted"] = values_of(painted)
    below = _layered([defaults, look, preset, plain])
    if flags["style"] or below["style"]:
        flags["style"] |= {"has_brushes": not is_plain and "stroke" not in flags["draw"]}
    values = _layered([_styled(below, below["style"] | flags["style"]), flags])
    values["ground"] |= _backdrop(given(args, "ground").get("backdrop"), whole)
    if look_values is None and look_is_default(args) and "stroke" not in flags["draw"] and not has_method:
        values["brushes"]["are_usual"] = True
    return PaintConfig.of(values)


def _in_quality(look: StepValues, args: Namespace) -> StepValues:
    """The values of a look in the quality of a command line."""
    quality = getattr(args, "quality", None)
    if quality is None:
        return look
    from brushgs.options.quality import with_quality

    return with_quality(look, quality)


def preset_of(args: Namespace) -> str:
    """The preset of a command line."""
    return str(getattr(args, "preset", "default"))


def look_is_default(args: Namespace) -> bool:
    """Whether no look was given."""
    return getattr(args, "look", None) is None


def _layered(layers: Iterable[StepValues]) -> dict[str, dict[str, Any]]:
    """Merge layers: each field has the value of the last layer that contains it."""
    return {
        step: {name: value for layer in layers for name, value in layer.get(step, {}).items()}
        for step in STEPS
    }


def _styled(values: StepValues, style: Mapping[str, Any]) -> StepValues:
    """The values of a look, blended with those of its styles."""
    if not style:
        return values
    from brushgs.options.styling import StyleConfig
    from brushgs.pipeline.styling import styled_values

    return styled_values(values, StyleConfig(**style))


def _values_of(look: str) -> StepValues:
    if look == PLAIN_LOOK:  # adds nothing; avoids the TOML reader
        return {}
    from brushgs.options.look import Look

    return Look.open(look).values


def look_of(args: Namespace) -> str:
    """Name or file of the look.

    Raises:
        ValueError: if a look is given together with flags that imply the plain one.
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


def painting_name(args: Namespace, config: PaintConfig) -> str:
    """Suffix of a painting's default name: the stroke if given, else the look."""
    if "stroke" in given(args, "draw") or preset_of(args) in PLAIN_PRESETS:
        from brushgs.brushes.brush_set import name_of

        return name_of(config.draw.stroke)
    return Path(look_of(args)).stem


def _without_replaced(look: StepValues, args: Namespace) -> StepValues:
    """The values of a look without those that flags replace."""
    draw = given(args, "draw")
    replaced: set[tuple[str, str]] = set()
    if "stroke" in draw:
        replaced |= {("brushes", name) for name in look.get("brushes", ())}
    if "background" in draw:
        replaced |= {("ground", name) for name in ("ground", "backdrop", "stage")}
    return {
        step: {name: value for name, value in values.items() if (step, name) not in replaced}
        for step, values in look.items()
    }


def _backdrop(asked: bool | int | str | None, look: StepValues) -> dict[str, Any]:
    """The fields of `GroundConfig` for a value of `--backdrop`; an explicit backdrop applies to any scene."""
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


def where_config(args: Namespace, step: str = "where") -> WhereConfig | None:
    """The part of the scene that a command is limited to; None for all.

    Args:
        args: parsed flags.
        step: the step of its flags.

    Raises:
        ValueError: if a flag lacks another that it needs.
    """
    where = given(args, step)
    if "expression" not in where:
        check_given(vars(args), flag_of)
        return None
    cameras: dict[str, Any] = {"camera_file": given(args, "view").get("camera_file")}
    return WhereConfig(**cameras | where)


def grow_config(args: Namespace) -> GrowConfig | None:
    """The options of a growing painting; None for a finished one.

    Raises:
        ValueError: if a value is out of range, or an option needs a camera path and there is none.
    """
    grow, path = given(args, "grow"), given(args, "path")
    if not grow:
        return None
    if {"orbit", "file"} & set(path):
        return GrowConfig(**grow, is_along_path=True)
    for dest in OF_PATHS:
        if dest in vars(args):
            raise ValueError(f"{flag_of(dest)} needs --orbit or --path; a fixed camera does not use it")
    if given(args, "draw").get("lock") == "track":
        raise ValueError(NO_TRACK)
    return GrowConfig(**grow | path)


def clip_config(args: Namespace, scene: SceneSource, *, is_moving: bool) -> ClipConfig | None:
    """The options of a film of a moving scene; None for a still one.

    Raises:
        ValueError: if a value is out of range, or a flag is given for a still scene.
    """
    clip = given(args, "clip")
    if not is_moving:
        for field in clip:
            raise ValueError(
                f"{flag_of(f'clip.{field}')} needs a moving scene, and {scene} is still; omit it"
            )
        return None
    if "seconds" in given(args, "grow"):
        raise ValueError(f"--grow needs a still scene, and {scene} moves; add --time, one moment of it")
    path = given(args, "path")
    if not {"orbit", "file"} & set(path) and "fps" in path:
        clip["fps"] = path["fps"]
    return ClipConfig(**clip, loop=path.get("loop", False))


def views_config(
    args: Namespace, grow: GrowConfig | None, *, is_moving: bool
) -> PathConfig | GrowConfig | None:
    """The views of `render`: a camera path, a painting that grows before a fixed camera, or None for neither.

    Raises:
        ValueError: see `path_config`.
    """
    if grow is not None and not grow.is_along_path:
        return grow
    return path_config(args, is_moving=is_moving)


def path_config(
    args: Namespace, *, default_orbit: int | None = None, is_moving: bool = False
) -> PathConfig | None:
    """The camera path; None for a single picture or a fixed camera.

    Args:
        args: parsed flags.
        default_orbit: frames of the orbit used without a path; None if that is a single picture.
        is_moving: whether the scene moves; without a path the camera is then fixed.

    Raises:
        ValueError: if flags exclude each other, or need a path and there is none.
    """
    path = given(args, "path")
    has_path = default_orbit is not None or bool({"orbit", "file"} & set(path))
    if has_path:
        if not {"orbit", "file"} & set(path):
            path["orbit"] = default_orbit
        check_given(vars(args), flag_of, PATH_RULES)
        return PathConfig(**path)
    _check_no_path(args, is_moving=is_moving)
    return None


def _check_no_path(args: Namespace, *, is_moving: bool) -> None:
    """Raise a ValueError if flags need a path, which there is not."""
    for dest in [name for name in vars(args) if name.startswith(("path.", "sequence.", "hand."))]:
        if is_moving and (dest in OF_FILMS or not dest.startswith("path.")):
            continue
        needed = "--orbit or --path" if is_moving or dest in OF_PATHS else "--orbit, --path or --grow"
        reason = "a fixed camera does not use it" if is_moving else "a single picture does not use it"
        raise ValueError(f"{flag_of(dest)} needs {needed}; {reason}")
    if is_moving:
        return
    if any(one.name == "hold" for one in given(args, "strokes").get("maps", ())):
        raise ValueError("map hold needs --orbit, --path or --grow; a single picture does not use it")
    if given(args, "draw").get("lock") == "track":
        raise ValueError(NO_TRACK)
