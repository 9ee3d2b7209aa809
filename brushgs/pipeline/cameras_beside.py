"""The view from the cameras beside a scene file, and the note about them."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.cameras.framing import camera_axes, direction_of, unit_of
from brushgs.errors import SceneError
from brushgs.formats.cameras.read import find_beside, name_beside, read_beside, reason_of
from brushgs.options.painting import Up, ViewConfig
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.values.notes import LoadNotes

SWITCH = "--camera-file none"


@dataclass(frozen=True, eq=False)
class Beside:
    """Result of the search for cameras beside a scene.

    Attributes:
        note: which file was found, and what it gives, or why it gives nothing.
        view: the first view; None if no cameras fit the scene.
        path: file of the cameras that fit; or None.
    """

    note: str
    view: FirstView | None = None
    path: Path | None = None


def view_beside(
    gaussians: Gaussians, config: ViewConfig, notes: "LoadNotes | None", stated: Up | None
) -> Beside | None:
    """The first view by the first cameras beside a scene that fit it.

    Args:
        gaussians: N >= 1 Gaussians.
        config: no cameras are searched if it names a camera file, or states all that they could give.
        notes: of the files of the scene; Gaussians in memory have none, and strokes know their view.
        stated: the up axis stated by flags or header.

    Returns:
        None if there are no cameras, or none are searched.
    """
    given = _given(config, has_up=stated is not None)
    if notes is None or notes.is_strokes or config.camera_file is not None or not given:
        return None
    up = None
    if stated is not None:
        camera_axes(direction_of(stated), 0.0, 0.0)  # checks it
        up = unit_of(stated)
    azimuth = None if config.side is not None else config.azimuth
    misfit = ""
    for path in find_beside(notes.camera_folders):
        from brushgs.first_view.photographed import UnfitError, photographed_view

        try:
            cameras = read_beside(path)
            view = photographed_view(gaussians, cameras, up=up, azimuth=azimuth)
        except SceneError as error:
            misfit = misfit or f"{name_beside(path)} lies beside the scene, but {reason_of(error)}"
        except UnfitError as error:
            misfit = misfit or f"{name_beside(path)} lies beside the scene, but {error}"
        else:
            source = f"{name_beside(path)} beside the scene ({len(cameras):,} cameras)"
            return Beside(f"{given} from {source}; {SWITCH} switches it off", view, path)
    return Beside(f"{misfit}: it is not used, and {SWITCH} passes over it") if misfit else None


def _given(config: ViewConfig, *, has_up: bool) -> str:
    """What cameras add to options and header, in words; may be empty."""
    has_azimuth = config.azimuth is not None or config.side is not None
    has_elevation = config.elevation is not None or config.side == "top"
    return " and ".join(
        name
        for name, is_known in (("up", has_up), ("first view", has_azimuth and has_elevation))
        if not is_known
    )
