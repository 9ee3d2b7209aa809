"""`brushgs style`: learn a style from a painting or an edit, or show the contents of a style file."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from brushgs.cli import flags
from brushgs.cli.console import reported
from brushgs.cli.fitting_words import table_of_words
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.table import Options, option, rows_of

if TYPE_CHECKING:
    from brushgs.values.style import Style


class Own(Options, frozen=True):
    """Action and file."""

    # fmt: off
    action: Annotated[str, option("learn a style and write it to a file, or show a style file; words are "
        "computed by thresholds on colors and marks, not by a language model", flag="action",
        default="", metavar="learn|show", choices=("learn", "show"))] = "learn"
    file: Annotated[Path | None, option("painting to learn from: {pictures}; or "
        f"file *{STYLE_SUFFIX} to show", flag="file", default="", nargs="?")] = None
    # fmt: on


class Learn(Options, frozen=True):
    """Sources of an edit style."""

    GROUP: ClassVar = "learn"
    ABOUT: ClassVar = "from a painting, or from an edit of a scene"
    # fmt: off
    before: Annotated[Path | None, option("the scene before an edit; with --camera-file pictures of it, a "
        "folder or one; without, the scene itself is what was painted over", default="", metavar="PATH"
    )] = None
    after: Annotated[Path | None, option("the same scene after it; with --camera-file pictures of it, a "
        "folder or one", default="", metavar="PATH")] = None
    scene: Annotated[Path | None, option("that the pictures of an edit show", default="", metavar="SCENE"
    )] = None
    camera_file: Annotated[Path | None, option("cameras of the pictures, matched by name or order: {cameras}",
        default="")] = None
    # fmt: on


class Written(Options, frozen=True):
    """The output file."""

    GROUP: ClassVar = Learn.GROUP
    # fmt: off
    output: Annotated[Path | None, option("style file", flag="-o --output",
        default=f"name of the painting, or of --after, with {STYLE_SUFFIX}, in the current folder",
        metavar=f"FILE{STYLE_SUFFIX}")] = None
    name: Annotated[str | None, option("name of the style", default="that of the painting", metavar="TEXT"
    )] = None
    small: Annotated[bool, option("64 marks cut out of a painting in place of 192: a third of the file, for "
        "pages")] = False
    # fmt: on


OF_EDITS = tuple(row.field for row in rows_of(Learn))


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add(parser, Own)
    flags.add(parser, Learn)
    flags.add(parser, "view", "up", group=(Learn.GROUP, Learn.ABOUT))
    flags.add(parser, Written)
    flags.add(parser, flags.NoClobberFlag, group=(Learn.GROUP, Learn.ABOUT))
    flags.add(parser, flags.ReportFlags)


def run(args: Namespace) -> None:
    """Learn or show.

    Raises:
        ValueError: if no file is given, or a flag of learning with `show`.
    """
    if args.action == "show":
        for name in ("output", "name", "small", *OF_EDITS):
            if getattr(args, name):
                flag = name.replace("_", "-")
                raise ValueError(f"--{flag} belongs to `brushgs style learn`; remove it")
        _show(_file(args), as_json=args.json)
    else:
        _learn(args)


def _file(args: Namespace) -> Path:
    if args.file is None:
        what = "painting" if args.action == "learn" else f"file *{STYLE_SUFFIX}"
        raise ValueError(f"style {args.action} needs a {what}; name it")
    file: Path = args.file
    return file


def _learn(args: Namespace) -> None:
    if any(getattr(args, name) is not None for name in OF_EDITS):
        _learn_edit(args)
        return
    if flags.given(args, "view"):
        raise ValueError("--up belongs to --before and --after; a painting has none, remove it")
    painting = _file(args)
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.outlets.learn_style import learn_file

        output = output_of(args, Path(f"{painting.stem}{STYLE_SUFFIX}"))
        learn_file(painting, output, args.name, report, small=args.small)


def _learn_edit(args: Namespace) -> None:
    if args.file is not None:
        raise ValueError("style learn takes a painting, or --before and --after; omit one")
    if args.after is None:
        raise ValueError("style learn needs --after too, the scene after the edit beside that before it")
    from brushgs.options.style_edit import EditSource

    up = flags.given(args, "view").get("up")
    source = EditSource(args.before, args.after, args.scene, args.camera_file, up)
    with reported(args) as report:
        from brushgs.cli.origin import output_of
        from brushgs.outlets.learn_edit import learn_edit_file

        output = output_of(args, Path(f"{args.after.stem}{STYLE_SUFFIX}"))
        learn_edit_file(source, output, args.name, report)


def _show(path: Path, *, as_json: bool) -> None:
    from brushgs.formats.styles import read_style

    style = read_style(path)
    facts = _facts(style)
    if as_json:
        import json

        print(json.dumps(facts, indent=2))
        return
    for name, value in facts.items():
        if name == "words":
            print(*table_of_words(_words(style)), sep="\n")
        elif isinstance(value, list):
            print(name)
            _print_table(value)
        elif isinstance(value, dict):
            for part, number in value.items():
                print(f"{f'{name} {part}'.replace('_', ' '):24} {_text(number)}")
        else:
            print(f"{name:24} {_text(value)}")


def _facts(style: "Style") -> dict[str, object]:
    """The contents of a style, for people and machines."""
    from brushgs.values.colors import code_of

    facts: dict[str, object] = {"name": style.name, "kind": style.kind}
    if style.palette is not None:
        facts["palette"] = [
            {"name": one.name, "color": code_of(one.rgb), "share": round(one.share, 4)}
            for one in style.palette.colors
        ]
    if style.marks is not None:
        marks = style.marks
        facts["marks"] = {
            "length": marks.length,
            "aspect": marks.aspect,
            "broken_lightness": marks.broken_lightness,
            "broken_chroma": marks.broken_chroma,
            "ground": None if marks.ground is None else code_of(marks.ground),
            "relief": marks.relief,
            "directions": "{1}x{0}".format(*marks.directions.shape),
            "brushes": len(marks.brushes),
            "dictionary": 0 if marks.dictionary is None else len(marks.dictionary),
        }
        for name, spectrum in (("coherent", marks.coherent), ("incoherent", marks.incoherent)):
            if spectrum is not None:
                facts[f"{name} areas"] = {
                    "share": spectrum.share,
                    "lengths": list(spectrum.lengths),
                    "widths": list(spectrum.widths),
                }
    if style.stage is not None:
        facts["surroundings"] = "{1}x{0}".format(*style.stage.colors.shape)
    if style.lines is not None:
        lines = style.lines
        facts["contours"] = {"share": lines.share, "width": lines.width, "color": code_of(lines.rgb)}
    if style.edit is not None:
        residual = style.edit.residual
        facts["edit"] = {
            "affine": style.edit.affine.tolist(),
            "log_size": style.edit.log_size,
            "residual": None if residual is None else f"{len(residual.centers)} bumps",
            "features": [] if residual is None else list(residual.features),
        }
    if words := _words(style):
        facts["words"] = words
    return facts


def _words(style: "Style") -> list[dict[str, Any]]:
    """Words that fit a painting, by thresholds."""
    from brushgs.doctor.in_words import facts_of
    from brushgs.passes.style.words import words_of_style

    return facts_of(words_of_style(style))


def _print_table(rows: list[dict[str, object]]) -> None:
    width = max(len(str(row["name"])) for row in rows)
    for row in rows:
        print(f"  {row['color']}  {row['name']!s:{width}}  {100 * float(str(row['share'])):5.1f} %")


def _text(value: object) -> str:
    if isinstance(value, list):
        return "  ".join(_text(item) for item in value) or "none"
    return "none" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
