"""Effects: what becomes of the picture of a coat before it is laid, in media that run, rub or gather.

Strokes then say where the medium goes, and the paper does the rest. An effect depends only on the picture of
its coat in one view and on constants of the job, so any frame alone equals that of a film.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from brushgs.values.arrays import F32, Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.surface import Surface


Color = tuple[float, float, float]


class Effect(Protocol):
    """A function of the picture of a coat. Implementations can be pickled: films are painted by processes."""

    @property
    def traits(self) -> str:
        """What it gives a picture, a few words in the plural: outlets without effects name what they lack."""
        ...

    def __call__(
        self, painted: Frame, camera: Camera, surface: "Surface | None", part: Part | None = None
    ) -> Frame:
        """The picture to lay.

        Args:
            painted: the strokes of the coat as they are, with depth; its arrays must not be changed.
            camera: the view.
            surface: the paper; None for none.
            part: the part of the view that `painted` and `surface` hold, on tiles; None for all, as always
                without a `reach`.

        Returns:
            New arrays of the same shape and dtype: covering paint, or the tint of a glaze, see `Coat.blend`.
        """
        ...

    def reach(self, camera: Camera) -> int | None:
        """How far from a pixel its picture depends on what is painted, pixels; None: on all of it."""
        ...

    def areas(self, picture: Array) -> "Sequence[tuple[Array, Color]] | None":
        """Areas of one colour each in its picture [H, W, 3], for vector drawings.

        Returns:
            Shares [H, W] and RGB of each, the first painted first; None if it is not made of such.
        """
        ...

    def stand_in(self, coat: "Coat") -> "Coat":
        """The coat for outlets that lay strokes one by one and know no effects: pages and models."""
        ...


class OfWhole:
    """An effect that needs the whole picture of its coat."""

    def reach(self, camera: Camera) -> None:
        """See `Effect`."""


def without_effect(coat: "Coat") -> "Coat":
    """The coat itself, or what stands in for it where there are no effects."""
    return coat if coat.effect is None else coat.effect.stand_in(coat)


def positions_of(depth: Array, camera: Camera, corner: tuple[int, int] = (0, 0)) -> F32:
    """[H, W, 3] points in world axes that the pixels of a view show, by their camera z, [H, W].

    `corner` is the column and row of the upper left pixel. Where nothing is painted (depth 0), the point is
    the centre of the camera.
    """
    height, width = depth.shape
    inverse = np.linalg.inv(camera.K)
    to_world = np.linalg.inv(camera.viewmat)
    columns = np.arange(corner[0], corner[0] + width) + 0.5
    rows = np.arange(corner[1], corner[1] + height) + 0.5
    across = (to_world[:3, :3] @ inverse[:, 0])[None, :] * columns[:, None]
    down = (to_world[:3, :3] @ inverse[:, 1])[None, :] * rows[:, None]
    rays = (across[None] + down[:, None] + to_world[:3, :3] @ inverse[:, 2]).astype(np.float32)
    return np.asarray(rays * depth[..., None].astype(np.float32) + to_world[:3, 3].astype(np.float32))
