"""The knobs of a painting that the bench turns one by one: each a line, with the field that it fills.

A knob that has a range is turned to its ends, a switch on and off.
"""

from dataclasses import dataclass, replace
from typing import Any

from brushgs.options.painting import PaintConfig


@dataclass(frozen=True)
class Knob:
    """A choice of a look.

    Attributes:
        name: as the table shows it, and its flag mostly.
        step: of `PaintConfig` that has it.
        values: that it is turned to, besides what a painting has.
        field: of the step; "" for the name.
    """

    name: str
    step: str
    values: tuple[Any, ...] = (0.0, 1.0)
    field: str = ""

    def of(self, paint: PaintConfig) -> Any:
        """What a painting has."""
        return getattr(getattr(paint, self.step), self.field or self.name)

    def at(self, paint: PaintConfig, value: Any) -> PaintConfig:
        """The same painting with another value."""
        step = replace(getattr(paint, self.step), **{self.field or self.name: value})
        return replace(paint, **{self.step: step})

    def others(self, paint: PaintConfig) -> tuple[Any, ...]:
        """The values that a painting has not."""
        return tuple(value for value in self.values if value != self.of(paint))

    def label(self, value: Any) -> str:
        """The knob at a value, in words."""
        if isinstance(value, bool):
            return f"{self.name} {'on' if value else 'off'}"
        return f"{self.name} {value:g}" if isinstance(value, float) else f"{self.name} {value}"


KNOBS = (
    Knob("key", "light"),
    Knob("values", "color"),
    Knob("stage", "ground", (False, True)),
    Knob("edges", "strokes"),
    Knob("economy", "strokes"),
    Knob("relief", "light"),
    Knob("canvas", "light", ("none", "linen", "paper")),
    Knob("broken-color", "strokes", (0.0,), "broken_color"),
    Knob("underpaint", "draw", (False, True)),
)
