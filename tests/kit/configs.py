"""Options of small paintings."""

from dataclasses import replace
from typing import Any

from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig


def changed(config: PaintConfig, **steps: Any) -> PaintConfig:
    """With some fields of its steps, each a dictionary, or with whole steps."""
    for name, values in steps.items():
        step = replace(getattr(config, name), **values) if isinstance(values, dict) else values
        config = replace(config, **{name: step})
    return config


def blind(look: str, count: int, size: tuple[int, int], /, **steps: Any) -> PaintConfig:
    """A look of so many strokes that do not see, which takes most of the time, and else as `changed`."""
    steps["strokes"] = {"see": "off"} | steps.get("strokes", {})
    steps["cluster"] = {"strokes": count}
    steps["view"] = {"size": size} | steps.get("view", {})
    return changed(Look.open(look).config, **steps)
