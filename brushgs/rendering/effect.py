"""Effects: functions applied to the picture of a coat before it is laid, for media that run or are rubbed.

Strokes then only place the medium. An effect depends only on the picture of its coat in one view and on
constants of the job, so a frame rendered alone equals that of a film.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.surface import Surface


Color = tuple[float, float, float]


class Effect(Protocol):
    """A function of the picture of a coat. Implementations can be pickled, as films use several processes."""

    @property
    def traits(self) -> str:
        """What it adds to a picture, a few words in the plural, for messages of outlets without effects."""
        ...

    def __call__(
        self, painted: Frame, camera: Camera, surface: "Surface | None", part: Part | None = None
    ) -> Frame:
        """The picture to lay.

        Args:
            painted: the strokes of the coat, with depth; its arrays must not be changed.
            camera: the view.
            surface: the paper; None for none.
            part: the part of the view that `painted` and `surface` cover, in whole tiles; None for all, and
                always None if `reach` is None.

        Returns:
            New arrays of the same shape and dtype: covering paint, or the tint of a glaze, see `Coat.blend`.
        """
        ...

    def reach(self, camera: Camera) -> int | None:
        """Radius of the input pixels that an output pixel depends on; None for the whole picture."""
        ...

    def areas(self, picture: Array) -> "Sequence[tuple[Array, Color]] | None":
        """Areas of uniform color in its picture [H, W, 3], for vector drawings.

        Returns:
            Shares [H, W] and RGB of each, the first painted first; None if the picture has no such areas.
        """
        ...

    def stand_in(self, coat: "Coat") -> "Coat":
        """A substitute coat for outlets that draw single strokes, without effects: pages and models."""
        ...


class OfWhole:
    """An effect that needs the whole picture of its coat."""

    def reach(self, camera: Camera) -> None:
        """See `Effect`."""


def without_effect(coat: "Coat") -> "Coat":
    """The coat itself, or its substitute without effect."""
    return coat if coat.effect is None else coat.effect.stand_in(coat)


def positions_of(depth: Array, camera: Camera, corner: tuple[int, int] = (0, 0)) -> F32:
    """[H, W, 3] world positions of the pixels of a view, from their camera z [H, W].

    `corner` is the column and row of the upper left pixel. Where nothing is painted (depth 0), the point is
    the center of the camera.
    """
    across, down, ahead, eye = _rays(depth, camera, corner)
    rays = (across[None] + down[:, None] + ahead).astype(np.float32)
    return np.asarray(rays * depth[..., None].astype(np.float32) + eye.astype(np.float32))


def heights_of(depth: Array, camera: Camera, plane: Sequence[float], corner: tuple[int, int] = (0, 0)) -> F64:
    """[H, W] products of these positions (x, y, z, 1) with a plane of four numbers."""
    across, down, ahead, eye = _rays(depth, camera, corner)
    normal = np.asarray(plane[:3])
    rays = (across @ normal)[None] + (down @ normal + ahead @ normal)[:, None]
    return np.asarray(rays * depth + (eye @ normal + plane[3]))


def _rays(depth: Array, camera: Camera, corner: tuple[int, int]) -> tuple[F64, F64, F64, F64]:
    """[W, 3], [H, 3] and [3], whose sum is the ray of a pixel per camera z, and the eye [3]; world axes."""
    height, width = depth.shape
    inverse = np.linalg.inv(camera.K)
    to_world = np.asarray(np.linalg.inv(camera.viewmat), np.float64)
    columns = np.arange(corner[0], corner[0] + width) + 0.5
    rows = np.arange(corner[1], corner[1] + height) + 0.5
    across, down, ahead = (np.asarray(to_world[:3, :3] @ inverse[:, k]) for k in range(3))
    return across[None] * columns[:, None], down[None] * rows[:, None], ahead, to_world[:3, 3]
