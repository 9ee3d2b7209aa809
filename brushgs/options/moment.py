"""Options that give a moment of a moving scene."""

import re
from typing import Any

from brushgs.options.table import Struct


class Moment(Struct, frozen=True):
    """A time of a moving scene.

    `amount` is in seconds, or with `is_share` a share of the duration. `is_all` means all moments at once:
    numbered files are parts of one still scene; only for scene sources.

    Raises:
        ValueError: if it is out of range.
    """

    amount: float
    is_share: bool = False
    is_all: bool = False

    def __post_init__(self) -> None:
        most = 1.0 if self.is_share else float("inf")
        if not 0 <= self.amount <= most or self.amount == float("inf"):
            rule = "0% to 100% of the clip" if self.is_share else "0 or more seconds"
            raise ValueError(f"time must be {rule}, got {self}")

    @classmethod
    def parse(cls, text: str) -> "Moment":
        """Parse "0.4", "0.4 s", "40%" or "all".

        Raises:
            ValueError: if it is invalid or out of range.
        """
        if text == "all":
            return cls(0.0, is_all=True)
        match = re.fullmatch(r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:e[+-]?[0-9]+)?) ?(s|%|)", text.lower())
        if match is None:
            raise ValueError(f"time must be seconds such as 0.4, a share such as 40%, or all, got {text!r}")
        amount = float(match[1])
        return cls(amount / 100, is_share=True) if match[2] == "%" else cls(amount)

    def seconds(self, duration: float) -> float:
        """The time in a scene of this duration."""
        return self.amount * duration if self.is_share else self.amount

    def __str__(self) -> str:
        if self.is_all:
            return "all"
        return f"{100 * self.amount:g}%" if self.is_share else f"{self.amount:g} s"

    @property
    def word(self) -> str:
        """As command-line text: "0.4", "40%" or "all"."""
        return str(self).removesuffix(" s")


def clip_time(text: str) -> Moment:
    """A moment of a clip, see `Moment.parse`."""
    found = Moment.parse(text)
    if found.is_all:
        raise ValueError("must be one moment, seconds such as 0.4 or a share such as 40%, got all")
    return found


def moment_value(given: Any) -> Moment:
    """A moment, from a moment or seconds."""
    return given if isinstance(given, Moment) else Moment.parse(str(given))
