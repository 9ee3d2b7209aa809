"""Apply a learned edit to strokes: a map of their colors, and of their sizes.

    color after = affine(color) + sum over bumps of bump(features) x (weights + slopes @ color)

Far from the colors of all centers the bumps fall to 0 and the affine map remains. Other features are clamped
to the range of the centers. So a stroke unlike everything the edit was learned from is not changed wildly.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.color.color_map import Affine, Blend, ColorMap, map_colors
from brushgs.passes.color.color_space import Space
from brushgs.passes.style.features import COLOR_FEATURES, StrokeFeatures, color_features
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0
from brushgs.values.style import Residual, StyleEdit

ROWS_AT_A_TIME = 1 << 12  # limits the memory for bumps
LARGEST = np.log(8.0)  # of a change of size: no style makes strokes fill the picture, or vanish


def edit_map(edit: StyleEdit) -> ColorMap:
    """The color map of an edit.

    Colors that belong to no stroke have no other features: for them the residual applies only if it depends
    on color alone.
    """
    base = Affine(edit.affine[:, :3], edit.affine[:, 3])
    if edit.residual is None or not (edit.residual.weights[:, :3].any() or _has_slopes(edit.residual)):
        return base
    return _EditMap(base, edit.residual)


def needed_features(edits: Iterable[StyleEdit]) -> tuple[str, ...]:
    """Names of the stroke features, besides color, that edits depend on; each once."""
    names = [name for edit in edits if edit.residual is not None for name in edit.residual.features]
    return tuple(dict.fromkeys(name for name in names if name not in COLOR_FEATURES))


def apply_edit(
    strokes: Gaussians, edit: StyleEdit, features: StrokeFeatures | None, share: float = 1.0
) -> Gaussians:
    """Strokes in the colors and sizes of an edit.

    Args:
        strokes: N strokes.
        edit: the change.
        features: of the strokes, see `needed_features`; None if only color counts.
        share: 0 (the input itself) to 1; colors and logarithms of sizes are linear in it.
    """
    if share == 0 or len(strokes) == 0:
        return strokes
    colored = map_colors(strokes, Blend([(edit_map(edit), share)]), features)
    return resized(colored, share * log_sizes(edit, strokes, features))


def log_sizes(edit: StyleEdit, strokes: Gaussians, features: StrokeFeatures | None) -> F64:
    """[N] what an edit adds to the logarithms of stroke sizes; arguments as for `apply_edit`."""
    steps = np.full(len(strokes), edit.log_size)
    residual = edit.residual
    if residual is not None and residual.weights.shape[1] > 3 and _is_known(residual, features):
        rgb = 0.5 + C0 * strokes.sh[:, 0].astype(np.float64)
        for first in range(0, len(steps), ROWS_AT_A_TIME):
            some = slice(first, first + ROWS_AT_A_TIME)
            place = _standardised(residual, rgb[some], None if features is None else features.take(some))
            steps[some] += bumps(residual.centers, residual.width, place) @ residual.weights[:, 3]
    return np.asarray(np.clip(steps, -LARGEST, LARGEST))


def resized(strokes: Gaussians, steps: F64) -> Gaussians:
    """Strokes with sizes multiplied by exp(steps [N]); the input itself if all are 0."""
    if not steps.any():
        return strokes
    return replace(strokes, scales=(strokes.scales * np.exp(steps)[:, None]).astype(strokes.scales.dtype))


def bumps(centers: Array, width: float, place: F64) -> F64:
    """[M, K] bumps around centers [K, F] at places [M, F]: 1 at the center, exp(-1/2) one width away."""
    squares = (place**2).sum(axis=1)[:, None] + (centers.astype(np.float64) ** 2).sum(axis=1)
    squares -= 2 * place @ centers.T.astype(np.float64)
    return np.asarray(np.exp(-0.5 / width**2 * np.maximum(squares, 0)))


def within(names: tuple[str, ...], centers: Array, place: F64) -> F64:
    """Places [M, F] clamped to the range of the centers [K, F], except in features of color.

    A stroke higher than all that were seen counts as the highest; an unseen color is not replaced by a seen
    one.
    """
    low, high = centers.min(axis=0).astype(np.float64), centers.max(axis=0).astype(np.float64)
    is_color = np.array([name in COLOR_FEATURES for name in names])
    return np.clip(place, np.where(is_color, -np.inf, low), np.where(is_color, np.inf, high))


@dataclass(frozen=True, eq=False)
class _EditMap:
    """An affine map with bumps, a `ColorMap`."""

    base: Affine
    residual: Residual

    def colors(self, rgb: F64, features: StrokeFeatures | None = None) -> F64:
        after = self.base.colors(rgb)
        if not _is_known(self.residual, features):
            return after
        added = np.empty_like(after)
        for first in range(0, len(rgb), ROWS_AT_A_TIME):
            some = slice(first, first + ROWS_AT_A_TIME)
            added[some] = self._added(rgb[some], None if features is None else features.take(some))
        return after + added

    def slopes(self, rgb: F64, after: F64, features: StrokeFeatures | None = None) -> F64:
        slopes = np.array(self.base.slopes(rgb, after))
        if not _is_known(self.residual, features):
            return slopes
        for first in range(0, len(rgb), ROWS_AT_A_TIME):
            some = slice(first, first + ROWS_AT_A_TIME)
            slopes[some] += self._added_slopes(rgb[some], None if features is None else features.take(some))
        return slopes

    def _added(self, rgb: F64, features: StrokeFeatures | None) -> F64:
        """[M, 3] what the bumps add to the colors."""
        residual = self.residual
        heights = bumps(residual.centers, residual.width, _standardised(residual, rgb, features))
        return _weighted(heights @ _columns(residual), rgb)

    def _added_slopes(self, rgb: F64, features: StrokeFeatures | None) -> F64:
        """[M, 3, 3] derivative of `_added` by the colors: of the products, and of the bumps."""
        residual = self.residual
        place = _standardised(residual, rgb, features)
        heights = bumps(residual.centers, residual.width, place)
        columns = _columns(residual)
        own = heights @ columns
        slopes = own.reshape(-1, 3, 4)[:, :, :3].copy()
        of_color = [
            (row, COLOR_FEATURES.index(n)) for row, n in enumerate(residual.features) if n in COLOR_FEATURES
        ]
        lab_slopes = Space("lab").slopes_to(rgb) if of_color else None
        for row, channel in of_color:
            # d bump / d place = bump x (center - place) / width^2, and the addition is linear in bumps.
            centers = residual.centers[:, row].astype(np.float64)
            toward = (heights * centers) @ columns - place[:, row, None] * own
            along = _weighted(toward, rgb) / (residual.width**2 * float(residual.scale[row]))
            assert lab_slopes is not None
            slopes += along[:, :, None] * lab_slopes[:, channel, None, :]
        return slopes


def _has_slopes(residual: Residual) -> bool:
    return residual.slopes is not None and bool(residual.slopes.any())


def _columns(residual: Residual) -> F64:
    """[K, 12] the affine maps [3, 4] of the bumps, flattened."""
    maps = np.zeros((len(residual.centers), 3, 4))
    if residual.slopes is not None:
        maps[:, :, :3] = residual.slopes
    maps[:, :, 3] = residual.weights[:, :3]
    return maps.reshape(len(maps), 12)


def _weighted(maps: F64, rgb: F64) -> F64:
    """[M, 3] colors mapped by flattened affine maps [M, 12]."""
    matrices = maps.reshape(-1, 3, 4)
    return np.asarray((matrices[:, :, :3] @ rgb[:, :, None])[..., 0] + matrices[:, :, 3])


def _is_known(residual: Residual, features: StrokeFeatures | None) -> bool:
    """Whether all features that the bumps depend on are given."""
    return features is not None or set(residual.features) <= set(COLOR_FEATURES)


def _standardised(residual: Residual, rgb: F64, features: StrokeFeatures | None) -> F64:
    """[M, F] features in standard deviations; color features are computed from the colors."""
    lab = color_features(rgb)
    place = np.empty((len(rgb), len(residual.features)))
    for column, name in enumerate(residual.features):
        if name in COLOR_FEATURES:
            place[:, column] = lab[:, COLOR_FEATURES.index(name)]
        else:
            assert features is not None, "see _is_known"
            place[:, column] = features.columns((name,))[:, 0]
    return within(residual.features, residual.centers, (place - residual.offset) / residual.scale)
