"""The commands as Python functions: each flag is a keyword.

Ranges, defaults and help come from the option table; values are passed on without conversion to text. Editors
get the keywords and their types from the stub `keywords.pyi`, written by `.ci/keywords`.
"""

import inspect
from argparse import Action, ArgumentParser, Namespace, _HelpAction
from collections.abc import Callable, Iterator, Mapping
from keyword import iskeyword
from pathlib import Path
from typing import TYPE_CHECKING, Any

from brushgs.cli.flags import FORMATS, given, row_of_action
from brushgs.cli.option_words import OptionError, action_named, option_values
from brushgs.options.table import OF_COMMANDS, OF_SCENE_FILES, Row

if TYPE_CHECKING:
    from typing import Unpack

    from brushgs.keywords import FilmKeywords, PaintKeywords
    from brushgs.options.clip import ClipConfig
    from brushgs.options.look import Look
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneFiles, SceneSource
    from brushgs.options.sequence import PathConfig
    from brushgs.pipeline.report import Report
    from brushgs.values.camera import Camera
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians
    from brushgs.values.moving import MovingScene

# Options that belong to the command, or have a parameter of their own; by flag name.
REASONS: Mapping[str, str] = {
    "debug": "belongs to the command; errors here have their traceback",
    "config": 'belongs to the command; open the file with tomllib, and give its options as "**options"',
    "scene": "is the first argument of this function",
    "passes": "belongs to the command",
}
OF_PICTURES = "belongs to one picture; use brushgs.paint"
# Further options that `paint_film` refuses.
NOT_IN_FILMS: Mapping[str, str] = {
    "first": OF_PICTURES,
    "time": OF_PICTURES,
    "output": "is the second argument",
}


def paint(
    scene: "Gaussians | SceneFiles",
    look: "PaintConfig | Look | str | Path | None" = None,
    *,
    camera: "Camera | None" = None,
    report: "Report | None" = None,
    **options: "Unpack[PaintKeywords]",
) -> "Frame":
    """Paint one picture of a scene, as `brushgs render` does with the same options.

    Options are the flags of `brushgs render`, with "_" for "-" (`look_at`, `fov_deg`, and `from_` for
    --from). Angles are in degrees. A value has the type of the option (`size=(640, 360)`,
    `look_at=(0, 1, 2)`, `layers=["depth", "normal"]`), is text as on the command line, or is a table
    (`adjust={"contrast": 1.2}`). None means: not given.

    Args:
        scene: one file, several files or a folder; or N Gaussians, taken as a scene, not as strokes.
        look: a look, its name ("oil") or its TOML file; None for oil, the default. Or a complete
            `PaintConfig`, which excludes all options.
        camera: the view; replaces the view options.
        report: collects the stages and their notes.
        **options: as above. Options of films and of output files are refused.

    Returns:
        The picture on its ground or, without one, on the background (default white;
        `background="transparent"` keeps alpha). With a `PaintConfig` and no ground, alpha is always kept. The
        frame has a height if the look has relief.

    Raises:
        SceneError: if a file cannot be read.
        ValueError: if an option is unknown, its value is invalid, or it does not suit the scene.

    Example:
        >>> bg.paint(gaussians, "charcoal", camera=camera)
        Frame(320x240, depth)
        >>> bg.save(gaussians, "scene.ply")
        >>> bg.paint("scene.ply", stroke="flat", strokes="auto", size="320x180", azimuth=30)
        Frame(320x180, depth, height)
    """
    from brushgs.options.painting import PaintConfig
    from brushgs.pipeline import still
    from brushgs.values.gaussians import Gaussians

    _check_scene("paint", scene)
    if isinstance(look, PaintConfig):
        _refuse_beside_config("paint", options)
        return still.paint(scene, look, camera=camera, report=report)
    args, config = _parsed("paint", look, options, is_in_memory=isinstance(scene, Gaussians))
    first = 1.0 if args.first is None else args.first
    return still.paint(
        _still_source(scene, args), config, camera=camera, report=report, first=first, is_on_background=True
    )


def paint_film(
    scene: "MovingScene | SceneFiles",
    output: str | Path,
    look: "PaintConfig | Look | str | Path | None" = None,
    *,
    camera: "Camera | PathConfig | None" = None,
    clip: "ClipConfig | None" = None,
    report: "Report | None" = None,
    **options: "Unpack[FilmKeywords]",
) -> "Report":
    """Paint a moving scene as a film, as `brushgs render` does. Each stroke lasts as long as the surface it
    paints.

    Args:
        scene: a `MovingScene`, or its files, see `load_moving`. A still scene gives one frame.
        output: a video (.mp4, .webm, .gif), or numbered pictures such as frames/%05d.png.
        look: see `paint`; with options, None is oil, the default.
        camera: a fixed camera or a path; None for the view or path that the options give.
        clip: start, end, speed, rate and looping; None for those that the options give, by default the whole
            scene.
        report: collects the stages; None makes a new one.
        **options: the flags of `brushgs render`, as in `paint`, including those of films: `orbit=120`,
            `fps=25`, `speed=0.5`, `bits=10`.

    Returns:
        The report, one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option is unknown, or does not suit the scene or the output.

    Example:
        >>> from brushgs.still_life.moving import still_life_moving
        >>> scene = still_life_moving(2000, seconds=0.2)
        >>> report = bg.paint_film(scene, "clip.mp4", camera=camera, fps=10)
        >>> report.output
        'clip.mp4'
    """
    from brushgs.cli.configs import clip_config, path_config
    from brushgs.options.clip import ClipConfig
    from brushgs.options.look import config_of
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.options.sequence import SequenceConfig
    from brushgs.pipeline.film import film_of
    from brushgs.values.moving import MovingScene

    if not isinstance(scene, MovingScene):
        _check_scene("paint_film", scene)
    if not options or isinstance(look, PaintConfig):
        _refuse_beside_config("paint_film", options)
        return film_of(scene, output, config_of(look), (camera, clip, SequenceConfig()), report)
    is_in_memory = isinstance(scene, MovingScene)
    args, config = _parsed("paint_film", look, options, is_in_memory=is_in_memory, is_film=True)
    source = SceneSource((Path(str(output)),)) if is_in_memory else _source(scene, args)  # type: ignore[arg-type]
    path = path_config(args, is_moving=True)
    for name, one in (("camera", camera), ("clip", clip)):
        has_flags = path is not None if name == "camera" else bool(given(args, "clip"))
        if one is not None and has_flags:
            raise ValueError(
                f"paint_film: {name} cannot be combined with options that describe one; omit one"
            )
    found = clip or clip_config(args, source, is_moving=True) or ClipConfig()
    workers = SequenceConfig(**given(args, "sequence"))
    return film_of(
        scene if is_in_memory else source, output, config, (camera or path, found, workers), report
    )


def _check_scene(function: str, scene: object) -> None:
    """Raise TypeError if `scene` is not a scene."""
    from brushgs.options.scene_source import SceneSource
    from brushgs.values.gaussians import Gaussians

    items = scene if isinstance(scene, list | tuple) else [scene]
    if not isinstance(scene, Gaussians) and not all(
        isinstance(one, SceneSource | str | Path) for one in items
    ):
        raise TypeError(
            f"{function}: scene must be Gaussians, or a file, a folder or several of them, got "
            f"{type(scene).__name__}"
        )


def _refuse_beside_config(function: str, options: Mapping[str, Any]) -> None:
    for name in options:
        raise ValueError(f"{function}: {name} belongs in the PaintConfig, which is all options; set it there")


def _parsed(
    function: str,
    look: "Look | str | Path | None",
    options: Mapping[str, Any],
    *,
    is_in_memory: bool,
    is_film: bool = False,
) -> "tuple[Namespace, PaintConfig]":
    """Parse keyword options: the namespace of the equivalent flags, and the PaintConfig."""
    from brushgs.cli.commands.render import VIEW
    from brushgs.cli.configs import paint_config, path_config
    from brushgs.options.look import Look

    opened = look if isinstance(look, Look) else None
    if not isinstance(look, Look | str | Path | None):
        kind = type(look).__name__
        raise TypeError(
            f"{function}: look must be a look, its name or its file, or a PaintConfig, got {kind}"
        )
    try:
        args = _namespace({**options, "look": look} if look is not None and opened is None else options)
        for name in options:
            action = action_named(_parser(), name)
            if reason := _reason(action, is_in_memory=is_in_memory, is_film=is_film):
                raise OptionError(name, reason)
    except OptionError as error:
        raise ValueError(f"{function}: {error}") from None
    if not is_film:
        path_config(args)  # refuses options that need a path
    values = None if opened is None else opened.values
    return args, paint_config(args, values, **({} if is_film else {"view": VIEW}))


def _parser() -> ArgumentParser:
    from brushgs.cli.parser import command_parser

    return command_parser("render")


def _namespace(options: Mapping[str, Any]) -> Namespace:
    """The namespace that `brushgs render` parses from flags of these values."""
    parser = _parser()
    args = parser.parse_args(["scene"])
    of_one: dict[str, Action] = {}
    for action, value in option_values(parser, options):
        row = row_of_action(action)
        if row is not None and (alone := row.option.alone):
            if other := of_one.get(alone):
                names = [one.option_strings[-1] for one in (action, other)]
                raise OptionError(names[0].lstrip("-"), f"cannot be combined with {names[1]}")
            of_one[alone] = action
        if type(action).__name__ in ("_StoreAction", "_StoreTrueAction"):
            setattr(args, action.dest, value)
        else:
            action(parser, args, value)
    return args


def _reason(action: Action, *, is_in_memory: bool, is_film: bool) -> str:
    """Why a function does not take an option, and what to use; "" if it does."""
    name, row = (action.option_strings or [action.dest])[-1].lstrip("-"), row_of_action(action)
    reason = REASONS.get(name) or ("" if row is None else row.not_in_memory)
    if reason == OF_SCENE_FILES and not is_in_memory:
        reason = ""
    if is_film:
        reason = reason if reason in (OF_COMMANDS, OF_SCENE_FILES) or name in REASONS else ""
        reason = NOT_IN_FILMS.get(name, reason)
        if action.dest in ("explain", "views", "grow.seconds"):
            reason = "belongs to the command; use `brushgs render`"
    return reason


def _source(scene: "SceneFiles", args: Namespace) -> "SceneSource":
    """The scene source, with the moment and the level of detail of the options."""
    from msgspec.structs import replace

    from brushgs.options.scene_source import SceneSource

    source = SceneSource.of(scene)
    seeks_cameras = source.seeks_cameras and getattr(args, "seeks_cameras", True)
    return replace(source, **given(args, "source"), seeks_cameras=seeks_cameras)


def _still_source(scene: "Gaussians | SceneFiles", args: Namespace) -> "Gaussians | SceneSource":
    """The scene of one picture.

    Raises:
        ValueError: if it moves and no moment is given.
    """
    from brushgs.values.gaussians import Gaussians

    if isinstance(scene, Gaussians):
        return scene
    source = _source(scene, args)
    if source.time is None:
        from brushgs.formats.moving import open_moving

        if open_moving(source) is not None:
            raise ValueError(f"paint: {source} moves; give time=, one moment, or use brushgs.paint_film")
    return source


def keywords(function: str) -> Iterator[tuple[str, str, Row]]:
    """The options of a function, in the order of the help of `brushgs render`: name, group, line of the
    table.
    """
    for group in _parser()._action_groups:
        for action in group._group_actions:
            row = row_of_action(action)
            if row is None or isinstance(action, _HelpAction) or row.field == "look":
                continue
            if not _reason(action, is_in_memory=False, is_film=function == "paint_film"):
                name = row.name.replace("-", "_")
                yield name + "_" * iskeyword(name), group.title or "options", row


def _with_keywords(function: Callable[..., Any]) -> None:
    """Add all options to a function's signature, and to its docstring by group."""
    own = inspect.signature(function)
    first = [one for one in own.parameters.values() if one.kind != inspect.Parameter.VAR_KEYWORD]
    groups: dict[str, list[str]] = {}
    more = []
    for name, title, row in keywords(function.__name__):
        more.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None))
        groups.setdefault(title, []).append(f"`{name}`: {row.help(**FORMATS).replace('%%', '%')}")
    function.__signature__ = own.replace(parameters=[*first, *more])  # type: ignore[attr-defined]
    lists = (
        f"{title.capitalize()}:\n" + "\n".join(f"    {one}" for one in ones) for title, ones in groups.items()
    )
    function.__doc__ = f"{inspect.getdoc(function)}\n\n" + "\n\n".join(lists)


for _function in (paint, paint_film):
    _with_keywords(_function)
