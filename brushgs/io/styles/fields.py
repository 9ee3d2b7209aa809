"""The fields of a JSON object in an untrusted file, taken one by one; each is checked, and none is left."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.json_file import shown
from brushgs.io.styles.format import MAX_NAME
from brushgs.values.arrays import F64
from brushgs.values.colors import rgb_of


class Fields:
    """The fields of an object; every method raises SceneError where a field is not as it says.

    Attributes:
        path: of the file.
        where: which object of the file, such as "of colour 3 of palette"; empty for the whole.
    """

    def __init__(self, path: Path, value: object, where: str = "") -> None:
        self.path, self.where = path, where
        if not isinstance(value, dict):
            what = f"what stands {where}" if where else "the file"
            raise SceneError(path, f"{what} must be a JSON object, {{...}}, got {shown(value)}; correct it")
        self._rest: dict[str, Any] = dict(value)

    def __contains__(self, name: str) -> bool:
        """Whether the field is there, and not null."""
        return self._rest.get(name) is not None

    def refuse(self, name: str, rule: str, value: object, cure: str = "correct it") -> NoReturn:
        """Raise the error of a field."""
        raise SceneError(self.path, f"{self._named(name)} must be {rule}, got {shown(value)}; {cure}")

    def take(self, name: str, rule: str) -> Any:
        """The value of a field that must be there."""
        if name not in self:
            raise SceneError(self.path, f"{self._named(name)} is missing; add it: {rule}")
        return self._rest.pop(name)

    def number(
        self, name: str, least: float, most: float, default: float | None = None, *, above: bool = False
    ) -> float:
        """A number of `least` (which is not one of them if `above`) to `most`."""
        rule = f"a number {'above ' if above else ''}{least:g} to {most:g}"
        if default is not None and name not in self:
            return default
        value = self.take(name, rule)
        if not isinstance(value, float) or not least <= value <= most or (above and value == least):
            self.refuse(name, rule, value)
        return value

    def text(self, name: str) -> str:
        """A short text without control characters."""
        rule = f"a text of 1 to {MAX_NAME} printable characters"
        value = self.take(name, rule)
        if not isinstance(value, str) or not is_name(value):
            self.refuse(name, rule, value)
        return value

    def color(self, name: str) -> F64:
        """[3] of "#rrggbb"."""
        rule = "a colour such as '#3a5f0b'"
        value = self.take(name, rule)
        if not isinstance(value, str) or not re.fullmatch(r"#[0-9a-fA-F]{6}", value):
            self.refuse(name, rule, value)
        return np.array(rgb_of(value))

    def entries(self, name: str, rule: str, least: int, most: int) -> list[Any]:
        """A list."""
        value = self.take(name, f"a list of {least} to {most} {rule}")
        if not isinstance(value, list):
            self.refuse(name, f"a list of {rule}", value)
        if not least <= len(value) <= most:
            raise SceneError(
                self.path,
                f"{self._named(name)} must hold {least} to {most} {rule}, got {len(value)}; correct it",
            )
        return value

    def inner(self, name: str) -> "Fields":
        """An object."""
        return Fields(self.path, self.take(name, "a JSON object"), self._within(name))

    def objects(self, name: str, rule: str, least: int, most: int) -> Iterator["Fields"]:
        """The objects of a list; `rule` names one."""
        for number, value in enumerate(self.entries(name, f"{rule}s", least, most)):
            yield Fields(self.path, value, f"of {rule} {number + 1} {self._within(name)}")

    def end(self) -> None:
        """Refuse fields that were not taken: misspelt, they would change nothing and say nothing."""
        for name, value in self._rest.items():
            if value is not None:
                raise SceneError(
                    self.path, f"{self._named(name[:MAX_NAME])} is no field of a style; remove or correct it"
                )

    def _named(self, name: str) -> str:
        return f"'{name}' {self.where}".rstrip()

    def _within(self, name: str) -> str:
        return f"of {name} {self.where}".rstrip()


def is_name(text: str) -> bool:
    """Whether a text may be the name of a style or a colour."""
    return 1 <= len(text) <= MAX_NAME and text.isprintable() and not text.isspace()
