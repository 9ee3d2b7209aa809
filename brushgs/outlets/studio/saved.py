"""The options of the studio as a file for `--config`, written anew at each change."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from brushgs.formats.files import replacing

Named = Sequence[tuple[str, str | None]]


@dataclass(frozen=True)
class SavedOptions:
    """A file of options.

    Attributes:
        path: of the file; an earlier one is replaced.
        named: names and values of all options, None for a switch, from overrides and words of the page.
    """

    path: Path
    named: Callable[[Mapping[str, Any], Sequence[str]], Named]

    def keep(self, key: str, name: str, source: Path) -> str:
        """Copy a dropped picture beside the file, once.

        Args:
            key: of the picture, for the name of the copy.
            name: that the page gave; only a plain suffix of it is used.
            source: the stored picture.

        Returns:
            The name of the copy.

        Raises:
            SceneError: if it cannot be written.
        """
        suffix = PurePath(name).suffix.lower()
        suffix = suffix if re.fullmatch("[.][a-z]{3,4}", suffix) else ".png"
        copy = self.path.with_name(f"{self.path.stem}-{key}{suffix}")
        if not copy.exists():
            with replacing(copy) as path:
                path.write_bytes(source.read_bytes())
        return copy.name

    def write(self, overrides: Mapping[str, Any], flags: Sequence[str]) -> None:
        """Write the options; the file is always whole.

        Args:
            overrides: values of the page by step and field, which replace those of the command line.
            flags: the same as words of a command line.

        Raises:
            SceneError: if it cannot be written.
        """
        values: dict[str, list[str | None]] = {}
        for name, value in self.named(overrides, flags):
            values.setdefault(name, []).append(value)
        lines = [f"{name} = {_text(given)}\n" for name, given in values.items()]
        with replacing(self.path) as path:
            path.write_text("".join(lines), encoding="utf-8")


def _text(values: Sequence[str | None]) -> str:
    """One value, or the list of those of a repeated flag, in TOML, whose text is quoted as in JSON."""
    given: Any = [True if value is None else value for value in values]
    text = json.dumps(given[0] if len(given) == 1 else given, ensure_ascii=False)
    return text.replace("\x7f", "\\u007F")  # which JSON leaves as it is, and TOML does not
