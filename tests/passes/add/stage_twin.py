"""Stages in NumPy, float64, by the names and arguments of the core."""

import numpy as np

from brushgs.values.arrays import gaussian_weights, smoothstep
from brushgs.values.colors import oklab_of
from tests.first_view.twin import weighted_quantiles

# Maps of level ground

LEAST_WEIGHT = 1e-18


def map_sums(level, values, side, half):
    cells = np.floor((level / half + 1) * (side / 2))
    inside = ((cells >= 0) & (cells < side)).all(axis=1)
    rows = cells[inside].astype(np.int64) @ (side, 1)
    return np.bincount(rows, values[inside], side**2).reshape(side, side)


def map_samples(values, half, level):
    side = len(values)
    at = np.clip((level / half + 1) * (side / 2) - 0.5, 0, side - 1)
    low = np.minimum(at.astype(np.int64), side - 2)
    (row, column), (down, across) = low.T, (at - low).T
    upper = values[row, column] * (1 - across) + values[row, column + 1] * across
    lower = values[row + 1, column] * (1 - across) + values[row + 1, column + 1] * across
    return upper * (1 - down) + lower * down


def map_blurred(values, sigma):
    down, across = (gaussian_weights(count, sigma, LEAST_WEIGHT) for count in values.shape)
    return down / down.sum(axis=1).max() @ values @ (across / across.sum(axis=1).max())


# Place and ground

LOWEST, TAILS, LEAST = 0.004, 0.01, 0.05
SIDE, REACH, LOW, BIN, BAND, AROUND, MOST_BINS = 96, 2.0, 0.4, 0.02, 0.07, 4, 1e5
SHARE, BELOW, BEYOND, COVERED, THIN = 0.6, 0.6, 1.2, 0.4, 0.2
EDGE, HANGS, SMOOTH, CORE, RIM, MUTED = (0.45, 0.8), -0.4, 2.0, 0.9, 0.75, 0.75
FILLS = ((1.0, 1.0), (3.0, 1e-2), (10.0, 1e-4), (30.0, 1e-7))


def find_standing(points, weights, radius):
    if not weights.sum() > 0:
        weights = np.ones(len(weights))
    (left, right), (low, top), (near, far) = (
        weighted_quantiles(column, weights, (tail, 1 - tail))
        for column, tail in zip(points.T, (TAILS, LOWEST, TAILS), strict=True)
    )
    width = 0.5 * max(right - left, far - near)
    middle = 0.5 * (left + right), low, 0.5 * (near + far)
    return middle, max(width, LEAST * radius), max(top - low, LEAST * radius)


def find_ground(points, is_level, weights, lab, radius, height):
    level = _level_of(points[:, 1], weights * is_level, radius, height)
    if level is None:
        return None
    at, heights, half = points[:, [0, 2]], points[:, 1] - level, REACH * radius
    area, in_band = (2 * half / SIDE) ** 2, np.abs(heights) < BAND * radius
    if weights[~in_band & (heights < 0)].sum() > BELOW * weights[in_band].sum():
        return None
    paint = map_sums(at, weights * in_band, SIDE, half)
    standing = map_sums(at, weights * (~in_band & (heights > 0)), SIDE, half) > COVERED * area
    if ((paint > COVERED * area) & ~standing).sum() < BEYOND * max(standing.sum(), 1):
        return None
    coverage = map_blurred(((map_blurred(paint, 1.0) > THIN * area) | standing).astype(np.float64), SMOOTH)
    if not (coverage > 0.5).any():
        return None
    known = paint * (coverage > CORE) * ~standing
    known = known if known.any() else paint
    at_rim = weights * in_band * map_samples(((coverage > 0.5) & (coverage < RIM)) * 1.0, half, at)
    tone = _usual(lab, at_rim if at_rim.any() else weights * in_band) * (1, MUTED, MUTED)
    total = sum(share * map_blurred(known, blur) for blur, share in FILLS)
    bare, filled = 1e-9 * total.max(), []
    for k in range(3):
        sums = map_sums(at, weights * in_band * lab[:, k], SIDE, half) * (known > 0)
        color = sum(share * map_blurred(sums, blur) for blur, share in FILLS)
        filled.append((color + bare * tone[k]) / (np.maximum(total, 0) + bare))
    away = np.hypot(*(np.argwhere(coverage > 0.5) - 0.5 * (SIDE - 1)).T)
    return level, coverage, np.array(filled), tone, np.percentile(away, 95) * 2 * half / SIDE


def _level_of(heights, weights, radius, height):
    rows = np.flatnonzero((heights < LOW * height) & (weights > 0))
    heights, paint = heights[rows] / radius, weights[rows]
    if not paint.sum() > 0:
        return None
    lowest = max(heights.min(), heights.max() - MOST_BINS * BIN)
    bins = np.floor(np.maximum(heights - lowest, 0) / BIN).astype(np.int64)
    peak = np.convolve(np.bincount(bins, paint), np.ones(2 * AROUND + 1), "same").argmax()
    near = np.abs(bins - peak) <= AROUND
    if paint[near].sum() < SHARE * paint.sum():
        return None
    return np.average(heights[near], weights=paint[near]) * radius


def _usual(lab, weights):
    bins = np.clip((lab[:, 0] * 25).astype(np.int64), 0, 24)
    peak = np.convolve(np.bincount(bins, weights, 25), np.ones(3), "same").argmax()
    near = weights * (np.abs(bins - peak) <= 1)
    return near @ lab / near.sum()


def dissolving_at(coverage, radius, points):
    covered = map_samples(coverage, REACH * radius, points[:, [0, 2]])
    heights = points[:, 1] / (BAND * radius)
    share = smoothstep(1 - (covered - EDGE[0]) / (EDGE[1] - EDGE[0])) * (np.abs(heights) < 1)
    return share, (heights < -1) | ((heights < HANGS) & (covered < CORE))


# Shadow

SHADOW_SIDE, SHADOW_REACH = 256, 3.2
LAYERS = ((0.0, 0.25), (0.25, 0.6), (0.6, 1.2), (1.2, 9.0))
BLUR, BLUR_BY_HEIGHT, HIGHEST, DENSITY, CONTACT_DENSITY = 0.02, 0.07, 2.0, 1.6, 1.2
TOUCHING, CONTACT_BLUR, NEAR, REFLECTED_BLUR = 0.15, 0.05, 0.45, 0.16


def cast(points, lamp):
    return points[:, [0, 2]] - points[:, 1:2] * [lamp[0] / lamp[1], lamp[2] / lamp[1]]


def cast_shadow(points, weights, lab, radius, lamp):
    points = np.column_stack([points[:, 0], np.maximum(points[:, 1], 0), points[:, 2]])
    heights, half = points[:, 1] / radius, SHADOW_REACH * radius
    cell = 2 * half / SHADOW_SIDE

    def density(at, is_in, blur, values=weights):
        rows = is_in & (weights > 0)
        return map_blurred(
            map_sums(at[rows], values[rows], SHADOW_SIDE, half) / cell**2, blur * radius / cell
        )

    light, level = 1.0, points[:, [0, 2]]
    for low, high in LAYERS:
        blur = BLUR + BLUR_BY_HEIGHT * (low + min(high, HIGHEST))
        light = light * np.exp(
            -DENSITY * density(cast(points, lamp), (heights >= low) & (heights < high), blur)
        )
    contact = 1 - np.exp(-CONTACT_DENSITY * density(level, heights < TOUCHING, CONTACT_BLUR))
    near = density(level, heights < NEAR, REFLECTED_BLUR)
    sums = [density(level, heights < NEAR, REFLECTED_BLUR, weights * lab[:, k]) for k in (1, 2)]
    return 1 - light, contact, np.array(sums) / np.maximum(near, 1e-9) * (1 - np.exp(-near))


def shadow_at(shade, contact, reflected, radius, lamp, points):
    half, level = SHADOW_REACH * radius, points[:, [0, 2]]
    maps = [map_samples(values, half, level) for values in (contact, *reflected)]
    return np.column_stack([map_samples(shade, half, cast(points, lamp)), *maps])


# Surface and spots

STEPS, TABLE, BEYOND_EYE, RISE, TOP = 400, 3.0, 1.5, 0.85, 1.1
NEAR_SIZE, FAR_SIZE, FAR, LEAST_SIZE = 0.12, 0.26, 3.0, 0.1


def profile_around(*, radius, width, height, farthest, least_table):
    flat = max(TABLE * max(1.2 * width, radius, 0.8 * height), least_table)
    wall = max(BEYOND_EYE * farthest, 1.6 * flat)
    rise, turn = RISE * wall, np.linspace(0, np.pi / 2, STEPS // 2)
    level = np.linspace(0, flat, STEPS // 4, endpoint=False)
    upright = np.linspace(rise, rise + TOP * wall, STEPS // 4 + 1)[1:]
    rho = np.concatenate([level, flat + (wall - flat) * np.sin(turn), np.full(len(upright), wall)])
    heights = np.concatenate([np.zeros(len(level)), rise * (1 - np.cos(turn)), upright])
    steps = np.hypot(np.diff(rho, prepend=0.0), np.diff(heights, prepend=0.0))
    return rho, heights, np.cumsum(steps), flat, wall


def profile_slopes(rho, height, length, along):
    return np.interp(along, length, np.arctan2(np.gradient(height), np.gradient(rho)))


def stroke_sizes(rho, *, radius, width, distance, seen_width):
    share = NEAR_SIZE + (FAR_SIZE - NEAR_SIZE) * np.clip((rho - width) / (FAR * radius), 0, 1)
    return np.maximum(share * seen_width * np.hypot(1, rho / max(distance, 1e-300)), LEAST_SIZE * radius)


def _counts(rho, length, cells):
    return np.cumsum(2 * np.pi * rho * np.gradient(length) / cells)


def count_spots(rho, length, cells, until):
    return int(_counts(rho, length, cells)[min(np.searchsorted(rho, until), len(rho) - 1)])


def place_spots(rho, height, length, cells, jitter, noise):
    k = np.arange(len(noise)) + 0.5
    along, around = np.interp(k, _counts(rho, length, cells), length), k * np.pi * (3 - np.sqrt(5))
    away, width = np.interp(along, length, rho), np.sqrt(np.interp(along, length, cells))
    along = np.clip(along + jitter * width * noise[:, 0], 0, length[-1])
    around = around + jitter * width / np.maximum(away, width) * noise[:, 1]
    away = np.interp(along, length, rho)
    points = away * np.cos(around), np.interp(along, length, height), away * np.sin(around)
    return np.column_stack(points), around, along


# Colors and directions

BLEND, UPPER, FAR_TABLE, FRONT, OF_GROUND = (0.02, 0.6), 0.10, 0.04, 0.03, (1, 0.8, 0.8)
DARKEST, CONTACT, REFLECTED, COOLER = 0.52, 0.30, 0.5, np.array([-0.003, -0.016])
SWAY, TABLE_SWAY, LOOSE, LEVEL_UP_TO = 0.9, 0.16, 0.16, 0.7


def surface_colors(points, slopes, *, table, wall, slope, reach, ground_lab, ground_extent):
    right, height, away = points.T
    far = np.clip(away / reach, -1, 1)
    flat, upright = (np.tile(color, (len(points), 1)) for color in (table, wall))
    flat[:, 0] -= np.where(far > 0, FAR_TABLE, -FRONT) * far
    if ground_lab is not None:
        near = np.clip(1.5 - np.hypot(right, away) / ground_extent, 0, 1)[:, None]
        flat += near * (ground_lab - table) * OF_GROUND
    upright[:, 0] += slope * np.clip(right / reach, -1, 1) - UPPER * np.clip(height / reach, 0, 1)
    return flat + smoothstep((slopes - BLEND[0]) / (BLEND[1] - BLEND[0]))[:, None] * (upright - flat)


def shade_colors(shades, shares, lab):
    shade, contact = shades[:, :2].T
    lab[:, 1:] += shares[:, None] * (REFLECTED * shades[:, 2:] + shade[:, None] * COOLER)
    lab[:, 0] *= (1 - DARKEST * shares * shade) * (1 - CONTACT * shares * contact)


def stage_frames(points, slopes, *, around, turns, waves, table, radius, is_still):
    cos, sin, zero = np.cos(around), np.sin(around), 0 * around
    normal = np.stack([-np.sin(slopes) * cos, np.cos(slopes), -np.sin(slopes) * sin], axis=1)
    ring = np.stack([-sin, zero, cos], axis=1)
    rho = np.hypot(points[:, :1], points[:, 2:])
    seam = np.clip((rho / table - LEVEL_UP_TO) / (1 - LEVEL_UP_TO), 0, 1)
    base = (1 - seam) * ((1, 0, 0) if is_still else ring) + seam * ring * np.where(ring[:, :1] < 0, -1, 1)
    base = base - (base * normal).sum(axis=1, keepdims=True) * normal
    base /= np.maximum(np.linalg.norm(base, axis=1, keepdims=True), 1e-9)
    low, high = (
        np.sin(points / radius @ some[:, :3].T + some[:, 3]).sum(axis=1) / np.sqrt(0.5 * len(some))
        for some in waves
    )
    turn = (np.where(slopes < BLEND[1], TABLE_SWAY * low, SWAY * high) + LOOSE * turns)[:, None]
    along = np.cos(turn) * base + np.sin(turn) * np.cross(normal, base)
    return np.stack([along, np.cross(normal, along), normal], axis=2)


# Tones

OUTLINE_BLUR, NEARLY, BORDER, READS, ON_TABLE = 1.5, 0.8, 3, 0.15, 1.15
LIGHTNESS, SLOPES = 0.30 + 0.04 * np.arange(13), np.array([-0.14, -0.07, 0.0, 0.07, 0.14])
AWAY, SLOPED, TOO_NEAR, TOO_FAR, APART, OPENED = 0.4, 0.4, 1.0, 0.8, (0.06, 0.16), 0.12
COMPLEMENT, CHROMA, OF_SUBJECT = 0.6, (0.018, 0.045), 0.2
WARM, COOL = np.array([0.010, 0.030]), np.array([-0.005, -0.022])


def outline_in(rgb, alpha, *, K, rays, eye, lengths, cones_from_rgb, lab_from_roots):
    table, wall, radius, own = lengths
    mask = (alpha > 0.5).astype(np.float64)
    inner = np.zeros(mask.shape, bool)
    inner[BORDER:-BORDER, BORDER:-BORDER] = True
    rows, columns = np.nonzero((mask > 0) & (map_blurred(mask, OUTLINE_BLUR) < NEARLY) & inner)
    planes = (alpha, *rgb.transpose(2, 0, 1))
    inside, *shown = (map_blurred(mask * plane, OUTLINE_BLUR)[rows, columns] for plane in planes)
    lightness = oklab_of(np.clip(np.stack(shown, axis=1) / inside[:, None], 0, 1))[:, 0]
    x, y = (columns + 0.5 - K[0, 2]) / K[0, 0], (rows + 0.5 - K[1, 2]) / K[1, 1]
    rays = np.stack([x, y, np.ones(len(x))], axis=1) @ rays
    is_down = rays[:, 1] < -1e-9
    reach = np.where(is_down, eye[1] / np.where(is_down, -rays[:, 1], 1.0), np.inf)
    ends = eye + np.minimum(reach, 1e6 * radius)[:, None] * rays
    hits = np.hypot(ends[:, 0], ends[:, 2])
    is_table = np.isfinite(reach) & (reach > 0) & (hits < ON_TABLE * table)
    level = rays[:, 0] / np.maximum(np.hypot(rays[:, 0], rays[:, 2]), 1e-12)
    kept = ~is_table | (hits > own)
    return lightness[kept], is_table[kept], ((eye[0] + level * wall) / wall)[kept]


def _reads(lightness, is_table, lateral, tables, walls, slopes):
    """[tables, walls, slopes]."""
    below = np.abs(lightness[is_table] - tables[:, None]) >= READS
    behind = walls[:, None, None] + slopes[:, None] * lateral[~is_table]
    above = np.abs(lightness[~is_table] - behind) >= READS
    return (below.sum(axis=1)[:, None, None] + above.sum(axis=2)) / max(len(lightness), 1)


def tones_read(lightness, is_table, lateral, table, wall):
    return _reads(lightness, is_table, lateral, *np.array([[table], [wall], [0.0]])).item()


def choose_tones(lightness, is_table, lateral, *, mean, low, high, ground, values):
    walls = LIGHTNESS[(low <= LIGHTNESS) & (high >= LIGHTNESS)]
    tables = LIGHTNESS if ground is None else ground[:1]
    reads = _reads(lightness, is_table, lateral, tables, walls, SLOPES)
    away = np.abs(walls - 0.52) + np.abs(tables - 0.5)[:, None]
    cost = AWAY * away[..., None] + SLOPED * np.abs(SLOPES)
    if ground is None:
        apart = np.abs(tables[:, None] - walls)[..., None]
        least, most = (bound + values * OPENED for bound in APART)
        cost = cost + TOO_NEAR * np.maximum(least - apart, 0) + TOO_FAR * np.maximum(apart - most, 0)
    best = np.unravel_index((reads - cost).argmax(), reads.shape)
    table_ab, wall_ab = _hues(np.array(mean[1:]))
    table_ab = table_ab if ground is None else ground[1:]
    return (tables[best[0]], *table_ab), (walls[best[1]], *wall_ab), SLOPES[best[2]], reads[best]


def _hues(ab):
    chroma = np.hypot(*ab)
    opposite = -ab / chroma if chroma > 1e-3 else COOL / np.hypot(*COOL)
    wall = opposite * np.clip(COMPLEMENT * chroma, *CHROMA)
    return OF_SUBJECT * ab + (COOL if wall @ (WARM - COOL) > 0 else WARM), wall
