"""Writes the sources of the site: the pages of the repository, and a reference of public names and commands.

python .ci/docs/write_pages.py FOLDER

Pages keep their places, so that links lead where they lead on GitHub; README.md is the first one. The
reference is read from `brushgs.__all__`, docstrings, the table of commands and their parsers: nothing that is
new needs a line here.
"""

import argparse
import inspect
import re
import shutil
import sys
from pathlib import Path

import brushgs
from brushgs.cli.parser import COMMANDS, build_parser

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
COPIED = ("README.md", "CHANGELOG.md", "NOTICE", "LICENSE", "docs", "strokes", "examples")
TUTORIALS = ("first_picture", "own_look", "film", "styles", "paint_over", "page")
GUIDES = (
    "install",
    "recipes",
    "scenes",
    "looks",
    "styles",
    "moving",
    "time",
    "page",
    "outlets",
    "print",
    "headsets",
)
GUIDES += ("python",)
# The side bar: captions, and the pages below each in order.
CONTENTS = {
    "Overview": ["docs/README"],
    "Tutorials": [f"docs/tutorials/{name}" for name in TUTORIALS],
    "How-to": [*(f"docs/{name}" for name in GUIDES), "strokes/README"],
    "Reference": ["gallery/index", "reference/index"],
    "Explanation": ["docs/method", "docs/measured", "docs/machines", "docs/structure", "CHANGELOG"],
    "Measured": ["examples/measured/README", "examples/measured/*"],
}
FOLDER_LINK = re.compile(r"\[([^\]]*)\]\([\w./]*(?:examples|gallery)\)")  # which a site cannot show
# Folders and modules of the package -> what their public names are for, in the order of the index. Others
# come last, under the name of their folder.
GROUPS = {
    "scene": "Values",
    "moving_scene": "Values",
    "style": "Values",
    "formats": "Files",
    "page": "Files",
    "by_keywords": "Painting",
    "painting": "Painting",
    "painting.cameras": "Cameras",
    "painting.cluster": "From Gaussians to strokes",
    "passes": "From Gaussians to strokes",
    "stroke_count": "From Gaussians to strokes",
    "rendering": "From strokes to pictures",
    "brushes": "Brushes",
    "options": "Options",
    "doctor": "Faults and errors",
    "errors": "Faults and errors",
}


def main(folder: Path) -> None:
    """Write everything anew."""
    shutil.rmtree(folder, ignore_errors=True)
    _copy_pages(folder)
    _write_reference(folder / "reference")


def _copy_pages(folder: Path) -> None:
    """The pages with what they show, and the contents of the site below the first of them."""
    for name in COPIED:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    (folder / "README.md").rename(folder / "index.md")
    for page in folder.rglob("*.md"):
        text = page.read_text(encoding="utf-8")
        page.write_text(FOLDER_LINK.sub(r"\1", text), encoding="utf-8")
    with (folder / "index.md").open("a", encoding="utf-8") as index:
        for caption, pages in CONTENTS.items():
            index.write(
                "\n".join(
                    ["", "```{toctree}", ":hidden:", ":glob:", f":caption: {caption}", *pages, "```", ""]
                )
            )


def _write_reference(folder: Path) -> None:
    for part in ("python", "commands"):
        (folder / part).mkdir(parents=True)
    index = [_title("Reference"), ".. currentmodule:: brushgs", "", (HERE / "intro.rst").read_text()]
    index += [".. code-block:: python", "", *_indented((HERE / "begin.txt").read_text())]
    for group, names in _grouped().items():
        lines = {name: f":py:obj:`{name}`: {_first_sentence(name)}" for name in names}
        index += ["", _title(group, "-"), *_contents("python", group, lines)]
        for name in names:
            _write(folder / "python" / f"{name}.rst", _page_of_name(name))
    lines = {
        name: f":doc:`brushgs {name} <commands/{name}>`: {_escaped(what)}" for name, what in COMMANDS.items()
    }
    index += ["", _title("Commands", "-"), *_contents("commands", "Commands", lines)]
    for name in COMMANDS:
        _write(folder / "commands" / f"{name}.rst", _page_of_command(name))
    _write(folder / "index.rst", index)


def _grouped() -> dict[str, list[str]]:
    """Public names by group."""
    groups: dict[str, list[str]] = {title: [] for title in GROUPS.values()}
    for name in brushgs.__all__:
        module = brushgs._MODULE_OF[name]
        top = module.split(".")[0]
        title = GROUPS.get(module, GROUPS.get(top, top.replace("_", " ").capitalize()))
        groups.setdefault(title, []).append(name)
    return {title: names for title, names in groups.items() if names}


def _page_of_name(name: str) -> list[str]:
    kind = "class" if inspect.isclass(getattr(brushgs, name)) else "function"
    lines = [_title(name), ".. currentmodule:: brushgs", "", f".. auto{kind}:: {name}"]
    return [*lines, "   :members:"] if kind == "class" else lines


def _page_of_command(name: str) -> list[str]:
    """What `brushgs NAME --help` says, a section for each of its groups and an entry for each flag."""
    parser = _parser_of(name)
    usage = parser.format_usage().removeprefix("usage: ")
    lines = [
        _title(f"brushgs {name}"),
        _escaped(parser.description or ""),
        "",
        f".. program:: brushgs {name}",
        "",
    ]
    lines += [".. code-block:: text", "", *_indented(usage)]
    for group in parser._action_groups:
        if not group._group_actions:
            continue
        lines += ["", _title((group.title or "").capitalize(), "-"), _escaped(group.description or "")]
        for action in group._group_actions:
            lines += ["", f".. option:: {_form_of(action)}", "", f"   {_escaped(_help_of(parser, action))}"]
    return [*lines, "", _escaped(parser.epilog or "")]


def _parser_of(name: str) -> argparse.ArgumentParser:
    whole = build_parser([name])
    commands = next(a for a in whole._actions if isinstance(a, argparse._SubParsersAction))
    parser: argparse.ArgumentParser = commands.choices[name]
    return parser


def _form_of(action: argparse.Action) -> str:
    """A flag as it is written, such as "-o PATH, --output PATH"."""
    values = argparse.HelpFormatter("")._format_args(action, action.metavar or action.dest.upper())  # type: ignore[arg-type]
    flags = action.option_strings or [""]
    return ", ".join(f"{flag} {values}".strip() for flag in flags)


def _help_of(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    return parser._get_formatter()._expand_help(action) if action.help else ""


def _contents(folder: str, group: str, lines: dict[str, str]) -> list[str]:
    """A line for each page, and a table of contents, which the side bar shows."""
    tree = [".. toctree::", "   :hidden:", f"   :caption: {group}", ""]
    return [*(f"- {line}" for line in lines.values()), "", *tree, *(f"   {folder}/{name}" for name in lines)]


def _first_sentence(name: str) -> str:
    """Of its docstring, as text of a line."""
    paragraph = " ".join((inspect.getdoc(getattr(brushgs, name)) or "").split("\n\n")[0].split())
    return re.split(r"(?<=[.;:])\s", paragraph)[0].rstrip(".;:").replace("|", r"\|").replace("*", r"\*") + "."


def _title(text: str, line: str = "=") -> str:
    return f"{text}\n{line * len(text)}\n"


def _escaped(text: str) -> str:
    r"""Plain text as reStructuredText: what would be markup there is shown as it is."""
    return re.sub(r"([*`|_\\])", r"\\\1", " ".join(text.split()))


def _indented(text: str) -> list[str]:
    return [f"   {line}".rstrip() for line in text.rstrip().splitlines()]


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
