"""How many strokes, and what share, in the words of the command line: one reading for flags and for Python.

Only the standard library is imported, and `dataclasses` only for a budget: `--help` needs neither.
"""

import re
from math import isfinite
from typing import TYPE_CHECKING, get_args

from brushgs.options.choices import Knee

if TYPE_CHECKING:
    from brushgs.options.painting import ErrorBudget

KNEES: dict[str, Knee] = {knee: knee for knee in get_args(Knee)}


def parse_strokes(text: str) -> "int | float | Knee | ErrorBudget | None":
    """A value of `ClusterConfig.strokes`: int for a count, float for a share, None for all.

    Args:
        text: a count such as "7000", a share such as "10%", "all", "auto" or "auto:frame", or a PSNR such as
            "24dB".

    Raises:
        ValueError: if it is none of these, or out of range.
    """
    if text == "all":
        return None
    if text in KNEES:
        return KNEES[text]
    if text.lower().endswith("db") and (decibels := _number(text[:-2])) is not None:
        from brushgs.options.painting import ErrorBudget

        return ErrorBudget(decibels)
    if text.endswith("%") and (percent := _number(text[:-1])) is not None:
        if not 0 < percent <= 100:
            raise ValueError(f"strokes must be above 0 % and at most 100 %, got {text!r}")
        return percent / 100
    if re.fullmatch(r"\+?[0-9]{1,18}", text) and int(text) >= 1:
        return int(text)
    raise ValueError(
        "strokes must be a count of 1 or more, a share such as 10%, all, auto, or a PSNR such as 24dB, "
        f"got {text!r}"
    )


def parse_share(text: str) -> float:
    """A share, as a number or in percent: "0.7" or "70%".

    Raises:
        ValueError: if it is neither, or above 100 %. No other range is checked.
    """
    share = _number(text[:-1]) if text.endswith("%") else _number(text)
    if share is None:
        raise ValueError(f"must be a number, got {text!r}")
    if not text.endswith("%"):
        return share
    if share > 100:
        raise ValueError(f"must be at most 100 %, got {text!r}")
    return share / 100


def _number(text: str) -> float | None:
    """A finite number; None for what is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) else None
