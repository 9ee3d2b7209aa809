"""The steps of a painting, as functions whose parameters name their inputs; see `brushgs.pipeline.runner`."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

from brushgs.options.painting import STEPS
from brushgs.pipeline.runner import Steps
from brushgs.pipeline.steps import changing, laying, making, opening, seeing

CONFIGS = tuple(f"{step}_config" for step in STEPS)
SERVICES = ("report", "memory", "workers", "check_path")


def _steps_of(module: ModuleType) -> list[Callable[..., Any]]:
    """The public functions of a module."""
    found = (one for name, one in vars(module).items() if callable(one) and not name.startswith("_"))
    return [one for one in found if one.__module__ == module.__name__]


PAINTING = Steps(
    [step for module in (opening, seeing, changing, making, laying) for step in _steps_of(module)],
    inputs=(*CONFIGS, "config", "source", "views", "where", "on_background", *SERVICES),
    services=SERVICES,
)
