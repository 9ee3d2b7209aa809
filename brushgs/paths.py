"""Camera paths: around a scene, through key views, or as a file says. A path is a list of cameras."""

from dataclasses import dataclass

from brushgs.config import PathConfig, ViewConfig
from brushgs.scene import Camera, Gaussians


@dataclass(frozen=True)
class CameraPath:
    """The views of a sequence, all of one size.

    Attributes:
        cameras: one per frame, at least one. A loop does not repeat its first view at the end.
        is_loop: whether the view after the last is the first again.
        fps: frames a second, > 0.
        source: in words, where the path is from, for the report.
    """

    cameras: list[Camera]
    is_loop: bool
    fps: float
    source: str

    @property
    def closed(self) -> list[Camera]:
        """The cameras for whoever follows strokes along them: a loop ends with its first view again."""
        return [*self.cameras, self.cameras[0]] if self.is_loop else self.cameras


def plan_path(
    gaussians: Gaussians, view: ViewConfig, path: PathConfig, *, file_up: str | None = None
) -> CameraPath:
    """The path that is asked for.

    Args:
        gaussians: the scene as loaded; says where the subject is.
        view: of an orbit, how the scene is framed, and the size of the pictures. Of a path from a file
            only `size` is used; where it is None pictures have the size of the file's first camera.
        path: see `PathConfig`.
        file_up: the up axis that the header of the scene file states, if it does.

    Raises:
        ValueError: if `view` names a camera file: a path says by itself where the cameras are.
        SceneError: if the file cannot be read, or holds fewer than two views to go between.
    """
    raise NotImplementedError
