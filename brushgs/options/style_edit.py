"""What the style of an edit is learnt from: a scene before and after it, or pictures of one."""

from dataclasses import dataclass
from pathlib import Path

from brushgs.options.painting import Up


@dataclass(frozen=True)
class EditSource:
    """What an edit is learnt from.

    Attributes:
        before: a scene, or with `camera_file` pictures of one: a folder, or a single one.
        after: the same after the edit.
        scene: that pictures show; None where `before` and `after` are scenes.
        camera_file: of the pictures.
        up: of the scene before, an axis or a direction; None for as its file says, or an estimate.

    Raises:
        ValueError: if only one of `scene` and `camera_file` is given.
    """

    before: Path
    after: Path
    scene: Path | None = None
    camera_file: Path | None = None
    up: Up | None = None

    def __post_init__(self) -> None:
        if (self.scene is None) != (self.camera_file is None):
            lost, given = ("scene", "camera-file") if self.scene is None else ("camera-file", "scene")
            raise ValueError(
                f"--{given} needs --{lost}: to learn from pictures both are given, to learn from scenes none"
            )

    @property
    def inputs(self) -> tuple[Path, ...]:
        """All files."""
        files = (self.before, self.after, self.scene, self.camera_file)
        return tuple(file for file in files if file is not None)
