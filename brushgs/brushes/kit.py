"""Brush kits: brushes by kind of stroke (long, short, other, large) and of surface (smooth, rough).

A built-in name stands for all its variants ("flat" for flat, flat_2, flat_3 and flat_4), so that neighboring
strokes differ. A number selects one variant: "flat_2", and "flat_1" for flat itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet, check_count, paths_of
from brushgs.brushes.texture import LONG_SIDE, StrokeTexture, variants_of, without_number

# Built-in brushes for long and for short strokes; the others suit any.
LONG_BRUSHES = ("flat", "dry_brush", "charcoal", "ink", "palette_knife", "fan", "line")
SHORT_BRUSHES = ("dab", "splatter", "flower", "x", "swirl")

Names = tuple[str, ...]


@dataclass(frozen=True)
class BrushKit:
    """Brushes by kind of stroke, see `choose_brushes`.

    Attributes:
        long: names, or paths of images, for strokes with an aspect of at least 1.9.
        short: for strokes with an aspect of at most 1.35.
        other: for the rest.
        large: additional choice for strokes above 2.2 times the median size.
        styled: replace the others for a share of strokes, see `mix_brushes`.
        smooth: may replace the others on smooth and light surfaces.
        rough: may replace the others on rough surfaces.

    An empty `long` or `short` uses `other`, and an empty `other` uses `long`, else `short`.

    Raises:
        TypeError: if a group is not a tuple of texts.
        ValueError: if no group has a brush.
    """

    long: Names = ()
    short: Names = ()
    other: Names = ()
    large: Names = ()
    styled: Names = ()
    smooth: Names = ()  # last, so that rows of the others do not depend on them
    rough: Names = ()

    def __post_init__(self) -> None:
        for field in fields(self):
            names = getattr(self, field.name)
            if not isinstance(names, tuple) or not all(isinstance(name, str) and name for name in names):
                raise TypeError(f"BrushKit: {field.name} must be a tuple of names of brushes, got {names!r}")
        if not (self.long or self.short or self.other):
            raise ValueError("BrushKit: long, short or other must name a brush")

    @classmethod
    def of(cls, stroke: str | Path | Sequence[str | Path]) -> Self:
        """A kit from a name, a file, a folder or several, as for `BrushSet.open`.

        A single name is that image alone. Of several, built-in brushes go to the strokes that they suit, with
        their variants; others go to all strokes.

        Raises:
            SceneError: if a folder holds no image.
            ValueError: if there are none.
        """
        names = paths_of(stroke) if isinstance(stroke, str | Path) else stroke
        texts = tuple(str(name) for name in names)
        if len(texts) == 1:
            return cls(other=(f"{texts[0]}_1",) if len(variants_of(texts[0])) > 1 else texts)
        bases = {text: without_number("".join(variants_of(text)[:1])) for text in texts}
        long = tuple(text for text in texts if bases[text] not in SHORT_BRUSHES)
        short = tuple(text for text in texts if bases[text] not in LONG_BRUSHES)
        other = tuple(text for text in long if text in short)
        return cls(long=long or texts, short=short or texts, other=other or texts)

    @property
    def images(self) -> tuple[str, ...]:
        """Names and paths of all images, with variants, without duplicates: the rows of `open`."""
        names = (name for field in fields(self) for name in getattr(self, field.name))
        return tuple(dict.fromkeys(image for name in names for image in images_of(name)))

    def open(
        self,
        *,
        size: int = LONG_SIDE,
        known: Mapping[str, StrokeTexture] | None = None,
        colored: bool = False,
    ) -> BrushSet:
        """All brushes of the kit.

        Args:
            size: longest side kept of each image, texels.
            known: images that are open already, by their name or path.
            colored: whether images with color in them keep it, see `StrokeTexture.open`.

        Raises:
            SceneError: see `BrushSet.open`, as for ValueError.
        """
        opened = {} if known is None else dict(known)
        missing = [image for image in self.images if image not in opened]
        if missing:
            opened |= zip(missing, BrushSet.open(missing, size=size, colored=colored).textures, strict=True)
        return BrushSet(tuple(opened[image] for image in self.images))

    def rows(self) -> dict[str, NDArray[np.uint8]]:
        """Rows of the brush set for "long", "short" and "other" (not empty), and "large", "smooth" and
        "rough" (may be empty).

        Raises:
            ValueError: if there are too many images for a set.
        """
        row_of = {image: row for row, image in enumerate(self.images)}
        check_count(len(row_of))
        other = self.other or self.long or self.short
        groups = {
            "long": self.long or other,
            "short": self.short or other,
            "other": other,
            "large": self.large,
            "smooth": self.smooth,
            "rough": self.rough,
        }
        return {
            group: np.array(
                sorted({row_of[image] for name in names for image in images_of(name)}), dtype=np.uint8
            )
            for group, names in groups.items()
        }


def images_of(name: str) -> tuple[str, ...]:
    """The images of a kit name: the variants of a built-in brush, or the name itself."""
    return tuple(variants_of(name)) or (name,)
