"""Levels of brushes on disk: they depend on no scene, and making them takes a tenth of a painting."""

from contextlib import suppress
from math import inf
from typing import TYPE_CHECKING

from brushgs.brushes.texture import LONG_SIDE, StrokeTexture
from brushgs.pipeline.kept import Store, Unnamed, digest, program

if TYPE_CHECKING:
    from brushgs.rendering.texture_levels import Levels


class KeptLevels:
    """Finds the levels of brushes in a store, and keeps those made since.

    Brushes in colors, and those larger than usual, whose levels fill a store, are left out.
    """

    def __init__(self, store: Store) -> None:
        """Nothing is read or written yet."""
        self._store = store
        self._seen: dict[str, tuple[StrokeTexture, tuple[int, int]]] = {}

    def find(self, texture: StrokeTexture) -> "Levels":
        """The kept levels of a texture."""
        from brushgs.rendering.texture_levels import of_arrays

        if texture.kind != "image" or texture.tint is not None or texture.coverage.size > LONG_SIDE**2:
            return {}
        levels: Levels = {}
        with suppress(Unnamed):
            name = digest(program(), "levels", texture.coverage, texture.height)
            with suppress(KeyError):
                levels = of_arrays(self._store.load(name))
            self._seen[name] = texture, _amount(levels)
        return levels

    def close(self) -> None:
        """Keep the levels of textures that have more now."""
        from brushgs.rendering.texture_levels import as_arrays, known_levels

        for name, (texture, before) in self._seen.items():
            levels = known_levels(texture)
            if _amount(levels) != before:
                self._store.save(name, as_arrays(levels), seconds=inf)
        self._seen.clear()


def _amount(levels: "Levels") -> tuple[int, int]:
    """The number of levels, and of those with heights."""
    return len(levels), sum(one.pairs_with_height is not None for one in levels.values())
