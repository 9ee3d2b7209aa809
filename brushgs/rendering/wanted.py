"""What is wanted of a picture beside its colours: layers for compositing, or every stroke in every pixel."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from brushgs.options.choices import LAYERS

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.project import Directions
    from brushgs.values.camera import Camera

OF_STROKES = frozenset({"normal", "motion", "stroke", "uv", "id"})  # layers that need every stroke of a pixel


@dataclass(frozen=True, eq=False)
class Following:
    """The painting as it is one frame later, to which the layer "motion" points.

    Attributes:
        coats: the same, whose strokes may have moved; coats and strokes are found by name and row.
        camera: of that frame.
        directions: of the strokes of each coat there, see `Painting.frame`.
        sign: 1; or -1 where it is the frame before, from which paint goes on as it came: the last of a path.
    """

    coats: "tuple[Coat, ...]"
    camera: "Camera"
    directions: "Sequence[Directions | None]" = ()
    sign: float = 1.0


@dataclass(frozen=True, eq=False)
class Wanted:
    """What a frame is to hold beside its colours.

    Attributes:
        layers: names of `LAYERS`.
        deep: whether every stroke in every pixel is wanted.
        following: the next frame; without it there is no layer "motion".

    Raises:
        ValueError: if there is no such layer.
    """

    layers: tuple[str, ...] = ()
    deep: bool = False
    following: Following | None = None

    def __post_init__(self) -> None:
        if unknown := [name for name in self.layers if name not in LAYERS]:
            raise ValueError(f"layers must be names out of {', '.join(LAYERS)}, got {unknown[0]!r}")

    @property
    def is_any(self) -> bool:
        """Whether anything is wanted."""
        return bool(self.layers) or self.deep

    @property
    def needs_strokes(self) -> bool:
        """Whether it takes every stroke of every pixel."""
        return self.deep or not OF_STROKES.isdisjoint(self.layers)


NOTHING = Wanted()
