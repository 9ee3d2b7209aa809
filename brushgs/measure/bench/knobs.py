"""The knobs of a painting that the bench changes one by one: a line each, with its field.

A knob with a range is set to its ends, a switch on and off.
"""

from dataclasses import dataclass, replace
from typing import Any

from brushgs.options.painting import PaintConfig


@dataclass(frozen=True)
class Knob:
    """A choice of a look.

    Attributes:
        name: in the table, mostly its flag.
        step: its step in `PaintConfig`.
        values: tried in addition to the painting's value.
        field: of the step; "" for the name.
    """

    name: str
    step: str
    values: tuple[Any, ...] = (0.0, 1.0)
    field: str = ""

    def of(self, paint: PaintConfig) -> Any:
        """The value in a painting."""
        return getattr(getattr(paint, self.step), self.field or self.name)

    def at(self, paint: PaintConfig, value: Any) -> PaintConfig:
        """The same painting with another value."""
        step = replace(getattr(paint, self.step), **{self.field or self.name: value})
        return replace(paint, **{self.step: step})

    def others(self, paint: PaintConfig) -> tuple[Any, ...]:
        """The values that differ from the painting's."""
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
