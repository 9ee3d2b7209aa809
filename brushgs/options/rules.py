"""Rules: what is painted otherwise in parts of a scene, from a small TOML file that one writes.

A file has one table for each part, in order; a Gaussian belongs to the first part that it is in. What a table
does not name, and what is in no part, is as the rest of the painting. Files lie beside the rules, or are
named from the current folder.

    [[region]]
    name = "body"
    where = "subject and height:20%.."
    brushes = ["dab"]
    size = 0.7
    palette = "monet.jpg"

    [[region]]
    where = "surroundings"
    soft = 0.05
    adjust = {saturation = 0.4}
"""

import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Self

from brushgs.errors import SceneError
from brushgs.options.direction import Direction
from brushgs.options.look_parts import MAX_BRUSHES, Share, Within, _Part
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.toml_values import hint_for, located, parsed_text, read_text, read_toml, typed_value
from brushgs.options.where import CLIP_VARIABLE, MAX_SOFT, Where, WhereConfig, clip_folder
from brushgs.options.where_terms import Mask

MAX_RULES = 32
MAX_BYTES = 65536  # of a file
TABLE = "region"
KEYS = (TABLE, "camera_file", "clip")  # above and beside the tables
ADVICE = 'rules are tables [[region]] with where = "subject" and what is to be there'


@dataclass(frozen=True)
class Rule(_Part):
    """What is otherwise in one part of a scene; the defaults change nothing.

    Attributes:
        where: the part.
        name: of the part, for messages; "" for its number.
        brushes: names of built-in strokes, or image files; empty for those of the painting.
        size: factor on the size of strokes, 0.2 to 5.
        share: how many times as many strokes per area as elsewhere, 0.1 to 10.
        palette: a picture whose colours the part takes, in place of that of the painting.
        palette_strength: 0 to 1.
        style: whose colours it takes in place of those of the painting.
        adjust: changes of its colours; None for those of the painting.
        direction: which way strokes run.
        opacity: factor on the opacity of strokes, 0 to 1.
        soft: width of its edge as a share of the subject's size, 0 (hard) to 2: there strokes of both sides
            mingle.
    """

    where: Where
    name: str = ""
    brushes: tuple[str, ...] = ()
    size: Annotated[float, Within(0.2, 5)] = 1.0
    share: Annotated[float, Within(0.1, 10)] = 1.0
    palette: Path | None = None
    palette_strength: Share = 1.0
    style: StyleConfig | None = None
    adjust: AdjustConfig | None = None
    direction: Direction | None = None
    opacity: Share = 1.0
    soft: Annotated[float, Within(0, MAX_SOFT)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(name.strip() for name in self.brushes):
            raise ValueError("brushes must be names of strokes or image files, got an empty one; remove it")
        if len(self.brushes) > MAX_BRUSHES:
            raise ValueError(f"brushes must be at most {MAX_BRUSHES}, got {len(self.brushes)}")
        if self.palette is None and self.palette_strength != 1:
            raise ValueError("palette_strength needs palette, the picture whose colours are taken; add it")

    @property
    def files(self) -> tuple[Path, ...]:
        """All that it names; names of built-in strokes among them are no files."""
        palette = () if self.palette is None else (self.palette,)
        style = () if self.style is None else self.style.files
        direction = () if self.direction is None or self.direction.file is None else (self.direction.file,)
        return (*self.where.files, *map(Path, self.brushes), *palette, *style, *direction)


@dataclass(frozen=True)
class Rules:
    """The rules of a painting: the first rule whose part a Gaussian is in has it.

    Attributes:
        rules: 1 to 32.
        file: that holds them; None for rules made in code.
        camera_file: the cameras that painted masks were made with; None where there are none.
        clip: folder of the CLIP model that finds words; None for that of the environment.

    Raises:
        ValueError: if there are more, or none, a mask lacks its cameras, or words lack a model.
    """

    rules: tuple[Rule, ...]
    file: Path | None = None
    camera_file: Path | None = None
    clip: Path | None = None

    def __post_init__(self) -> None:
        if not 1 <= len(self.rules) <= MAX_RULES:
            raise ValueError(f"rules must be 1 to {MAX_RULES}, got {len(self.rules)}")
        for number, rule in enumerate(self.rules, 1):
            if rule.where.needs_cameras and self.camera_file is None:
                raise ValueError(
                    f"{_place(number, rule.name)} where has mask:{rule.where.masks[0]}, which needs the "
                    'cameras that it was painted from; write camera_file = "cameras.json" above the tables'
                )
            if rule.where.texts and clip_folder(self.clip) is None:
                raise ValueError(
                    f"{_place(number, rule.name)} where has text:{rule.where.texts[0]}, which needs a CLIP "
                    f'model that you bring; write clip = "folder" above the tables, or set {CLIP_VARIABLE}'
                )

    @classmethod
    def of(cls, file: Path) -> Self:
        """Read a file; as `PaintConfig.of` makes a step.

        Raises:
            SceneError: if it cannot be read, or holds a table, a field or a value that rules do not have.
        """
        if not file.is_file():
            what = "is a folder" if file.is_dir() else "there is no such file"
            raise SceneError(file, f"{what}; name a TOML file of rules")
        content = read_toml(read_text(file, "a file of rules", MAX_BYTES), file, ADVICE)
        for key in content:
            if key not in KEYS:
                known = {one.name for one in fields(Rule)}
                cure = f"; write it below [[{TABLE}]]" if key in known else hint_for(key, KEYS)
                raise SceneError(file, f"has no {key!r} above its tables, only {', '.join(KEYS)}{cure}")
        tables = content.get(TABLE)
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise SceneError(file, f"must have tables [[{TABLE}]], got {reprlib.repr(tables)}; {ADVICE}")
        if len(tables) > MAX_RULES:
            raise SceneError(file, f"must have at most {MAX_RULES} tables [[{TABLE}]], got {len(tables)}")
        beside = [_named(file, content, key) for key in ("camera_file", "clip")]
        rules = tuple(_rule(file, number, table) for number, table in enumerate(tables, 1))
        try:
            return cls(rules, file, *beside)
        except ValueError as error:
            raise SceneError(file, str(error)) from None

    def where(self, rule: Rule) -> WhereConfig:
        """The part of one of them."""
        return WhereConfig(rule.where, rule.soft, self.camera_file, self.clip)

    def label(self, number: int) -> str:
        """What the rule of a number, from 1, is called in reports."""
        return self.rules[number - 1].name or f"region {number}"

    def place(self, number: int) -> str:
        """Where the rule of a number, from 1, stands in the file."""
        return _place(number, self.rules[number - 1].name)

    @property
    def files(self) -> tuple[Path, ...]:
        """All that an output must not replace; names of built-in strokes among them are no files."""
        own = [path for path in (self.file, self.camera_file) if path is not None]
        return (*own, *(path for rule in self.rules for path in rule.files))

    @property
    def needs_first_view(self) -> bool:
        """Whether a part depends on the first view of the scene."""
        return any(self.where(rule).needs_first_view for rule in self.rules)


def _named(file: Path, content: Mapping[str, Any], key: str) -> Path | None:
    """The path that stands above the tables by the name of `key`; None if there is none."""
    name = content.get(key)
    if name is None:
        return None
    if not isinstance(name, str) or not name:
        raise SceneError(file, f"{key} must be text in quotes, got {reprlib.repr(name)}")
    return _beside(name, file.parent)


def _rule(file: Path, number: int, table: Mapping[str, Any]) -> Rule:
    """One table.

    Raises:
        SceneError: if it holds what no rule has; names the table by number and name.
    """
    place = _place(number, table.get("name"))
    known = {one.name: one for one in fields(Rule)}
    values: dict[str, Any] = {}
    for key, value in table.items():
        if key not in known:
            cure = hint_for(key, known) or f"; it has {', '.join(known)}"
            raise SceneError(file, f"{place} has no {key!r}{cure}")
        try:
            values[key] = typed_value(value, known[key].type, _special(key, file.parent))
        except ValueError as error:
            raise SceneError(file, f"{place} {key} {error}") from None
    if "where" not in values:
        raise SceneError(file, f'{place} must say where, such as where = "subject"')
    try:
        return Rule(**values)
    except ValueError as error:
        raise SceneError(file, f"{place} {error}") from None


def _place(number: int, name: object) -> str:
    return f"[[{TABLE}]] {number}" + (f" ({name[:40]})" if isinstance(name, str) and name else "")


def _special(key: str, folder: Path) -> Callable[[Any], Any] | None:
    """How a value is made that is not one of its class as TOML has it."""
    makers: dict[str, Callable[[Any], Any]] = {
        "where": partial(_made, Where.parse, _where_beside, folder),
        "palette": partial(_made, Path, _beside, folder),
        "style": partial(_made, StyleConfig.parse, _style_beside, folder),
        "direction": partial(_made, Direction.of, _direction_beside, folder),
        "brushes": partial(_brushes, folder),
        "adjust": _adjust,
    }
    return makers.get(key)


def _made(parse: Callable[[str], Any], place: Callable[[Any, Path], Any], folder: Path, value: Any) -> Any:
    """A value that is text of a form of its own, its files beside the rules."""
    if value == "":
        raise ValueError("must not be empty; remove it")
    return place(parsed_text(parse, value), folder)


def _brushes(folder: Path, value: Any) -> tuple[str, ...]:
    names: tuple[str, ...] = typed_value(value, tuple[str, ...], None)
    return tuple(located(names, folder))


def _adjust(value: Any) -> AdjustConfig:
    """A table of the fields of `AdjustConfig`."""
    if not isinstance(value, dict):
        raise ValueError(f"must be a table such as {{saturation = 0.6}}, got {reprlib.repr(value)}")
    known = {one.name: one for one in fields(AdjustConfig)}
    values = {}
    for key, item in value.items():
        if key not in known:
            cure = hint_for(key, known) or f"; it has {', '.join(known)}"
            raise ValueError(f"has no {key!r}{cure}")
        try:
            values[key] = typed_value(item, known[key].type, None)
        except ValueError as error:
            raise ValueError(f"{key} {error}") from None
    return AdjustConfig(**values)


def _beside(path: Path | str, folder: Path) -> Path:
    """A file or folder that lies beside the rules, or else is named from the current folder."""
    there = folder / path
    return there if "\0" not in str(path) and len(str(path)) < 1000 and there.exists() else Path(path)


def _style_beside(style: StyleConfig, folder: Path) -> StyleConfig:
    return StyleConfig(tuple(replace(one, file=_beside(one.file, folder)) for one in style.styles))


def _direction_beside(direction: Direction, folder: Path) -> Direction:
    return direction if direction.file is None else replace(direction, file=_beside(direction.file, folder))


def _where_beside(where: Where, folder: Path) -> Where:
    if isinstance(where.term, Mask):
        return replace(where, term=replace(where.term, path=_beside(where.term.path, folder)))
    return replace(where, parts=tuple(_where_beside(part, folder) for part in where.parts))
