"""What reading a scene found beside the Gaussians themselves."""

from dataclasses import dataclass

from brushgs.io.scenes.scene_file import Training


@dataclass(frozen=True)
class LoadNotes:
    """What a scene file held, and what was dropped from it without changing the picture.

    Attributes:
        format: layout and encoding in words, for example "PLY, binary little-endian".
        rows_read: Gaussians in the file.
        rows_dropped: those dropped because they cannot be drawn (a SceneWarning said why).
        sh_degree_stored: degree of the spherical harmonics in the file, 0 to 3.
        sh_degree_used: degree that was loaded; lower than stored where the bands above are all zero.
        up: axis that the file names as up, "+x" to "-z"; None if it names none.
        is_strokes: whether the file states that its Gaussians are strokes that brushgs made.
        training: how the scene was trained, as far as the file states it.
        unknown: columns or extensions of the file that were not read, by name.
    """

    format: str
    rows_read: int
    rows_dropped: int
    sh_degree_stored: int
    sh_degree_used: int
    up: str | None
    is_strokes: bool = False
    training: Training = "default"
    unknown: tuple[str, ...] = ()
