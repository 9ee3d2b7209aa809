"""Flags of commands, generated from the option table: a command lists the option classes that it takes.

The value of a flag is in the namespace as "STEP.FIELD", and only if the flag is given; what belongs to no
step, as the options of one command do, is there by its field, with its default. Names of file formats come
from the tables of `brushgs.formats`.
"""

import argparse
from argparse import Action, ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar

from brushgs.formats.registry import (
    BESIDE_READ,
    CAMERAS_READ,
    MOVING_READ,
    PICTURES_READ,
    PICTURES_WRITTEN,
    SCENE_SUFFIXES,
    SCENES_READ,
    VIDEOS_WRITTEN,
)
from brushgs.options.choices import DEFAULT_LOOK, LOOKS, PLAIN_LOOK, REPORT_SUFFIXES
from brushgs.options.clip import ClipConfig
from brushgs.options.experiments import BenchConfig, RefineConfig, StabilityConfig
from brushgs.options.painting import STEPS, StrokeSizeFlag
from brushgs.options.renamed import current
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.options.styling import AdjustFlag
from brushgs.options.table import OF_COMMANDS, OF_FILES, Options, Row, listed, option, rows_of
from brushgs.options.where import WhereConfig

Container = ArgumentParser | argparse._ArgumentGroup
BESIDE_GIVES = f"up axis and first view, if they fit the scene: {BESIDE_READ}, in its folder or the one above"
# Replacements of {NAME} in help texts.
FORMATS: Mapping[str, str] = {
    "beside": BESIDE_GIVES,
    "cameras": CAMERAS_READ,
    "pictures": PICTURES_READ,
    "scenes": SCENES_READ,
    "written": PICTURES_WRITTEN,
    "videos": VIDEOS_WRITTEN,
    "scene_suffixes": ", ".join(SCENE_SUFFIXES),
}
# Steps -> their option classes.
CLASSES: Mapping[str, tuple[type[Options], ...]] = {
    **{step: (kind,) for step, kind in STEPS.items()},
    "adjust": (AdjustFlag, STEPS["adjust"]),
    "cluster": (STEPS["cluster"], StrokeSizeFlag),
    "source": (SceneSource,),
    "where": (WhereConfig,),
    "path": (PathConfig,),
    "grow": (GrowConfig,),
    "clip": (ClipConfig,),
    "sequence": (SequenceConfig,),
    "refine": (RefineConfig,),
    "bench": (BenchConfig,),
    "stability": (StabilityConfig,),
}
PART = "paint only this part; the rest is shown as plain Gaussians"
PLACING = ("up", "azimuth", "elevation", "side", "look_at", "distance", "pan", "roll", "fov_y", "zoom")


class LookFlag(Options, frozen=True):
    """The look, `args.look`; None if not given."""

    GROUP: ClassVar = "look"
    ABOUT: ClassVar = STEPS["light"].ABOUT
    # fmt: off
    look: Annotated[str | None, option(f"{listed(LOOKS, 'or')}, the bare method; or a file of your own "
        f"(`brushgs looks` lists them, `brushgs looks {DEFAULT_LOOK} > mine.toml` writes one to change); a "
        "look may replace the defaults of other flags #style #theme #preset", default=
        f"{DEFAULT_LOOK} ({PLAIN_LOOK} with --preset paper and --stroke gaussian)", metavar="NAME|FILE",
        example="charcoal")] = None
    # fmt: on


class ReportFlags(Options, frozen=True):
    """Form and amount of the report."""

    GROUP: ClassVar = "report"
    NOT_IN_MEMORY: ClassVar = OF_COMMANDS
    json: Annotated[bool, option("print the report as JSON on stdout, not as a table")] = False
    quiet: Annotated[bool, option("print errors only: no table, progress or path", alone="amount")] = False
    verbose: Annotated[bool, option("print all stages in the table, with details", alone="amount")] = False


class CacheFlag(Options, frozen=True):
    """Whether results of earlier commands are used."""

    GROUP: ClassVar = "report"
    NOT_IN_MEMORY: ClassVar = OF_COMMANDS
    # fmt: off
    no_cache: Annotated[bool, option("make every step; by default results of slow steps, such as strokes, "
        "are kept on disk for later commands on the same scene (see `brushgs cache`) #speed #disk")] = False
    # fmt: on


class SceneFlag(Options, frozen=True):
    """The scene that a command reads: `args.scene`, a list of paths."""

    # fmt: off
    scene: Annotated[tuple[Path, ...], option(f"trained 3D Gaussian scene: {SCENES_READ}; or a moving one: "
        f"{MOVING_READ}; several files, a folder of them, or a pattern in quotes are one scene, or, if "
        "numbered, the moments of a moving one", flag="scene", read=Path, nargs="+", default=""
    )] = ()
    # fmt: on


class NoClobberFlag(Options, frozen=True):
    """Whether -o may replace a file."""

    NOT_IN_MEMORY: ClassVar = OF_FILES
    # fmt: off
    no_clobber: Annotated[bool, option("refuse to replace a file; by default only -o replaces one #overwrite")
        ] = False
    # fmt: on


class NoMetadataFlag(Options, frozen=True):
    """Whether files get metadata."""

    NOT_IN_MEMORY: ClassVar = OF_FILES
    # fmt: off
    no_metadata: Annotated[bool, option("do not store command, version and camera in files (see `brushgs "
        "info`) #privacy")] = False
    # fmt: on


class NoCamerasFlag(Options, frozen=True):
    """`view.camera_file` of a command that takes no camera file."""

    # fmt: off
    camera_file: Annotated[str | None, option("ignore camera files beside the scene; by default these give "
        "{beside}", default="", action="camera file", choices=("none",))] = None
    # fmt: on


class Fields(Action):
    """A flag that sets several fields of a step."""

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Store the fields."""
        step, _, _ = self.dest.partition(".")
        for name, value in values.items():
            setattr(namespace, f"{step}.{name}", value)


class CameraFile(Action):
    """A camera file; "none" sets `args.seeks_cameras` to False, see `SceneSource`."""

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Store the file, or that none is used. A file called "none" is "./none"."""
        namespace.seeks_cameras = values is not None and str(values) != "none"
        if namespace.seeks_cameras:
            setattr(namespace, self.dest, values)
        elif hasattr(namespace, self.dest):
            delattr(namespace, self.dest)


class Append(argparse._AppendAction):
    """A repeatable flag: a tuple of its values; from Python also several at once."""

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Store the values."""
        more = values if isinstance(values, tuple) else (values,)
        setattr(namespace, self.dest, (*getattr(namespace, self.dest, ()), *more))


class ShowFormats(Action):
    """A flag that prints the formats, and ends the program, as --version does."""

    def __init__(self, option_strings: Any, dest: str, **what: Any) -> None:
        super().__init__(option_strings, dest, nargs=0, **what)

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Print the table."""
        from brushgs.formats.registry import format_lines

        print("\n".join(format_lines()))
        parser.exit()


ACTIONS: Mapping[str, type[Action]] = {
    "fields": Fields,
    "camera file": CameraFile,
    "append": Append,
    "formats": ShowFormats,
}


def given(args: Namespace, step: str) -> dict[str, Any]:
    """The fields of a step that were given on the command line."""
    prefix = f"{step}."
    return {name.removeprefix(prefix): value for name, value in vars(args).items() if name.startswith(prefix)}


def row_of_action(action: Action) -> Row | None:
    """The option behind a flag of a parser; None for --help and the like."""
    row: Row | None = getattr(action, "row", None)
    return row


def add(
    parser: ArgumentParser,
    of: str | type[Options],
    *names: str,
    group: tuple[str, str] | None = None,
    defaults: Mapping[str, str] | None = None,
    without: Collection[str] = (),
    words: Mapping[str, str] | None = None,
    required: bool = False,
) -> None:  # one argument per deviation of a command
    """Add the flags of options.

    Args:
        parser: of a command.
        of: a step, or an option class without a step.
        *names: fields to add; default all with flags.
        group: title and description of the help group; None for that of the class.
        defaults: field -> default in words, if this command sets it.
        without: fields to leave out.
        words: field -> help text of this command.
        required: whether the first field must be given.
    """
    classes, step = (CLASSES[of], of) if isinstance(of, str) else ((of,), "")
    rows = [(kind, row) for kind in classes for row in rows_of(kind) if row.flags]
    for number, (kind, row) in enumerate(rows):
        if (names and row.field not in names) or row.field in without:
            continue
        title, about = group or (kind.GROUP, kind.ABOUT)
        container = _group(parser, title, about)
        told = (words or {}).get(row.field)
        shown = row if told is None else row.described(told)
        default = (defaults or {}).get(row.field)
        _add_row(_alone(container, row), shown, step, default, required=required and number == 0)


def add_row(container: Container, row: Row, step: str) -> None:
    """One flag."""
    _add_row(container, row, step, None, required=False)


def _group(parser: ArgumentParser, title: str, about: str) -> Container:
    if not title:
        return parser
    found = (one for one in parser._action_groups if one.title == title)
    return next(found, None) or parser.add_argument_group(title, about or None)


def _alone(container: Container, row: Row) -> Container:
    """The mutually exclusive group of an option, created on first use."""
    name = row.option.alone
    if not name:
        return container
    groups: dict[str, Any] = container.__dict__.setdefault("groups_of_one", {})
    if name not in groups:
        groups[name] = container.add_mutually_exclusive_group()
    found: Container = groups[name]
    return found


def _add_row(container: Any, row: Row, step: str, default: str | None, *, required: bool) -> None:
    told = row.option
    what: dict[str, Any] = {"help": row.help(default, **FORMATS)}
    if row.flags[0].startswith("-"):
        what["dest"] = f"{step}.{row.field}" if step else row.field
        what["default"] = argparse.SUPPRESS if step else row.default
        if required:
            what["required"] = True
    if row.is_switch:
        what["action"] = ACTIONS.get(told.action, told.action) or "store_true"
    else:
        action = ACTIONS.get(told.action, told.action)
        what |= {name: x for name, x in (("action", action), ("nargs", told.nargs)) if x is not None}
        if told.nargs == "?" and told.const is not None:
            what["const"] = told.const
        if row.choices is not None:
            what["choices"], what["type"] = row.choices, current
        else:
            what["type"] = _reader(row)
        what["metavar"] = row.metavar if row.flags[0].startswith("-") else told.metavar or row.flags[0]
    container.add_argument(*row.flags, **what).row = row


def _reader(row: Row) -> Callable[[str], Any]:
    def read(text: str) -> Any:
        try:
            return row.read(text)
        except ValueError as error:
            raise ArgumentTypeError(str(error)) from None

    return read


def add_scene(parser: ArgumentParser, more: str = "") -> None:
    """Add the scene argument, level of detail and moment; `more` is appended to the help."""
    [row] = rows_of(SceneFlag)
    add(parser, SceneFlag, words={"scene": row.words + more} if more else None)
    add(parser, "source", without=("memory",))


def add_scene_output(parser: ArgumentParser, ending: str, *, has_moments: bool = False) -> None:
    """Add the output scene: `args.output`, None for the default.

    Args:
        parser: gets the flag.
        ending: of the default name.
        has_moments: whether a moving scene is written as a folder with one file per moment; the output then
            stays text, as a trailing slash means a folder.
    """
    default = f"SCENE-{ending}"
    folder = f"; for a moving scene a folder with one file per moment, default {default}/" * has_moments
    told = option(
        "scene file ({scene_suffixes})" + folder,
        flag="-o --output",
        default=f"{default}{SCENE_SUFFIXES[0]} in the current folder",
        metavar="FILE",
    )
    kind: Any = str | None if has_moments else Path | None
    add_row(parser, Row("output", Annotated[kind, told], None), "")
    add(parser, NoClobberFlag)


def add_experiment_output(parser: ArgumentParser, name: str, *, is_main: bool = True) -> None:
    """Add the report outputs of a measuring command: `args.report` and `args.no_plot`.

    Args:
        parser: gets the flags.
        name: of the command and its files.
        is_main: whether the report is the main output (-o), or written only on demand (--report).
    """
    suffixes = REPORT_SUFFIXES[name]
    files = listed([f"{name}{suffix}" for suffix in suffixes], "and")
    report = option(
        f"folder for {files}; or a single file, {listed(suffixes)}",
        flag="-o --output" if is_main else "--report",
        default=f"SCENE-{name} in the current folder" if is_main else "none",
        metavar="FOLDER|FILE",
    )
    plot = option(f"do not plot {name}.png; without matplotlib it is skipped with a note")
    add_row(parser, Row("report", Annotated[Path | None, report], None), "")
    if is_main:
        add(parser, NoClobberFlag)
    add_row(parser, Row("no_plot", Annotated[bool, plot], False), "")


def add_look(parser: ArgumentParser, *, usual: str = DEFAULT_LOOK) -> None:
    """Add the look (`args.look`) and its ground, color and light; `usual` is the default look."""
    if usual == PLAIN_LOOK:
        parser.set_defaults(usual_look=usual)
    add(parser, LookFlag, defaults={"look": usual} if usual == PLAIN_LOOK else None)
    for step in ("ground", "color", "light"):
        add(parser, step)


def add_draw(parser: ArgumentParser, *, has_look: bool = False) -> None:
    """Add `DrawConfig` without the lock (for paths only); `has_look`: a look sets the defaults."""
    of_look = {
        "stroke": "the brushes of the look; impasto in plain",
        "background": "the ground of the look, or white (dark brown in the demo)",
    }
    add(parser, "draw", without=("lock",), defaults=of_look if has_look else None)


def add_cluster(parser: ArgumentParser, *, has_look: bool = False) -> None:
    """Add `CleanConfig`, `ClusterConfig` without `strokes_for`, and the memory limit."""
    add(parser, "clean")
    add_stroke_count(parser, has_look=has_look)
    add(parser, "cluster", without=("strokes", "strokes_for"))
    add(parser, "source", "memory", group=("clustering", ""))


def add_stroke_count(parser: ArgumentParser, *, has_look: bool = False) -> None:
    """Add `ClusterConfig.strokes`: a count, or a target for choosing it."""
    usual = "that of the look, auto in plain" if has_look else "auto"
    words = f"{usual} (all with --stroke gaussian)"
    for row in (row for kind in CLASSES["cluster"] for row in rows_of(kind) if row.field == "strokes"):
        container = _alone(_group(parser, "clustering", ""), row)
        _add_row(container, row, "cluster", words if row.name == "strokes" else None, required=False)


def add_where(parser: ArgumentParser, limited: str, *, step: str = "where") -> None:
    """Add `WhereConfig`, see `configs.where_config`; `limited` describes the effect of the flags.

    For the step "painted", --camera-file of the view also serves the masks.
    """
    add(parser, step, group=("where", limited), without=("camera_file",) if step == "painted" else ())


def add_painting(parser: ArgumentParser, *, size: str = "1280x720") -> None:
    """Add all options of one picture; `size` is the default size in words."""
    add_look(parser)
    add_draw(parser, has_look=True)
    add(parser, "prune")
    add_cluster(parser, has_look=True)
    add(parser, "cluster", "strokes_for")
    add_passes(parser)
    add_view(parser, size=size)


def add_passes(parser: ArgumentParser) -> None:
    """Add strokes, palette, style, adjustments, rules and the painted part."""
    for step in ("strokes", "palette", "style", "adjust", "rules", "overpaint"):
        add(parser, step)
    add_where(parser, PART, step="painted")


def add_view(parser: ArgumentParser, *, size: str = "1280x720") -> None:
    """Add `ViewConfig`; `size` is the default size in words."""
    add(parser, "view", defaults={"size": f"{size}, or that of the camera in the file"})


def add_framing(parser: ArgumentParser, *, size: str) -> None:
    """Add the framing options of `ViewConfig`; `size` is the default size in words."""
    group = ("view", "framed on the scene")
    add_size(parser, size, group=group)
    add(parser, "view", *PLACING, group=group)
    add_no_cameras(parser, group)


def add_no_cameras(parser: ArgumentParser, group: tuple[str, str] = ("", "")) -> None:
    """Add `--camera-file none` (`args.seeks_cameras`) for a command without a camera file."""
    add_row(_group(parser, *group), rows_of(NoCamerasFlag)[0], "view")


def add_size(parser: ArgumentParser, default: str, *, group: tuple[str, str]) -> None:
    """Add `ViewConfig.size` without "auto"; `default` in words."""
    from brushgs.options.painting import picture_size

    told = option(
        "picture size in pixels", default=default, metavar="WxH", read=picture_size, written=("x", "")
    )
    row = Row("size", Annotated[tuple[int, int], told], None)
    add_row(_group(parser, *group), row, "view")
