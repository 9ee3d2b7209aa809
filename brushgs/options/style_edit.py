"""Sources of an edit style: a scene before and after the edit, or pictures of a scene before and after."""

from pathlib import Path

from brushgs.options.painting import Up
from brushgs.options.table import Options


class EditSource(Options, frozen=True):
    """Sources of an edit style.

    `before` and `after` are scenes or, with `camera_file`, pictures of a `scene`: a folder each, or single
    pictures. Without `before`, `after` are paint-overs of pictures of the scene. `up` is the up axis or
    direction of the scene before the edit; None takes it from its file, or estimates it.

    Raises:
        ValueError: if only one of `scene` and `camera_file` is given, or neither of these nor `before`.
    """

    before: Path | None
    after: Path
    scene: Path | None = None
    camera_file: Path | None = None
    up: Up | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.scene is None) != (self.camera_file is None):
            lost, given = ("scene", "camera-file") if self.scene is None else ("camera-file", "scene")
            raise ValueError(
                f"--{given} needs --{lost}: to learn from pictures both are given, to learn from scenes none"
            )
        if self.before is None and self.scene is None:
            raise ValueError(
                "style learn needs --before too, the scene before the edit; or --scene and --camera-file, "
                "where --after is a picture of the scene that was painted over"
            )

    @property
    def inputs(self) -> tuple[Path, ...]:
        """All input files."""
        files = (self.before, self.after, self.scene, self.camera_file)
        return tuple(file for file in files if file is not None)
