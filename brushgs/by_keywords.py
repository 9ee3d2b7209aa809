"""What a command does, from Python: its options as keywords, by the names of its flags.

The parser of the command reads them, so ranges, defaults and sentences are those of the command line.
"""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from brushgs.options.look import Look
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneFiles
    from brushgs.pipeline.report import Report
    from brushgs.values.camera import Camera
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians

OF_FILMS = "belongs to films; use `brushgs render`, or brushgs.paint_film"
OF_FILES = "belongs to files; use `brushgs render`, or brushgs.save(frame, ...)"
# Steps and single flags of `brushgs render` that one picture in memory does not have -> what to use instead.
NOT_HERE: Mapping[str, str] = {
    **dict.fromkeys(("path", "grow", "clip", "sequence", "output.codec"), OF_FILMS),
    **dict.fromkeys(("output", "views", "output.bits"), OF_FILES),
    **dict.fromkeys(("json", "quiet", "verbose"), "belongs to the command; give report="),
    "explain": "paints nothing; use brushgs.pipeline.prepare.open_job(scene, config, report).explain()",
    "debug": "belongs to the command; errors here have their traceback",
    "config": 'belongs to the command; open the file with tomllib, and give its options as "**options"',
}


def paint(
    scene: "Gaussians | SceneFiles",
    look: "PaintConfig | Look | str | Path | None" = None,
    *,
    camera: "Camera | None" = None,
    report: "Report | None" = None,
    **options: Any,
) -> "Frame":
    """Paint one picture of a scene: what `brushgs render` does with the same options.

    Options are the flags of `brushgs render`, with "_" for "-" (`look_at`, `fov_deg`, and `from_` for
    --from); `brushgs render --help` tells their ranges and defaults. As there, angles are in degrees. A value
    is what the flag takes as text, or a number, a path, True or False for a switch, a list where the flag
    takes several values: `size=(640, 360)`, `look_at=(0, 1, 2)`, `layers=["depth", "normal"]`; or a table:
    `adjust={"contrast": 1.2}`. None is an option that is omitted.

    Args:
        scene: the files of a scene, one, several or a folder; or N Gaussians, which count as a scene and not
            as strokes.
        look: a look, its name ("oil") or its TOML file; None for that of the command, oil. Or a whole
            `PaintConfig`, which takes no other options.
        camera: the view, in place of the one that the options describe.
        report: gets the stages and what they did.
        **options: as above. Those of films and of files are refused.

    Returns:
        The picture on its ground, or on its background, white unless one is named: with
        `background="transparent"` strokes keep their alpha. With a `PaintConfig` they keep it where there is
        no ground. It has a height where the look has a relief.

    Raises:
        SceneError: if a file cannot be read.
        ValueError: if there is no such option, or it does not take the value, or does not suit the scene.

    Example:
        >>> bg.paint(gaussians, "charcoal", camera=camera)
        Frame(320x240, depth)
        >>> bg.save(gaussians, "scene.ply")
        >>> bg.paint("scene.ply", stroke="flat", strokes="auto", size="320x180", azimuth=30)
        Frame(320x180, depth, height)
    """
    from brushgs.options.painting import PaintConfig
    from brushgs.pipeline import still

    if isinstance(look, PaintConfig):
        if options:
            name = next(iter(options))
            raise ValueError(f"paint: {name} belongs in the PaintConfig, which is all options; set it there")
        return still.paint(scene, look, camera=camera, report=report)
    args, config = _parsed(scene, look, options)
    first = 1.0 if args.first is None else args.first
    return still.paint(
        _source(scene, args), config, camera=camera, report=report, first=first, is_on_background=True
    )


def _parsed(
    scene: "Gaussians | SceneFiles", look: "Look | str | Path | None", options: Mapping[str, Any]
) -> "tuple[Namespace, PaintConfig]":
    """The flags that options stand for, and how they paint."""
    from brushgs.cli.commands.render import VIEW
    from brushgs.cli.configs import paint_config, path_config
    from brushgs.cli.option_words import OptionError, option_words
    from brushgs.cli.parser import command_parser
    from brushgs.options.look import Look
    from brushgs.values.gaussians import Gaussians

    opened = look if isinstance(look, Look) else None
    if look is not None and opened is None:
        options = {**options, "look": look}
    parser = command_parser("render")
    try:
        _refuse_others(parser, options, is_in_memory=isinstance(scene, Gaussians))
        words = option_words(parser, options)
    except OptionError as error:
        raise ValueError(f"paint: {error}") from None
    args = parser.parse_args(["scene", *words])
    path_config(args)  # refuses what needs a path
    return args, paint_config(args, None if opened is None else opened.values, view=VIEW)


def _refuse_others(parser: Any, options: Mapping[str, Any], *, is_in_memory: bool) -> None:
    from brushgs.cli.option_words import OptionError, action_named

    for name in options:
        dest = action_named(parser, name).dest
        step, _, field = dest.partition(".")
        cure = NOT_HERE.get(dest) or (NOT_HERE.get(step) if field and step != "output" else None)
        if is_in_memory and dest in ("lod", "time", "moments_per_second", "memory"):
            cure = "belongs to scene files; omit it with Gaussians, which are in memory"
        if cure is not None:
            raise OptionError(name, cure)


def _source(scene: "Gaussians | SceneFiles", args: Namespace) -> "Gaussians | SceneFiles":
    """What is painted, at the moment and in the detail that the flags say.

    Raises:
        ValueError: if it moves, and no moment is named.
    """
    from brushgs.options.scene_source import SceneSource
    from brushgs.values.gaussians import Gaussians

    if isinstance(scene, Gaussians):
        return scene
    given = SceneSource.of(scene)
    lod = given.lod if args.lod is None else args.lod
    time = given.time if args.time is None else args.time
    rate = given.moments_per_second if args.moments_per_second is None else args.moments_per_second
    memory = given.memory if args.memory is None else args.memory
    seeks_cameras = given.seeks_cameras and getattr(args, "seeks_cameras", True)
    source = SceneSource(given.paths, lod, time, rate, memory, seeks_cameras)
    if source.time is None:
        from brushgs.io.moving import open_moving

        if open_moving(source) is not None:
            raise ValueError(f"paint: {source} moves; give time=, one moment, or use brushgs.paint_film")
    return source
