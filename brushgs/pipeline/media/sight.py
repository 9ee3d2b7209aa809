"""What drawing media look at that place marks in the views of a job: its cameras, and what is in focus."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.direction import Direction
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.add.tonal_view import TonalView
    from brushgs.rendering.plain import PlainViews

PIXELS = 480_000  # of the first view, in which marks are placed
MOST_PICTURES = 3  # in which tones are settled
KEYED = 0.5  # share of the greatest focus from which a stroke is wholly in it


@dataclass(frozen=True, eq=False)
class Sight:
    """The views of a job.

    Attributes:
        cameras: the first is the picture, the others are small; at least one.
        pictures: some small views of the picture or the path, in which tones are settled; at least one.
        points: [N, 3] of the scene; none if nothing is in focus.
        focus: [N] 0 to 1, how far each is in focus.
        has_planes: whether marks on flat surfaces share a direction: not where the user says how they run.
        is_film: whether marks have to hold in many frames, or in several views of a sphere.
    """

    cameras: tuple[Camera, ...]
    pictures: tuple[Camera, ...]
    points: Array
    focus: F64
    has_planes: bool
    is_film: bool = False

    @classmethod
    def of(
        cls,
        cameras: Sequence[Camera],
        plain_views: "PlainViews | None",
        scene: Gaussians,
        focus: F64 | None,
        direction: Direction,
        *,
        is_film: bool = False,
    ) -> "Sight":
        """The sight of a job, see `Materials`."""
        from brushgs.cameras.around import path_views
        from brushgs.passes.add.lines import in_pixels

        own = path_views(cameras)
        shown = in_pixels(cameras[0], PIXELS), *(own if plain_views is None else plain_views.cameras)
        pictures = tuple(own[:: -(-len(own) // MOST_PICTURES)])
        has_planes, is_film = direction.kind in ("form", "color"), is_film or len(cameras) > 1
        if focus is None:
            return cls(shown, pictures, np.zeros((0, 3)), np.zeros(0), has_planes, is_film)
        shares = np.log(np.maximum(focus, 1)) / max(float(np.log(max(focus.max(), 1))), 1e-9)
        return cls(shown, pictures, scene.means, np.clip(shares / KEYED, 0, 1), has_planes, is_film)

    def focus_of(self, strokes: Gaussians) -> F64:
        """[n] 0 to 1, how far each stroke is in focus."""
        if len(self.points) == 0 or len(strokes) == 0:
            return np.zeros(len(strokes))
        _, rows = nearest(self.points, strokes.means, 1)
        return np.asarray(self.focus[rows[:, 0]], np.float64)

    def views(self, strokes: Gaussians, tones: F64, num_threads: int | None) -> "list[TonalView]":
        """Maps of the strokes in the views that differ enough, the first of them the picture."""
        from brushgs.passes.add.lines import others_than_first
        from brushgs.passes.add.tonal_view import TonalView
        from brushgs.passes.form.plane_axes import mark_axes

        axes, normals = mark_axes(strokes, with_planes=self.has_planes)

        def seen(camera: Camera) -> TonalView:
            return TonalView.of(strokes, tones, axes, normals, camera, num_threads=num_threads)

        first = seen(self.cameras[0])
        depths = first.depth[np.isfinite(first.depth)]
        distance = float(np.median(depths)) if len(depths) else 0.0
        others = [row for row, is_alike in others_than_first(self.cameras, distance) if not is_alike]
        return [first, *(seen(self.cameras[row]) for row in others)]
