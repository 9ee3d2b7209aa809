"""Which options exclude or need each other, as they were given: each rule said once, for flags, files and
Python.

What joins the fields of one class whatever gave them is checked by that class.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from brushgs.options.painting import PaletteConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.options.table import Options, Struct, rows_of


class Rule(Struct, frozen=True):
    """A rule about options, each as "STEP.FIELD", or "STEP.FIELD=VALUE" where only one value counts.

    Attributes:
        others: which cannot be given, or in `needed` must not be given alone.
        one: beside which they cannot be given, or without which.
        why: what it is, after its name.
        is_needed: whether `one` is needed, and not excluded.
        fine: value of the others that goes with it all the same.
    """

    others: tuple[str, ...]
    one: str
    why: str
    is_needed: bool = False
    fine: str | None = None


def excludes(one: str, others: Iterable[str], why: str, *, fine: str | None = None) -> Rule:
    """Others cannot be given beside one, unless their value is `fine`."""
    return Rule(tuple(others), one, why, fine=fine)


def needs(others: Iterable[str], one: str, why: str) -> Rule:
    """Others are given only with one."""
    return Rule(tuple(others), one, why, is_needed=True)


def _of(step: str, kind: type[Options], *without: str) -> tuple[str, ...]:
    return tuple(f"{step}.{row.field}" for row in rows_of(kind) if row.flags and row.field not in without)


FRAMING = _of("view", ViewConfig, "size", "camera_file", "view")  # what places the camera
RULES = (
    excludes("view.camera_file", FRAMING, "which places the camera"),
    needs(["view.view"], "view.camera_file", "which lists the views"),
    excludes("view.side", ["view.azimuth"], "which is an azimuth"),
    excludes("view.side=top", ["view.elevation"], "which is 90 degrees"),
    needs(_of("palette", PaletteConfig, "file"), "palette.file", "the picture whose colours are taken"),
    excludes("draw.background", ["ground.ground"], "which takes its place", fine="none"),
    *(
        needs(
            [f"{step}.soft", f"{step}.camera_file", f"{step}.clip"],
            f"{step}.expression",
            "the part of the scene that it is for",
        )
        for step in ("where", "painted")
    ),
)
PATH_RULES = (
    excludes("grow.seconds", _of("path", PathConfig, "fps"), "before which the camera stands still"),
    excludes("path.file", _of("view", ViewConfig, "size"), "which places the cameras"),
    excludes("path.orbit", ["view.camera_file"], "which places the cameras"),
)
# Of a film without a camera path, and of a painting that grows.
OF_FILMS = ("path.fps", "path.loop")
OF_PATHS = ("path.frames", "path.seconds", "path.loop")
# Flags of which one, higher up, takes the place of the others, by name.
RIVALS = (
    {"strokes", "stroke-size"},
    {"azimuth", "from"},
    {"ground", "background"},
    {"frames", "seconds"},
    {"orbit", "path", "grow"},
    {"jobs", "scheduler"},
    {"quiet", "verbose"},
    {"lamp", "sun"},
)


def check_given(given: Mapping[str, Any], flag_of: Any, rules: Iterable[Rule] = RULES) -> None:
    """Refuse options that cannot be given together, or not alone.

    Args:
        given: "STEP.FIELD" -> value, of those that were given.
        flag_of: gives the flag of a "STEP.FIELD", for the sentence.
        rules: that are asked.

    Raises:
        ValueError: if a rule is broken.
    """
    for rule in rules:
        one, _, value = rule.one.partition("=")
        is_given = one in given and (not value or given[one] == value)
        if is_given == rule.is_needed:
            continue
        for other in given:  # the one that was given first is named
            if other in rule.others and (rule.fine is None or given[other] != rule.fine):
                verb = "needs" if rule.is_needed else "cannot be combined with"
                shown = f"{flag_of(one)}{f' {value}' if value else ''}"
                raise ValueError(f"{flag_of(other)} {verb} {shown}, {rule.why}")
