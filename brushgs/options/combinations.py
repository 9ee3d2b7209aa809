"""Rules about options that exclude or need each other, as given: one list for flags, files and Python.

Constraints between fields of one class, whatever their source, are checked by that class.
"""

from collections.abc import Iterable, Mapping
from typing import Any

from brushgs.options.painting import PaletteConfig, ViewConfig
from brushgs.options.table import Options, Struct, rows_of


class Rule(Struct, frozen=True):
    """A rule about options, each "STEP.FIELD", or "STEP.FIELD=VALUE" for one value.

    Attributes:
        others: options that exclude `one` or, with `is_needed`, need it.
        one: the option that they exclude or need.
        why: apposition to the flag of `one` in the message.
        is_needed: whether `one` is needed; else it is excluded.
        fine: value of `others` that is allowed with `one`.
    """

    others: tuple[str, ...]
    one: str
    why: str
    is_needed: bool = False
    fine: str | None = None


def excludes(one: str, others: Iterable[str], why: str, *, fine: str | None = None) -> Rule:
    """A rule: `others` exclude `one`, unless their value is `fine`."""
    return Rule(tuple(others), one, why, fine=fine)


def needs(others: Iterable[str], one: str, why: str) -> Rule:
    """A rule: `others` need `one`."""
    return Rule(tuple(others), one, why, is_needed=True)


def _of(step: str, kind: type[Options], *without: str) -> tuple[str, ...]:
    return tuple(f"{step}.{row.field}" for row in rows_of(kind) if row.flags and row.field not in without)


FRAMING = _of("view", ViewConfig, "size", "camera_file", "view")  # options that place the camera
_LENS = ("view.roll", "view.fov_y", "view.zoom")
_SPHERES = ("projection.projection=equirect", "projection.stereo=vr180")
RULES = (
    excludes("view.camera_file", FRAMING, "which places the camera"),
    needs(["view.view"], "view.camera_file", "which lists the views"),
    excludes("view.side", ["view.azimuth"], "which is an azimuth"),
    excludes("view.side=top", ["view.elevation"], "which is 90 degrees"),
    needs(_of("palette", PaletteConfig, "file"), "palette.file", "the picture whose colors are taken"),
    needs(["overpaint.continues"], "overpaint.files", "the paint that is continued"),
    excludes("draw.background", ["ground.ground"], "which takes its place", fine="none"),
    *(excludes(rig, _LENS, "which has no lens of its own") for rig in _SPHERES),
    *(
        excludes(rig, ["output.crop"], "which is put together from several views")
        for rig in (*_SPHERES, "projection.stereo=side", "projection.stereo=top")
    ),
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
    excludes("path.file", _of("view", ViewConfig, "size"), "which places the cameras"),
    excludes("path.orbit", ["view.camera_file"], "which places the cameras"),
    needs(["path.sway"], "path.orbit", "the number of frames"),
)
# Path options that films of moving scenes take without a path, and those that need --orbit or --path.
OF_FILMS = ("path.fps", "path.loop")
OF_PATHS = ("path.frames", "path.seconds", "path.loop", "path.sway")
# Flag names that replace each other: one given on the command line overrides the others of a file.
RIVALS = (
    {"strokes", "stroke-size"},
    {"azimuth", "from"},
    {"ground", "background"},
    {"frames", "seconds"},
    {"orbit", "path"},
    {"jobs", "scheduler"},
    {"quiet", "verbose"},
    {"lamp", "sun"},
)


def check_given(given: Mapping[str, Any], flag_of: Any, rules: Iterable[Rule] = RULES) -> None:
    """Check given options against the rules.

    Args:
        given: "STEP.FIELD" -> value of the given options.
        flag_of: returns the flag of a "STEP.FIELD", for messages.
        rules: to check.

    Raises:
        ValueError: if a rule is broken.
    """
    for rule in rules:
        one, _, value = rule.one.partition("=")
        is_given = one in given and (not value or given[one] == value)
        if is_given == rule.is_needed:
            continue
        for other in given:  # the message names the first one given
            if other in rule.others and (rule.fine is None or given[other] != rule.fine):
                verb = "needs" if rule.is_needed else "cannot be combined with"
                shown = f"{flag_of(one)}{f' {value}' if value else ''}"
                raise ValueError(f"{flag_of(other)} {verb} {shown}, {rule.why}")
