"""What every camera format gives: the views of a file, and what a camera path states beside them."""

from dataclasses import dataclass, field

from brushgs.scene import Camera


@dataclass(frozen=True)
class CameraFile:
    """What a camera file holds.

    Attributes:
        cameras: its views, >= 1, in the order of the file; those of a COLMAP model by the name of the image.
        keys: the key views that a camera path was made of; may be empty.
        fps: frames a second, if the file states it.
        is_loop: whether the file states that the first frame follows the last.
        names: of the pictures that the cameras took, as the file has them, one a camera; empty, also as a
            single name, where it has none.
    """

    cameras: list[Camera]
    keys: list[Camera] = field(default_factory=list)
    fps: float | None = None
    is_loop: bool = False
    names: tuple[str, ...] = ()
