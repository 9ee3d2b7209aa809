"""Options of small paintings."""

from dataclasses import replace
from typing import Any

from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig

BLIND = {"see": "off"}


def changed(config: PaintConfig, **steps: Any) -> PaintConfig:
    """With some fields of its steps, each a dictionary, or with whole steps."""
    for name, values in steps.items():
        step = replace(getattr(config, name), **values) if isinstance(values, dict) else values
        config = replace(config, **{name: step})
    return config


def without_look(stroke: str, count: Any, size: Any, /, **steps: Any) -> PaintConfig:
    """No look, with so many strokes of this brush, and else as `changed`."""
    config = changed(PaintConfig(), draw={"stroke": stroke}, cluster={"strokes": count}, view={"size": size})
    return changed(config, **steps)


def blind(look: str, count: int, size: tuple[int, int], /, **steps: Any) -> PaintConfig:
    """A look of so many strokes that do not see, which takes most of the time, and else as `changed`."""
    config = changed(Look.open(look).config, strokes=BLIND, cluster={"strokes": count}, view={"size": size})
    return changed(config, **steps)
