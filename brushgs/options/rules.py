"""Rules: options for parts of a scene, in a small TOML file written by the user.

A file has one table per part, in order; a Gaussian belongs to the first part that contains it. Fields missing
from a table, and Gaussians in no part, follow the rest of the painting. Paths are relative to the rules file
or the current folder.

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

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from msgspec.structs import replace

from brushgs.errors import SceneError
from brushgs.options.direction import Direction
from brushgs.options.hand import MAX_HOLD, MAX_REDRAW, Pace
from brushgs.options.look_parts import MAX_BRUSHES
from brushgs.options.maps import PROPERTIES
from brushgs.options.renamed import FLAGS
from brushgs.options.styling import AdjustConfig, StyleConfig
from brushgs.options.table import NestedError, Options, hint_for, in_files, option, read_table, rows_of, shown
from brushgs.options.toml_values import located, read_text, read_toml
from brushgs.options.where import CLIP_VARIABLE, MAX_SOFT, Where, WhereConfig, clip_folder
from brushgs.options.where_terms import Mask

MAX_RULES = 32
MAX_BYTES = 65536  # size of a file
TABLE = "region"
KEYS = (TABLE, "camera_file", "text_model")  # keys at the top level
ADVICE = 'rules are tables [[region]] with where = "subject" and what is to be there'


def _adjust(given: Any) -> AdjustConfig:
    """A table of the fields of `AdjustConfig`."""
    if not isinstance(given, dict):
        raise ValueError(f"must be a table such as {{saturation = 0.6}}, got {shown(given)}")
    try:
        return AdjustConfig(**read_table(given, {row.field: row for row in rows_of(AdjustConfig)}))
    except ValueError as error:
        raise NestedError(str(error)) from None


class Rule(Options, frozen=True):
    """Options of one part of a scene; the defaults change nothing.

    Brushes are names of built-in strokes, or image files. Empty brushes, and None for other fields, take the
    value of the painting. The palette, a picture, overrides that of the painting. At a soft edge, strokes of
    both sides mix.
    """

    # fmt: off
    where: Annotated[Where, in_files("the part", read=Where.parse)]
    name: Annotated[str, in_files("name of the part, for messages")] = ""
    brushes: Annotated[tuple[str, ...], in_files("brushes of the part")] = ()
    size: Annotated[float, in_files("factor on the size of strokes", ge=PROPERTIES["size"].least,
        le=PROPERTIES["size"].most)] = 1.0
    share: Annotated[float, in_files("factor on the number of strokes per area",
        ge=PROPERTIES["density"].least, le=PROPERTIES["density"].most)] = 1.0
    palette: Annotated[Path | None, in_files("picture that gives the colors", read=Path)] = None
    palette_strength: Annotated[float, in_files("strength of the palette", ge=0, le=1)] = 1.0
    style: Annotated[StyleConfig | None, in_files("style that gives the colors",
        read=StyleConfig.parse)] = None
    adjust: Annotated[AdjustConfig | None, in_files("color adjustments", make=_adjust)] = None
    direction: Annotated[Direction | None, in_files("direction of strokes", read=Direction.of)] = None
    opacity: Annotated[float, in_files("factor on the opacity of strokes", ge=0, le=1)] = 1.0
    soft: Annotated[float, in_files("width of its edge, of the subject's size", ge=0, le=MAX_SOFT)] = 0.0
    hold: Annotated[int | None, in_files("of a film: frames for which its drawings are held", ge=1,
        le=MAX_HOLD)] = None
    boil: Annotated[float | None, in_files("of a film: by how much it is drawn anew", ge=0, le=1)] = None
    redraw: Annotated[float | None, in_files("of a film: share of it laid anew in a second", ge=0,
        le=MAX_REDRAW)] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(name.strip() for name in self.brushes):
            raise ValueError("brushes must be names of strokes or image files, got an empty one; remove it")
        if len(self.brushes) > MAX_BRUSHES:
            raise ValueError(f"brushes must be at most {MAX_BRUSHES}, got {len(self.brushes)}")
        if self.palette is None and self.palette_strength != 1:
            raise ValueError("palette_strength needs palette, the picture whose colors are taken; add it")

    def pace(self, of_film: Pace) -> Pace:
        """The pace of the part: its own values, else those of the film."""
        given = {name: getattr(self, name) for name in ("hold", "boil", "redraw")}
        return replace(of_film, **{name: value for name, value in given.items() if value is not None})

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths that the rule names, including names of built-in strokes, which are not files."""
        palette = () if self.palette is None else (self.palette,)
        style = () if self.style is None else self.style.files
        direction = () if self.direction is None or self.direction.file is None else (self.direction.file,)
        return (*self.where.files, *map(Path, self.brushes), *palette, *style, *direction)


ROWS = {row.field: row for row in rows_of(Rule)}


class Rules(Options, frozen=True):
    """The rules of a painting; the first rule whose part contains a Gaussian applies to it.

    Terms `text:` use the CLIP model in the folder `text_model`, or that of the environment.

    Raises:
        ValueError: if there are no rules or too many, a mask lacks its cameras, or words lack a model.
    """

    GROUP: ClassVar = "parts"
    ABOUT: ClassVar = "other options for parts of the scene"
    rules: tuple[Rule, ...]
    # fmt: off
    file: Annotated[Path | None, option(
        'TOML file of tables [[region]], each with where = "subject" (any EXPR of `brushgs refine '
        "--where`) and any of brushes, size, share, palette, palette_strength, style, adjust, "
        "direction, opacity, soft, hold, boil, redraw #region #part #different", flag="--rules")] = None
    # fmt: on
    camera_file: Path | None = None
    clip: Path | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
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
                    f'model of yours; write text_model = "folder" above the tables, or set {CLIP_VARIABLE}'
                )

    @classmethod
    def of(cls, file: Path) -> Self:
        """Read a file of rules.

        Raises:
            SceneError: if it cannot be read, or a table, field or value is invalid.
        """
        if not file.is_file():
            what = "is a folder" if file.is_dir() else "there is no such file"
            raise SceneError(file, f"{what}; name a TOML file of rules")
        content = read_toml(read_text(file, "a file of rules", MAX_BYTES), file, ADVICE)
        content = {FLAGS.get(key, key).replace("-", "_"): value for key, value in content.items()}
        for key in content:
            if key not in KEYS:
                cure = f"; write it below [[{TABLE}]]" if key in ROWS else hint_for(key, KEYS)
                raise SceneError(file, f"has no {key!r} above its tables, only {', '.join(KEYS)}{cure}")
        tables = content.get(TABLE)
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise SceneError(file, f"must have tables [[{TABLE}]], got {shown(tables)}; {ADVICE}")
        if len(tables) > MAX_RULES:
            raise SceneError(file, f"must have at most {MAX_RULES} tables [[{TABLE}]], got {len(tables)}")
        beside = [_named(file, content, key) for key in ("camera_file", "text_model")]
        rules = tuple(_rule(file, number, table) for number, table in enumerate(tables, 1))
        try:
            return cls(rules, file, *beside)
        except ValueError as error:
            raise SceneError(file, str(error)) from None

    def where(self, rule: Rule) -> WhereConfig:
        """The part of a rule, with its edge, cameras and text model."""
        return WhereConfig(rule.where, rule.soft, self.camera_file, self.clip)

    def label(self, number: int) -> str:
        """Name of rule `number`, from 1, in reports."""
        return self.rules[number - 1].name or f"region {number}"

    def place(self, number: int) -> str:
        """Position of rule `number`, from 1, in the file."""
        return _place(number, self.rules[number - 1].name)

    @property
    def files(self) -> tuple[Path, ...]:
        """Input files that outputs must not replace, including names of built-in strokes."""
        own = [path for path in (self.file, self.camera_file) if path is not None]
        return (*own, *(path for rule in self.rules for path in rule.files))

    @property
    def needs_first_view(self) -> bool:
        """Whether any part depends on the first view of the scene."""
        return any(self.where(rule).needs_first_view for rule in self.rules)


def _named(file: Path, content: Mapping[str, Any], key: str) -> Path | None:
    """The path of a top-level key; None if it is missing."""
    name = content.get(key)
    if name is None:
        return None
    if not isinstance(name, str) or not name:
        raise SceneError(file, f"{key} must be text in quotes, got {shown(name)}")
    return _beside(name, file.parent)


def _rule(file: Path, number: int, table: Mapping[str, Any]) -> Rule:
    """The rule of one table.

    Raises:
        SceneError: if a field or value is invalid; names the table by number and name.
    """
    place = _place(number, table.get("name"))
    try:
        if "where" not in table:
            known = [name for name in table if name not in ROWS]
            if not known:
                raise ValueError('must say where, such as where = "subject"')
        for name in ("palette", "style", "direction", "where"):
            if table.get(name) == "":
                raise ValueError(f"{name} must not be empty; remove it")
        values = read_table(table, ROWS)
        return Rule(**{name: _beside_rules(value, file.parent) for name, value in values.items()})
    except ValueError as error:
        raise SceneError(file, f"{place} {error}") from None


def _place(number: int, name: object) -> str:
    return f"[[{TABLE}]] {number}" + (f" ({name[:40]})" if isinstance(name, str) and name else "")


def _beside_rules(value: Any, folder: Path) -> Any:
    """The value, with its paths resolved relative to the rules file if they exist there."""
    if isinstance(value, tuple):
        return tuple(located(value, folder))
    if isinstance(value, StyleConfig):
        return StyleConfig(tuple(replace(one, file=_beside(one.file, folder)) for one in value.styles))
    if isinstance(value, Direction) and value.file is not None:
        return replace(value, file=_beside(value.file, folder))
    if isinstance(value, Where):
        return _where_beside(value, folder)
    return _beside(value, folder) if isinstance(value, Path) else value


def _beside(path: Path | str, folder: Path) -> Path:
    """The path relative to `folder` if it exists there, else as given."""
    there = folder / path
    return there if "\0" not in str(path) and len(str(path)) < 1000 and there.exists() else Path(path)


def _where_beside(where: Where, folder: Path) -> Where:
    if isinstance(where.term, Mask):
        return replace(where, term=replace(where.term, path=_beside(where.term.path, folder)))
    return replace(where, parts=tuple(_where_beside(part, folder) for part in where.parts))
