"""A file of jobs in TOML: each job is a command with options named after its flags.

    [defaults]                              # of all jobs whose command has such a flag
    size = "1280x720"

    [[job]]
    scene = "garden.ply"
    output = "garden.png"

    [[job]]                                 # two scenes in three looks, seen from two sides: twelve jobs
    output = "out/{scene}-{look}-{side}.png"
    [job.each]
    scene = ["garden.ply", "kitchen.spz"]
    look = ["oil", "ink", "charcoal"]
    side = [{ name = "front", from = "front" }, { name = "above", elevation = 60, zoom = 1.2 }]

`command = "export"` chooses another command than render. All paths, also of outputs, are relative to the
folder of this file.
"""

import itertools
import re
import string
from argparse import ArgumentParser
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from brushgs.cli.config_file import beaten
from brushgs.cli.flags import row_of_action
from brushgs.cli.option_words import OptionError, action_named, flag_name, named_actions, option_words
from brushgs.cli.parser import COMMANDS, command_parser
from brushgs.errors import SceneError
from brushgs.options.scene_source import SceneSource
from brushgs.options.table import hint_for
from brushgs.options.toml_values import line_of, read_text, read_toml

MAX_BYTES = 1 << 20  # of a file
MAX_JOBS = 10_000  # more is a typing error
DEFAULT_COMMAND = "render"
NOT_IN_BATCH = {"batch", "view"}  # commands that run others, or wait for people
OF_THE_BATCH = {"json", "quiet", "verbose", "debug", "config", "explain"}  # flags of the batch itself
NAMED_FILES = {"look", "stroke", "ground", "background"}  # options that may be files, named by stem


@dataclass(frozen=True)
class Job:
    """One command, ready to be run.

    Attributes:
        number: from 1, in the order of the file.
        where: file and line, for messages.
        command: name of the command.
        words: its arguments; paths are relative to `folder`.
        output: output path, relative to `folder`.
        folder: of the file of jobs.
    """

    number: int
    where: str
    command: str
    words: tuple[str, ...]
    output: str
    folder: Path

    @property
    def path(self) -> Path:
        """Path of the output."""
        return self.folder / self.output


def read_jobs(path: Path) -> list[Job]:
    """The jobs of a file in order, lists expanded.

    Raises:
        SceneError: if it cannot be read or an option is invalid; names file, line and cure.
    """
    text = read_text(path, "a file of jobs", MAX_BYTES)
    content = read_toml(text, path, "see `brushgs batch --help`")
    reader = _Reader(path, text)
    for key in content:
        if key not in ("defaults", "job"):
            cure = hint_for(key, ("defaults", "job")) or "; options stand in [defaults] and [[job]]"
            raise reader.error(f"{key} is no table of a file of jobs{cure}", key)
    tables, defaults = content.get("job", []), content.get("defaults", {})
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        raise reader.error("must have at least one table [[job]]; see `brushgs batch --help`")
    if not isinstance(defaults, dict):
        raise reader.error("defaults must be a table, [defaults]", "defaults")
    reader.check_defaults(defaults)
    jobs: list[Job] = []
    for index, table in enumerate(tables):
        for job in reader.jobs_of(index, table, defaults, first=len(jobs) + 1):
            jobs.append(job)
            if len(jobs) > MAX_JOBS:
                raise reader.error(f"has more than {MAX_JOBS} jobs; shorten the lists of [job.each]")
    return jobs


class _Reader:
    """Turns the tables of one file into jobs; finds line numbers for messages."""

    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._text = text
        self._folder = path.parent

    def error(self, fact: str, key: str = "", table: str = "", index: int = 0) -> SceneError:
        """An error at the line of a key, or of its table."""
        line = line_of(self._text, key, table, index) if key else None
        if line is None and table:  # in a list, or missing
            line = line_of(self._text, table, index=index)
        return SceneError(self._path, f"line {line}: {fact}" if line else fact)

    def check_defaults(self, defaults: Mapping[str, Any]) -> None:
        """Refuse a default that no command takes."""
        every = {name for command in COMMANDS for name in named_actions(command_parser(command))}
        for key in defaults:
            if flag_name(key) not in every - OF_THE_BATCH:
                cure = hint_for(flag_name(key), every) or "; `brushgs help COMMAND` lists options"
                raise self.error(f"[defaults] {key} is no option{cure}", key, "defaults")

    def jobs_of(
        self, index: int, table: Mapping[str, Any], defaults: Mapping[str, Any], first: int
    ) -> Iterator[Job]:
        """The jobs of one table [[job]]."""
        options = {flag_name(key): value for key, value in table.items() if key not in ("command", "each")}
        command = table.get("command", DEFAULT_COMMAND)
        if command not in COMMANDS or command in NOT_IN_BATCH or "output" not in _known(command):
            others = [name for name in COMMANDS if name not in NOT_IN_BATCH and "output" in _known(name)]
            fact = f"command must be one of {', '.join(others)}, got {command!r:.60}"
            raise self.error(f"job {first}: {fact}{hint_for(str(command), others)}", "command", "job", index)
        known = _known(command)
        below = {flag_name(key): value for key, value in defaults.items() if flag_name(key) in known}
        for number, (item, names) in enumerate(self._items(index, table.get("each", {}), first), start=first):
            values = _over(_over(below, options), item)
            try:
                yield self._job(number, index, command, values, names)
            except OptionError as error:
                raise self.error(f"job {number}: {error}", error.name, "job", index) from None

    def _job(
        self, number: int, index: int, command: str, options: dict[str, Any], names: Mapping[str, str]
    ) -> Job:
        for name in options:
            if name in OF_THE_BATCH:
                raise OptionError(name, "belongs to `brushgs batch`, for all jobs; remove it")
        parser = command_parser(command)
        if not isinstance(options.get("output"), str):
            raise OptionError(
                "output", 'is missing; name what the job writes, such as output = "{scene}-{look}.png"'
            )
        words = {name: _name_of(parser, name, value) for name, value in options.items() if name != "output"}
        options["output"] = _filled(options["output"], {"number": str(number), **words, **names})
        line = line_of(self._text, "job", index=index)
        where = f"{self._path}: job {number}" if line is None else f"{self._path}: line {line}: job {number}"
        return Job(
            number, where, command, tuple(option_words(parser, options)), options["output"], self._folder
        )

    def _items(self, index: int, each: Any, first: int) -> Iterator[tuple[dict[str, Any], dict[str, str]]]:
        """All combinations of list items: their options, and their names for output patterns."""
        if not isinstance(each, dict) or not all(isinstance(v, list) and v for v in each.values()):
            fact = "each must hold lists, such as look = ['oil', 'ink']"
            raise self.error(f"job {first}: {fact}", "job.each")
        for chosen in itertools.product(*(enumerate(items, start=1) for items in each.values())):
            options: dict[str, Any] = {}
            names: dict[str, str] = {}
            for axis, (place, item) in zip(each, chosen, strict=True):
                if isinstance(item, dict):
                    names[axis] = str(item.get("name", place))
                    options |= {flag_name(key): value for key, value in item.items() if key != "name"}
                else:
                    options[flag_name(axis)] = item
            yield options, names


def _known(command: str) -> dict[str, Any]:
    return named_actions(command_parser(command))


def _over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Merge options; those of `above` win, also over rival options of `below`."""
    gone = beaten({name: [str(value)] for name, value in above.items()}, below)
    return {name: value for name, value in below.items() if name not in gone} | dict(above)


def _name_of(parser: ArgumentParser, name: str, value: Any) -> str:
    """Name of a value in output patterns: "garden" for garden.ply, "16x9" for [16, 9]."""
    words = option_words(parser, {name: value})
    action = action_named(parser, name)
    if action.dest == "scene" and words:
        return SceneSource.of(words).name
    text = ",".join(words).removeprefix(f"--{flag_name(name)}=")
    row = row_of_action(action)
    if (row is not None and row.names_files) or name in NAMED_FILES:
        text = ",".join(Path(part).stem for part in text.split(","))
    return re.sub(r"[^\w.+-]+", "_", text).strip("_")


def _filled(pattern: str, words: Mapping[str, str]) -> str:
    """An output name with {scene} and the like filled in."""
    known = {flag_name(name): word for name, word in words.items()} | dict(words)
    made = ""
    try:
        parts = list(string.Formatter().parse(pattern))
    except ValueError as error:
        raise OptionError("output", f"{pattern!r:.80}: {error}; write {{{{ for a brace") from None
    for literal, field, _, _ in parts:
        made += literal
        if field is not None:
            if field not in known and flag_name(field) not in known:
                cure = hint_for(field, known) or f"; it has {', '.join(sorted(known))}"
                raise OptionError("output", f"has {{{field}}}, which this job has not{cure}")
            made += known.get(field) or known[flag_name(field)]
    return made
