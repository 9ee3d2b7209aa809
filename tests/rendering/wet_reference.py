"""Reference definitions of the wet layer: plain NumPy in float64, short, slow and obvious.

`test_wet_layer` compares the kernels of the core with them.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.rendering.space_noise import DEVIATION, PERSISTENCE, PRIMES, Anchor, rays_of
from brushgs.rendering.wet_layer import GRAIN_DEVIATION, LEAST_COLOR, PAPER, VEIL, Key, Washes
from brushgs.values.arrays import F64, Array, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE
from brushgs.values.hashing import GOLDEN_32, hash_32

U32 = NDArray[np.uint32]


def space_noise(depth: Array, camera: Camera, anchor: Anchor, *, finest: float, octaves: int) -> F64:
    """`brushgs.rendering.space_noise.space_noise` in float64."""
    rays, focus, size = rays_of(camera, anchor, finest)
    rows, columns = (np.arange(n) + 0.5 for n in depth.shape)
    directions = columns[None, :, None] * rays[0] + rows[:, None, None] * rays[1] + rays[2]
    points = depth[..., None].astype(np.float64) * directions + rays[3]
    is_there = depth > 0
    level = np.log2(size * np.where(is_there, depth, 1.0))
    whole = np.floor(level).astype(np.int64)
    t = level - whole
    flow, slow, of_flow, of_slow = np.zeros((4, *depth.shape))
    for k in range(octaves + 2):
        stream = hash_32((anchor.seed + GOLDEN_32 * (whole + k)).astype(np.uint32))
        places = points * np.exp2(-(whole + k))[..., None]
        if k <= octaves:
            share = 1 - t if k == 0 else t if k == octaves else np.ones_like(t)
            weight = PERSISTENCE**-k * share
            flow += weight * _octave(places, stream)
            of_flow += weight**2
        if k >= octaves - 1:
            weight = np.maximum(1 - np.abs(k - t - (octaves - 0.5)) / 1.5, 0)
            slow += weight * _octave(places, ~stream)
            of_slow += weight**2
    distances = np.linalg.norm(points - focus, axis=-1) / (anchor.reach / anchor.scale)
    noise = np.stack([flow / np.sqrt(of_flow), slow / np.sqrt(of_slow), distances], axis=-1)
    return np.asarray(noise * is_there[..., None])


def _octave(places: F64, stream: U32) -> F64:
    """Gradient noise of unit cells at places [H, W, 3], of deviation 1."""
    cells = np.floor(places)
    f = places - cells
    s = f**3 * (f * (f * 6 - 15) + 10)
    corners = cells.astype(np.int64)
    total = np.zeros(places.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        bits = stream.copy()
        for axis, prime in enumerate(PRIMES):
            bits ^= ((corners[..., axis] + corner[axis]) * prime).astype(np.uint32)
        x, y, z = np.moveaxis(f - np.array(corner), -1, 0)
        h = hash_32(bits) & 15
        u = np.where(h < 8, x, y)
        v = np.where(h < 4, y, np.where((h == 12) | (h == 14), x, z))
        slope = np.where(h & 1, -u, u) + np.where(h & 2, -v, v)
        total += slope * np.prod(np.where(np.array(corner) == 1, s, 1 - s), axis=-1)
    return np.asarray(total / DEVIATION)


def smooth(planes: Array, sigma: float, guide: Array | None, hold: Array | None, rounds: int) -> F64:
    """`brushgs.rendering.wet_layer.smooth` in float64, of a copy."""
    planes = planes.astype(np.float64)
    for i in range(rounds):
        own = sigma * np.sqrt(3) * 2.0 ** (rounds - 1 - i) / np.sqrt(4.0**rounds - 1)
        for axis in (1, 0):
            lines = np.moveaxis(planes, axis, 0)  # a view
            distances = np.ones(lines.shape[:2])
            if guide is not None and hold is not None:
                steps = np.abs(np.diff(np.moveaxis(guide, axis, 0), axis=0)).sum(axis=-1)
                distances[1:] += np.moveaxis(hold, axis, 0)[1:] * steps
            weights = np.exp(-np.sqrt(2) / own * distances)[..., None]
            for k in range(1, len(lines)):
                lines[k] += weights[k] * (lines[k - 1] - lines[k])
            for k in range(len(lines) - 2, -1, -1):
                lines[k] += weights[k + 1] * (lines[k + 1] - lines[k])
    return np.asarray(planes, np.float64)


def key_colors(rgb: Array, alpha: Array, key: Key) -> F64:
    """`Key.colors` in float64."""
    straight = np.ones_like(rgb, np.float64)
    np.divide(rgb, alpha[..., None], out=straight, where=alpha[..., None] > 0)
    colors = np.clip(straight, LEAST_COLOR, 1)
    luma, densities = colors @ np.array(LUMINANCE), -np.log(colors)
    level = np.clip((luma - key.low) / (key.high - key.low), 1e-4, 1)
    wanted = -np.log(key.darkest + (1 - key.darkest) * level**key.gamma)
    densities *= (wanted / np.maximum(-np.log(luma), 1e-3))[..., None]
    mean = densities.mean(axis=-1, keepdims=True)
    densities = np.maximum(mean + key.chroma * (densities - mean), 0)
    found = -np.log(np.exp(-densities) @ np.array(LUMINANCE))
    densities *= np.minimum(wanted / np.maximum(found, 1e-3), 2)[..., None]
    return np.asarray(1 - smoothstep(key.solid * alpha)[..., None] * (1 - np.exp(-densities)))


def part_washes(smoothed: list[Array], noise: Array, washes: Washes) -> tuple[F64, F64, F64]:
    """Densities [H, W, 9] of three washes, their means [H, W, 3], and the tone [H, W] of the second."""
    flow, focus = noise[..., 0], noise[..., 2]
    done = np.zeros(smoothed[0].shape)
    laid, tones = [], np.zeros(flow.shape)
    for i, colors in enumerate(smoothed):
        densities = -np.log(np.clip(colors.astype(np.float64), LEAST_COLOR, 1))
        tone = 1e-4 + densities @ np.array(LUMINANCE)
        factor = np.ones_like(tone)
        if i > 0:
            step = washes.steps[i - 1]
            place = tone / step + washes.wander * flow
            whole = np.floor(place)
            level = whole + smoothstep((place - whole - 0.5) * washes.hardness[i - 1] + 0.5)
            change = np.clip(level * step / tone, 0.6, 1.5) - 1
            factor = 1 + washes.masses[i - 1] * (1 - washes.at_focus * focus) * change
        if i == 1:
            tones = tone * factor
        laid.append(np.maximum(washes.shares[i] * densities * factor[..., None] - done, 0))
        done += laid[-1]
    means = np.stack([one.mean(axis=-1) for one in laid], axis=-1)
    return np.concatenate(laid, axis=-1), means, tones


def mix_washes(
    parted: tuple[Array, Array, Array],
    blurred: Array,
    noise: Array,
    alphas: tuple[Array, Array | None],
    sheet: tuple[Array | None, Array | None, Array | None],
    washes: Washes,
) -> tuple[F64, F64]:
    """Colors [H, W, 3] and alpha [H, W] of the covering paint of three washes.

    Args:
        parted: see `part_washes`.
        blurred: [H, W, 3] its means, blurred.
        noise: [H, W, 3] flow, slow noise and focus.
        alphas: [H, W] coverage by strokes; [H, W, 2] 0.5 at an outline to 1 where none is, and how far
            its side is that of the lamp, or None.
        sheet: [H, W] grain, [H, W] border and [H, W, 3] color of the paper; or None.
        washes: numbers.
    """
    (densities, means, tones), (alpha, soft), (grains, border, paper) = parted, alphas, sheet
    flow, slow, focus = np.moveaxis(noise, -1, 0)
    grain = np.zeros_like(flow) if grains is None else (0.5 - grains) / GRAIN_DEVIATION
    factors = 1 + np.array(washes.rims) * np.clip((means - blurred) / (means + 0.15), 0, 0.5)
    dip, crest = ((slow - place) / width for _, place, width in (washes.dips, washes.crests))
    backruns = 1 - washes.dips[0] * np.exp(-(dip**2)) + washes.crests[0] * np.exp(-(crest**2)) * (1 - focus)
    factors[..., 0] *= (1 + washes.flows[0] * flow) * backruns
    factors[..., 1] *= 1 + washes.flows[1] * flow
    limit = washes.light[0] + washes.light_noise[0] * grain + washes.light_noise[1] * flow
    share = 1 - smoothstep((limit - tones) / washes.light[1])
    thick = np.clip(1.3 * (means[..., 0] + means[..., 1]), 0.12, 1) * (1 - washes.at_focus * focus)
    share = share * (1 + washes.grain * grain * thick)
    kept = np.ones_like(flow)
    if soft is not None:
        first, range_, noise_share, focus_share, side_share, tone_share = washes.lost
        score = noise_share * slow - focus_share * focus + side_share * soft[..., 1] - tone_share * tones
        kept = 1 - smoothstep((score - first) / range_) * (1 - smoothstep(2 * soft[..., 0] - 1))
    share = share * kept if border is None else share * kept * border
    sums = (densities.reshape(*flow.shape, 3, 3) * factors[..., None]).sum(axis=-2)
    tints = np.exp(-np.clip(sums * share[..., None], 0, washes.most))
    cover = smoothstep((alpha - PAPER[0]) / PAPER[1]) * (VEIL + (1 - VEIL) * kept)
    covered = 1 - (1 - cover) * tints.min(axis=-1)
    rgb = np.maximum(tints - 1 + covered[..., None], 0)
    return np.asarray(rgb if paper is None else rgb * paper), np.asarray(covered)
