"""A look: the options of a whole painting, in a small TOML file to copy and change.

A file has one table per step of `PaintConfig`, with the fields of its class; above them stand `title`,
`good_for` and `base`. Missing fields come from the look `base`, or else are plain. Angles are in degrees.
Paths are relative to the look file or the current folder.

    title = "Oil, at night"
    base = "oil"
    [color]
    contrast = 1.2
    [light]
    lamp = [160, 30]
"""

import os
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from msgspec.structs import replace

from brushgs.errors import SceneError, SceneWarning
from brushgs.options.choices import DEFAULT_LOOK, LOOKS, PLAIN_LOOK, Knee, StepValues
from brushgs.options.media import MEDIA, ROWS
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.stroke_target import UsualCount
from brushgs.options.styling import StyleShare
from brushgs.options.table import Row, Struct, hint_for, in_files, read_table, rows_of, shown
from brushgs.options.toml_values import located, read_text, read_toml

SUFFIX = ".toml"
MAX_BYTES = 16384  # size of a file; built-in looks have at most 2000 bytes. Dotted keys take quadratic time
MAX_BASES = 8  # length of a chain of looks, each based on the next
TEXTS = ("title", "good_for", "base")  # keys above the tables
NOT_OF_LOOKS = {"output", "painted", "palette", "rules", "view"}  # steps that belong to one picture
# Fields that belong to one machine, to the command line, and to one scene.
NOT_IN_LOOKS = {"draw": {"threads"}, "brushes": {"are_usual"}, "light": {"sun"}}


class Look(Struct, frozen=True):
    """A look, as read from its file.

    Attributes:
        name: name of a known look, else the file name without suffix.
        title: one line.
        good_for: one line, or "".
        values: step -> field -> value, including values of its base; plain values are missing.
        text: the text of the file.
    """

    name: str
    title: str
    good_for: str
    values: StepValues
    text: str

    def __repr__(self) -> str:
        return f"Look({self.name!r}, {self.title!r})"

    @classmethod
    def open(cls, name: str | Path) -> Self:
        """Read a look.

        Args:
            name: name of a built-in look (`LOOKS`) or of one added by another package, or a TOML file.

        Raises:
            SceneError: if there is no such look or file, the file cannot be read, or a table, field or value
                is invalid.

        Example:
            >>> bg.Look.open("charcoal")
            Look('charcoal', ...)
        """
        return cls._open(name, ())

    @property
    def config(self) -> PaintConfig:
        """The options of a painting in this look."""
        return PaintConfig.of(self.values)

    @classmethod
    def _open(cls, name: str | Path, based: tuple[Path, ...]) -> Self:
        path = _known(name)
        is_known = path is not None
        path = path or Path(name)
        text = _read(path)
        return cls._parse(text, path, str(name) if is_known else path.stem, based)

    @classmethod
    def _parse(cls, text: str, path: Path, name: str, based: tuple[Path, ...]) -> Self:
        content = read_toml(text, path, "see `brushgs looks oil`")
        tables = {key: value for key, value in content.items() if isinstance(value, dict)}
        texts = {key: value for key, value in content.items() if key not in tables}
        for key in texts:
            if key not in TEXTS:
                raise SceneError(path, _unknown_text(key))
            if not isinstance(texts[key], str):
                raise SceneError(path, f"{key} must be text in quotes, got {shown(texts[key])}")
        values = _base_values(path, texts.get("base"), (*based, path.resolve()))
        for step, table in tables.items():
            values[step] = values.get(step, {}) | _step_values(path, step, table)
            if "backdrop" in table and "stage" not in table:  # a backdrop alone means loose strokes
                values[step]["stage"] = False
            try:
                PaintConfig.of({step: values[step]})
            except ValueError as error:
                raise SceneError(path, f"[{step}] {error}") from None
        return cls(name, texts.get("title", name), texts.get("good_for", ""), values, text)


def config_of(look: PaintConfig | Look | str | Path | None) -> PaintConfig:
    """The options of a look, given as object, name or file; None for the default look.

    Raises:
        SceneError: see `Look.open`.
    """
    if isinstance(look, PaintConfig):
        return look
    return (look if isinstance(look, Look) else Look.open(look or DEFAULT_LOOK)).config


def looks_folder() -> Path:
    """The folder of the built-in looks."""
    return Path(__file__).resolve().parent.parent / "looks"


@cache
def added_looks() -> Mapping[str, Path]:
    """The looks that other packages add by entry points of the group `brushgs.looks`: name -> TOML file.

    A SceneWarning names an entry point whose look cannot be used.
    """
    from importlib.metadata import entry_points  # takes as long as printing the help: imported only if needed

    found: dict[str, Path] = {}
    for point in sorted(entry_points(group="brushgs.looks"), key=lambda point: point.name):
        try:
            found[point.name] = Path(point.load())
        except Exception as error:
            message = f"entry point {point.name!r} of brushgs.looks cannot be used ({error})"
            warnings.warn(SceneWarning(f"{message}; update its package"), stacklevel=2)
    return found


def _known(name: str | Path) -> Path | None:
    """The file of a built-in or added look; None for other names and for existing files."""
    if name in LOOKS:
        return looks_folder() / f"{name}{SUFFIX}"
    is_file = Path(name).suffix or os.path.lexists(name)  # check files first: no entry points are needed
    return None if is_file else added_looks().get(str(name))


def _read(path: Path) -> str:
    if path.is_dir():
        raise SceneError(path, f"is a folder, not a look; name a {SUFFIX} file in it")
    if not path.is_file():
        known = (*LOOKS, *added_looks())
        hint = hint_for(str(path), known)
        raise SceneError(path, f"neither a file nor a look, which are {', '.join(known)}{hint}")
    return read_text(path, "a look", MAX_BYTES)


def _base_values(path: Path, base: str | None, based: tuple[Path, ...]) -> dict[str, dict[str, Any]]:
    """The values of the look's base."""
    if base is None or base == PLAIN_LOOK:
        return {}
    is_known = base in LOOKS or (not (path.parent / base).is_file() and _known(base) is not None)
    beside: str | Path = base if is_known else path.parent / base
    if not is_known and Path(beside).resolve() in based:
        raise SceneError(path, f"base must not be {base!r}, which starts from this file")
    if len(based) > MAX_BASES:
        raise SceneError(path, f"base must not have more than {MAX_BASES} others before it")
    try:
        look = Look._open(beside, based)
    except SceneError as error:
        if Path(beside).is_file() or is_known:
            raise
        raise SceneError(path, f"base {str(error).removeprefix(f'{path.parent}/')}") from None
    return {step: dict(fields) for step, fields in look.values.items()}


def _strokes(given: Any) -> UsualCount | float | str | None:
    """Convert a number of strokes in a look; explicit options override it."""
    if given in (*get_args(Knee), "all"):
        return None if given == "all" else str(given)
    if isinstance(given, int) and not isinstance(given, bool) and 1 <= given < 2**63:
        return UsualCount(given)
    if isinstance(given, float) and 0 < given <= 1:
        return given
    raise ValueError(
        f"must be a count of 1 or more, a share such as 0.1, 'auto' or 'all', got {shown(given)}"
    )


@cache
def _rows() -> Mapping[str, Mapping[str, Row]]:
    """The fields of looks: step -> field -> row of the option table."""
    rows = {
        step: {row.field: row for row in rows_of(kind) if row.field not in NOT_IN_LOOKS.get(step, ())}
        for step, kind in STEPS.items()
        if step not in NOT_OF_LOOKS
    }
    strokes = Annotated[Any, in_files(read=_strokes, make=_strokes)]
    rows["cluster"]["strokes"] = Row("strokes", strokes)
    rows["media"] = {"kind": Row("kind", Literal[tuple(MEDIA)]), **ROWS}
    return rows


def _unknown_text(key: str) -> str:
    for step, known in sorted(_rows().items()):
        if key in known:
            return f"{key!r} stands above all tables; write it below [{step}]"
    return f"there is no {key!r} above the tables, only {', '.join(TEXTS)}{hint_for(key, TEXTS)}"


def _step_values(path: Path, step: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """The values of one table, converted to the types of their fields."""
    if step in NOT_OF_LOOKS:
        raise SceneError(path, f"[{step}] belongs to one picture, not to a look; give it with flags")
    rows = _rows()
    if step not in rows:
        hint = hint_for(step, rows)
        raise SceneError(path, f"a look has no [{step}]; its tables are {', '.join(rows)}{hint}")
    try:
        values = read_table(table, rows[step], f"[{step}] ")
    except ValueError as error:
        raise SceneError(path, str(error)) from None
    return {name: _located(value, path.parent) for name, value in values.items()}


def _located(value: Any, folder: Path) -> Any:
    """The value, with file names resolved to `folder` if they exist there."""
    if isinstance(value, tuple) and value and isinstance(value[0], StyleShare):
        return tuple(replace(one, file=Path(located(str(one.file), folder))) for one in value)
    return located(value, folder)
