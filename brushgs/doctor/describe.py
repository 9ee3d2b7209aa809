"""The contents of a scene in a few figures."""

import warnings
from math import atan2, degrees
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.cameras.first_view import sayable, up_text
from brushgs.cameras.framing import subject
from brushgs.doctor.estimates import estimate_up
from brushgs.doctor.in_words import in_words
from brushgs.doctor.scene_checks import position_digits
from brushgs.errors import SceneWarning
from brushgs.formats import read_scene
from brushgs.formats.cameras.photograph import COUNTS
from brushgs.formats.cameras.read import name_beside
from brushgs.formats.moving import open_moving
from brushgs.options.painting import ViewConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.where import WhereConfig
from brushgs.pipeline.cameras_beside import view_beside
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.notes import LoadNotes
from brushgs.values.sh import C0

if TYPE_CHECKING:
    from brushgs.values.notes import LoadNotes


DARK = 0.1  # display-encoded; below it a Gaussian is nearly black


def describe(path: SceneFiles, where: WhereConfig | None = None, *, words: bool = False) -> dict[str, Any]:
    """Figures of a scene, as printed by `brushgs info`.

    Args:
        path: the files of the scene.
        where: a part to describe too, see `describe_part`.
        words: whether to describe it in words, see `in_words`.

    Returns:
        Name -> number, text or list of numbers, ready for JSON. Percentiles are 1, 50 and 99; the size is the
        standard deviation along the longest axis, the aspect is the longest over the middle one, and digits
        are from `position_digits`. For a moving scene the figures describe one moment, with further entries:
        duration in seconds, number of stored moments ("any" for a formula), their rate if each is a file,
        whether rows correspond, and the share of Gaussians that do not move.

    Raises:
        SceneError: if a file cannot be used.
        ValueError: if a term of the part lacks its cameras or model.
    """
    source = SceneSource.of(path)
    gaussians, notes = read_scene(source)
    points, has_surroundings = subject(gaussians)
    longest, middle = np.sort(gaussians.scales, axis=1)[:, :0:-1].T
    aspects = longest / np.maximum(middle, np.finfo(longest.dtype).tiny)
    base = 0.5 + C0 * gaussians.sh[:, 0]
    return {
        "file": str(source),
        "bytes": _size_of(source),
        "format": notes.format,
        "gaussians": len(gaussians),
        "rows_dropped": notes.rows_dropped,
        "sh_degree": notes.sh_degree_stored,
        "sh_degree_used": notes.sh_degree_used,
        "training": notes.training,
        **({} if notes.photograph is None else {"photograph": _lens(notes.photograph)}),
        "not_read": ", ".join(notes.unknown) or "nothing",
        "up": notes.up or _up_of(gaussians, notes),
        "position_digits": round(position_digits(gaussians)[0], 1),
        "low": _floats(gaussians.means.min(axis=0)),
        "high": _floats(gaussians.means.max(axis=0)),
        "subject_low": _floats(points.min(axis=0)),
        "subject_high": _floats(points.max(axis=0)),
        "has_surroundings": has_surroundings,
        "size": _floats(np.percentile(longest, (1, 50, 99))),
        "aspect": _floats(np.percentile(aspects, (1, 50, 99))),
        "opacity": _floats(np.percentile(gaussians.opacities, (1, 50, 99))),
        "dark_share": float((base.max(axis=1) < DARK).mean()),
        **_motion_of(source),
        **({} if where is None else describe_part(gaussians, notes, where)),
        **({"words": in_words(gaussians, notes)} if words else {}),
    }


def _lens(camera: Camera) -> str:
    """The camera of a photograph in words."""
    angle = degrees(2 * atan2(0.5 * camera.height, camera.K[1, 1]))
    return f"{camera.width}x{camera.height}, {angle:.1f} degrees high (elements {', '.join(COUNTS)})"


def _up_of(gaussians: Gaussians, notes: LoadNotes) -> str:
    """Up axis of a scene whose header does not state it, with its source."""
    beside = view_beside(gaussians, ViewConfig(), notes, None)
    if beside is not None and beside.view is not None and beside.path is not None:
        return (
            f"not stated: {up_text(sayable(beside.view).up)} by {name_beside(beside.path)} beside the scene"
        )
    return f"not stated: {estimate_up(gaussians, None).what}"


def _motion_of(source: SceneSource) -> dict[str, Any]:
    """Figures of a moving scene; empty for a still one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)  # already issued for the moment read
        moving = open_moving(source)
    if moving is None:
        return {}
    resting = moving.resting
    notes = moving.notes
    assert notes is not None, "a moving scene of a file has notes"
    nominal = "nominal: the file does not say"
    if (rate := notes.moments_per_second) is not None:
        nominal = f"nominal: {rate:g} moments a second (--moments-per-second)"
    return {
        "duration": float(f"{moving.duration:.6g}"),
        "seconds_are": "those of the file" if notes.is_timed else nominal,
        "moments": "any" if moving.times is None else len(moving.times),
        **({} if rate is None else {"moments_per_second": rate}),
        "rows_correspond": moving.has_rows,
        "resting_share": "not known" if resting is None else float(resting.mean()),
    }


def _size_of(source: SceneSource) -> int:
    """Total bytes of the files; for a folder, of the files directly in it."""
    return sum(file.stat().st_size for file in source.files() if file.is_file())


def _floats(values: Any) -> list[float]:
    return [float(f"{value:.6g}") for value in values]


# Figures of a part of a scene.


DIGITS = 6


def describe_part(gaussians: Gaussians, notes: "LoadNotes", config: WhereConfig) -> dict[str, Any]:
    """Figures of a part of a scene, as added by `brushgs info --where`.

    Args:
        gaussians: the Gaussians of a file.
        notes: notes on the file.
        config: the part.

    Returns:
        Name -> number, text or list of numbers, ready for JSON: the number of Gaussians with a weight above 0
        in the part; the weighted share of Gaussians and of the sum of opacities; and the corners of the box
        around their centers, if there are any.

    Raises:
        ValueError: if a term lacks its cameras or model.
        SceneError: if a mask or the camera file cannot be used.
    """
    from brushgs.passes.where import memberships
    from brushgs.pipeline.report import Report
    from brushgs.pipeline.views import default_first_view
    from brushgs.pipeline.where import context_of

    first_view = default_first_view(gaussians, notes, Report()) if config.needs_first_view else None
    found = memberships(config.expression, gaussians, context_of(config, first_view))
    opacities = gaussians.opacities.astype(np.float64)
    inside = gaussians.means[found > 0]
    facts: dict[str, Any] = {
        "where": str(config),
        "where_gaussians": len(inside),
        "where_share": _rounded(found.mean()),
        "where_opacity": _rounded(opacities @ found / max(opacities.sum(), np.finfo(float).tiny)),
    }
    if len(inside):
        facts["where_low"] = [_rounded(value) for value in inside.min(axis=0)]
        facts["where_high"] = [_rounded(value) for value in inside.max(axis=0)]
    return facts


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
