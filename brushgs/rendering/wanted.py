"""Requested outputs beside colors: layers for compositing, or deep samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from brushgs.options.choices import LAYERS

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.project import Directions
    from brushgs.values.camera import Camera

OF_STROKES = frozenset(
    {"normal", "motion", "stroke", "uv", "id"}
)  # layers that need all fragments of a pixel


@dataclass(frozen=True, eq=False)
class Following:
    """The next frame of a painting, for the layer "motion".

    Attributes:
        coats: the same coats, with strokes moved; matched by name and row.
        camera: of that frame.
        directions: of the strokes of each coat there, see `Painting.frame`.
        sign: 1; or -1 if it is the previous frame, whose motion the last frame of a path continues.
    """

    coats: "tuple[Coat, ...]"
    camera: "Camera"
    directions: "Sequence[Directions | None]" = ()
    sign: float = 1.0


@dataclass(frozen=True, eq=False)
class Wanted:
    """Requested outputs of a frame beside its colors.

    Attributes:
        layers: names of `LAYERS`.
        deep: whether deep samples are requested.
        following: the next frame, required for "motion".
        paths: whether the strokes are requested as paths.
        sheets: whether coats and light are requested as layers for painting programs.

    Raises:
        ValueError: if a layer is unknown.
    """

    layers: tuple[str, ...] = ()
    deep: bool = False
    following: Following | None = None
    paths: bool = False
    sheets: bool = False

    def __post_init__(self) -> None:
        if unknown := [name for name in self.layers if name not in LAYERS]:
            raise ValueError(f"layers must be names out of {', '.join(LAYERS)}, got {unknown[0]!r}")

    @property
    def is_any(self) -> bool:
        """Whether anything is requested."""
        return bool(self.layers) or self.deep or self.paths or self.sheets

    @property
    def needs_strokes(self) -> bool:
        """Whether all fragments of each pixel are needed."""
        return self.deep or self.paths or not OF_STROKES.isdisjoint(self.layers)


NOTHING = Wanted()
