"""levels.py against its definition: a box sampled 8 x 8 times a pixel, in plain NumPy."""

import numpy as np
import pytest

from brushgs.brushes.levels import FIRST_FOOTPRINT, axis_levels, level_coverage, level_index
from brushgs.core.native import core as _core
from tests.kit.for_each import for_each


def bristles():
    """Coverage with hard streaks along u and paint up to the edges."""
    rng = np.random.default_rng(0)
    streaks = rng.random((64, 1)) + 0.35 * rng.random((64, 32)).repeat(8, axis=1)
    return np.where(streaks > 0.5, 255, 40).astype(np.uint8)


def sample(texels, half_extents, angle, center, size, samples):
    """[size, size] mean coverage over `samples` x `samples` points a pixel; 0 outside of the box."""
    points = (np.arange(size * samples) + 0.5) / samples - size / 2
    x, y = np.meshgrid(points - center[0], points - center[1])
    u = (np.cos(angle) * x + np.sin(angle) * y) / half_extents[0]
    v = (np.cos(angle) * y - np.sin(angle) * x) / half_extents[1]
    inside = (np.abs(u) < 1) & (np.abs(v) < 1)
    (i, fv), (j, fu) = map(_texel_and_fraction, (v, u), texels.shape)
    top = texels[i, j] * (1 - fu) + texels[i, j + 1] * fu
    bottom = texels[i + 1, j] * (1 - fu) + texels[i + 1, j + 1] * fu
    value = inside * (top * (1 - fv) + bottom * fv) / 255
    return value.reshape(size, samples, size, samples).mean(axis=(1, 3))


def _texel_and_fraction(t, count):
    position = np.clip((1 + t) / 2 * (count - 1), 0, count - 1)
    texel = np.minimum(position.astype(int), count - 2)
    return texel, position - texel


def sample_level(texels, half_extents, angle, center, size):
    """One sample a pixel of the level that serves this box, in the way the module's docstring says."""
    height, width = texels.shape
    u, v = axis_levels(width), axis_levels(height)
    k_u, k_v = level_index(half_extents[0], width), level_index(half_extents[1], height)
    box = half_extents * (u[k_u].scale, v[k_v].scale)
    return sample(level_coverage(texels, k_u, k_v), box, angle, center, size, 1)


def errors_against_64_samples(texels, shortest, longest):
    """RMSE of bilinear and of the levels, over boxes of random size, place and angle."""
    rng = np.random.default_rng(7)
    squares = np.zeros(2)
    for _ in range(10):
        half_u = 0.5 * np.exp(rng.uniform(np.log(shortest), np.log(longest)))
        half_extents = half_u * np.array([1.0, np.exp(rng.uniform(np.log(0.25), 0))])
        view = half_extents, rng.uniform(-np.pi, np.pi), rng.uniform(-0.5, 0.5, 2), int(3 * half_u) + 5
        truth = sample(texels, *view, 8)
        found = sample(texels, *view, 1), sample_level(texels, *view)
        squares += [((one - truth) ** 2).sum() for one in found]
    return np.sqrt(squares)


@for_each(("shortest", "longest"), [(1, 3), (3, 10), (10, 30), (30, 90)])
@for_each("is_solid", [True, False])
def test_levels_leave_a_quarter_of_the_error_of_bilinear(shortest, longest, is_solid):
    # measured: 0.08-0.22
    texels = np.full((96, 256), 255, np.uint8) if is_solid else bristles()
    bilinear, levels = errors_against_64_samples(texels, shortest, longest)
    assert levels < 0.25 * bilinear, f"{levels / bilinear:.3f} of bilinear's error"


def test_a_magnified_stroke_uses_its_source_and_a_tiny_one_the_last_level():
    coverage = bristles()
    assert level_index(np.inf, 256) == 0
    assert level_index(255 / (2 * FIRST_FOOTPRINT * 0.999), 256) == 0
    assert level_index(255 / (2 * FIRST_FOOTPRINT * 1.001), 256) == 1
    assert level_coverage(coverage, 0, 0) is coverage
    assert axis_levels(256)[0].scale == 1
    assert level_index(1e-30, 8) == level_index(0.0, 8) == len(axis_levels(8)) - 1
    assert [level.num_texels for level in axis_levels(1)] == [1]
    with pytest.raises(ValueError, match="num_texels must be at least 1, got 0"):
        axis_levels(0)


@for_each("num_texels", [2, 3, 17, 256])
def test_every_footprint_has_a_level_that_keeps_enough_texels(num_texels):
    levels = axis_levels(num_texels)
    for footprint in np.geomspace(FIRST_FOOTPRINT, (num_texels - 1) / 0.25, 100):
        level = levels[level_index((num_texels - 1) / (2 * footprint), num_texels)]
        texels_per_pixel = (level.num_texels - 1) / level.scale * footprint / (num_texels - 1)
        assert texels_per_pixel > min(1.69, 0.99 * footprint)
        assert 2**-0.26 < level.footprint / footprint < 2**0.26


def test_level_has_the_announced_size_and_keeps_the_paint():
    coverage = bristles()
    for k_u, u in enumerate(axis_levels(256)):
        for k_v, v in enumerate(axis_levels(64)):
            level = level_coverage(coverage, k_u, k_v)
            assert level.shape == (v.num_texels, u.num_texels)
            if max(u.footprint / 255, v.footprint / 63) < 0.5:  # boxes of two pixels and more
                area = _integral(level, u.scale, v.scale)
                assert area == pytest.approx(_integral(coverage, 1, 1), rel=0.02)


def _integral(texels, scale_u, scale_v):
    """Volume under the bilinear surface over a box of size scale_u x scale_v."""
    across, along = (np.full(count, 1 / (count - 1)) for count in texels.shape)
    for weights in (across, along):
        weights[[0, -1]] /= 2
    return across @ texels @ along * scale_u * scale_v


@for_each("shape", [(1, 1), (1, 5), (4, 1), (6, 7)])
def test_packed_levels_hold_each_texel_with_the_one_below(shape):
    rng = np.random.default_rng(3)
    coverage, height = rng.integers(0, 256, (2, *shape), np.uint8)
    rows, columns = (max(count, 2) for count in shape)

    def paired(texels):
        words = np.broadcast_to(texels, (rows, columns)) if 1 in shape else texels
        words = words.astype(np.uint32)
        return np.append((words | np.concatenate([words[1:], words[-1:]]) << 8).ravel(), 0)

    for heights in ([], [height]):
        pairs, both = np.empty(rows * columns + 1, np.uint16), np.empty(rows * columns + 1, np.uint32)
        _core.pack_levels(coverages=[coverage], heights=heights, pairs=[pairs], pairs_with_height=[both])
        np.testing.assert_array_equal(pairs, paired(coverage))
        raised = paired(height if heights else coverage).astype(np.uint32)
        np.testing.assert_array_equal(both, paired(coverage) | raised << 16)
