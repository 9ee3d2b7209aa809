"""Stages in NumPy, float64, by the names and arguments of the core."""

import numpy as np
from scipy.ndimage import map_coordinates

from brushgs.passes.extent import robust_frame
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.arrays import gaussian_weights, smoothstep
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.quats import quats_of, shortest_axes
from brushgs.values.sh import C0, base_colors
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
    return map_coordinates(values, at.T, order=1)


def map_blurred(values, sigma):
    down, across = (gaussian_weights(count, sigma, LEAST_WEIGHT) for count in values.shape)
    return down / down.sum(axis=1).max() @ values @ (across / across.sum(axis=1).max())


# Place and ground

MOST_ROWS, LEVEL, SIGMAS = 40_000, 0.85, 2.0
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


def find_site(means, quats, scales, opacities, sh, axes, lamp, oklab):
    step = max(-(-len(means) // MOST_ROWS), 1)
    means, quats, scales, opacities, sh = (column[::step] for column in (means, quats, scales, opacities, sh))
    weights = step * (opacities * projected_areas(scales))
    center, radius = robust_frame(means)
    if not np.ptp(means, axis=0).any():
        radius = SIGMAS * float(scales.max()) or radius
    middle, width, height = find_standing((means - center) @ axes.T, weights, radius)
    foot, lab = center + middle @ axes, oklab_of(base_colors(sh))
    points, is_level = (means - foot) @ axes.T, np.abs(shortest_axes(quats, scales) @ axes[1]) > LEVEL
    ground = find_ground(points, is_level, weights, lab, radius, height)
    if ground is not None:
        foot, height = foot + ground[0] * axes[1], height - ground[0]
        points = (means - foot) @ axes.T
        weights = weights * (np.abs(points[:, 1]) >= BAND * radius)
    return (foot, axes, radius, width, height, lamp), ground, points, weights, lab


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


def dissolve(means, opacities, sh, ground, table, oklab):
    (foot, axes, radius, *_), coverage, *_ = ground
    points = (means - foot) @ axes.T
    covered = map_samples(coverage, REACH * radius, points[:, [0, 2]])
    heights = points[:, 1] / (BAND * radius)
    share = smoothstep(1 - (covered - EDGE[0]) / (EDGE[1] - EDGE[0])) * (np.abs(heights) < 1)
    opacities[(heights < -1) | ((heights < HANGS) & (covered < CORE))] = 0
    if table is None:
        opacities *= 1 - share
        return
    sh *= (1 - share)[:, None, None]
    sh[:, 0] += share[:, None] * (np.clip(rgb_of_oklab(table[None]), 0, 1) - 0.5) / C0


# Shadow

SHADOW_SIDE, SHADOW_REACH = 256, 3.2
LAYERS = ((0.0, 0.25), (0.25, 0.6), (0.6, 1.2), (1.2, 9.0))
BLUR, BLUR_BY_HEIGHT, HIGHEST, DENSITY, CONTACT_DENSITY = 0.02, 0.07, 2.0, 1.6, 1.2
TOUCHING, CONTACT_BLUR, NEAR, REFLECTED_BLUR = 0.15, 0.05, 0.45, 0.16


def cast(points, lamp):
    return points[:, [0, 2]] - points[:, 1:2] * [lamp[0] / lamp[1], lamp[2] / lamp[1]]


def cast_shadow(points, weights, lab, place):
    _, _, radius, _, _, lamp = place
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


def shadow_at(shadow, points):
    (_, _, radius, _, _, lamp), shade, contact, reflected = shadow
    half, level = SHADOW_REACH * radius, points[:, [0, 2]]
    maps = [map_samples(values, half, level) for values in (contact, *reflected)]
    return np.column_stack([map_samples(shade, half, cast(points, lamp)), *maps])


# Surface and spots

STEPS, TABLE, ON_GROUND, BEYOND_EYE, RISE, TOP = 400, 3.0, 1.15, 1.5, 0.85, 1.1
NEAR_SIZE, FAR_SIZE, FAR, LEAST_SIZE = 0.12, 0.26, 3.0, 0.1
USUAL_STROKES, SIZES, FINE, OVERLAP, SHADED, JITTER = 6000, (0.6, 1.8), 0.55, 9.6, 0.08, 0.35


def profile_around(place, farthest, ground_extent):
    _, _, radius, width, height, _ = place
    flat = max(TABLE * max(1.2 * width, radius, 0.8 * height), ON_GROUND * ground_extent)
    wall = max(BEYOND_EYE * farthest, 1.6 * flat)
    rise, turn = RISE * wall, np.linspace(0, np.pi / 2, STEPS // 2)
    level = np.linspace(0, flat, STEPS // 4, endpoint=False)
    upright = np.linspace(rise, rise + TOP * wall, STEPS // 4 + 1)[1:]
    rho = np.concatenate([level, flat + (wall - flat) * np.sin(turn), np.full(len(upright), wall)])
    heights = np.concatenate([np.zeros(len(level)), rise * (1 - np.cos(turn)), upright])
    steps = np.hypot(np.diff(rho, prepend=0.0), np.diff(heights, prepend=0.0))
    return rho, heights, np.cumsum(steps), flat, wall


def slopes_at(surface, along):
    rho, height, length, *_ = surface
    return np.interp(along, length, np.arctan2(np.gradient(height), np.gradient(rho)))


def stroke_sizes(surface, place, distance, seen_width):
    rho, (_, _, radius, width, *_) = surface[0], place
    share = NEAR_SIZE + (FAR_SIZE - NEAR_SIZE) * np.clip((rho - width) / (FAR * radius), 0, 1)
    return np.maximum(share * seen_width * np.hypot(1, rho / max(distance, 1e-300)), LEAST_SIZE * radius)


def size_beside(num_strokes):
    return np.clip(np.sqrt(USUAL_STROKES / num_strokes), *SIZES)


def _counts(surface, cells):
    rho, _, length, *_ = surface
    return np.cumsum(2 * np.pi * rho * np.gradient(length) / cells)


def place_spots(surface, sizes, overlap, until, draw, layer=0):
    rho, height, length, *_ = surface
    cells = sizes**2 / overlap
    counts = _counts(surface, cells)
    noise = draw(layer, int(counts[min(np.searchsorted(rho, until), len(rho) - 1)]))
    k = np.arange(len(noise)) + 0.5
    along, around = np.interp(k, counts, length), k * np.pi * (3 - np.sqrt(5))
    away, width = np.interp(along, length, rho), np.sqrt(np.interp(along, length, cells))
    along = np.clip(along + JITTER * width * noise[:, 0], 0, length[-1])
    around = around + JITTER * width / np.maximum(away, width) * noise[:, 1]
    away = np.interp(along, length, rho)
    points = away * np.cos(around), np.interp(along, length, height), away * np.sin(around)
    return np.column_stack(points), around, along, np.interp(along, length, sizes), noise


def lay_layers(surface, usual, size, radius, shadows, draw):
    kept = []
    layers = (usual * size, np.inf), (usual * FINE * min(size, 1), SHADOW_REACH * radius)
    for layer, (sizes, until) in enumerate(layers):
        spots = place_spots(surface, sizes, OVERLAP, until, draw, layer)
        is_shaded = np.zeros(len(spots[0]), bool)
        for shadow in shadows:
            is_shaded |= shadow_at(shadow, spots[0])[:, :2].max(axis=1) > SHADED
        kept.append([column[is_shaded == layer] for column in spots])
    return tuple(np.concatenate(pair) for pair in zip(*kept, strict=True))


# Colors, directions and strokes

BLEND, UPPER, FAR_TABLE, FRONT, OF_GROUND = (0.02, 0.6), 0.10, 0.04, 0.03, (1, 0.8, 0.8)
DARKEST, CONTACT, REFLECTED, COOLER = 0.52, 0.30, 0.5, np.array([-0.003, -0.016])
SWAYS, LOOSE, LEVEL_UP_TO = ((0.16, 0.8), (0.9, 0.35)), 0.16, 0.7
SIZE_JITTER, SIZE_IN_SIGMAS, THICKNESS, OPACITY = 0.18, 3.6, 0.01, 0.95


def surface_colors(surface, spots, tones, ground):
    (points, _, along, *_), (table, wall, slope, _), reach = spots, tones, surface[4]
    slopes = slopes_at(surface, along)
    right, height, away = points.T
    far = np.clip(away / reach, -1, 1)
    flat, upright = (np.tile(color, (len(points), 1)) for color in (table, wall))
    flat[:, 0] -= np.where(far > 0, FAR_TABLE, -FRONT) * far
    if ground is not None:
        (_, _, radius, *_), _, maps, _, extent = ground
        own = np.stack([map_samples(one, REACH * radius, points[:, [0, 2]]) for one in maps], axis=1)
        near = np.clip(1.5 - np.hypot(right, away) / extent, 0, 1)[:, None]
        flat += near * (own - table) * OF_GROUND
    upright[:, 0] += slope * np.clip(right / reach, -1, 1) - UPPER * np.clip(height / reach, 0, 1)
    return flat + smoothstep((slopes - BLEND[0]) / (BLEND[1] - BLEND[0]))[:, None] * (upright - flat)


def shade_colors(spots, shadow, strength, ground, lab):
    points, shares = spots[0], np.full(len(lab), strength)
    if ground is not None:
        (_, _, radius, *_), coverage, *_ = ground
        shares *= 1 - map_samples(coverage, REACH * radius, points[:, [0, 2]])
    shades = shadow_at(shadow, points)
    shade, contact = shades[:, :2].T
    lab[:, 1:] += shares[:, None] * (REFLECTED * shades[:, 2:] + shade[:, None] * COOLER)
    lab[:, 0] *= (1 - DARKEST * shares * shade) * (1 - CONTACT * shares * contact)


def stage_frames(surface, spots, waves, radius, is_still):
    (points, around, along, _, noise), table = spots, surface[3]
    slopes = slopes_at(surface, along)
    cos, sin, zero = np.cos(around), np.sin(around), 0 * around
    normal = np.stack([-np.sin(slopes) * cos, np.cos(slopes), -np.sin(slopes) * sin], axis=1)
    ring = np.stack([-sin, zero, cos], axis=1)
    rho = np.hypot(points[:, :1], points[:, 2:])
    seam = np.clip((rho / table - LEVEL_UP_TO) / (1 - LEVEL_UP_TO), 0, 1)
    base = (1 - seam) * ((1, 0, 0) if is_still else ring) + seam * ring * np.where(ring[:, :1] < 0, -1, 1)
    base = base - (base * normal).sum(axis=1, keepdims=True) * normal
    base /= np.maximum(np.linalg.norm(base, axis=1, keepdims=True), 1e-9)
    low, high = (
        most * np.sin(points / radius @ (rate * some[:, :3].T) + 2 * np.pi * some[:, 3]).sum(axis=1)
        for (most, rate), some in zip(SWAYS, waves, strict=True)
    )
    sway = np.where(slopes < BLEND[1], low, high) / np.sqrt(0.5 * waves.shape[1])
    turn = (sway + LOOSE * noise[:, 6])[:, None]
    along = np.cos(turn) * base + np.sin(turn) * np.cross(normal, base)
    return np.stack([along, np.cross(normal, along), normal], axis=2)


def turned_quats(axes, frames):
    turned = axes.T @ frames
    turned[:, :, 1] *= np.sign(np.linalg.det(turned))[:, None]
    return quats_of(turned)


def strokes_on(place, spots, frames, lab, *, style, contrast, longer, oklab):
    (foot, axes, *_), (points, _, _, sizes, noise), (aspect, lightness, chroma) = place, spots, style
    one = np.ones(len(points))
    sides = np.sqrt(aspect) * (one if longer is None else longer), one / np.sqrt(aspect), THICKNESS * one
    scales = (sizes * np.exp(SIZE_JITTER * noise[:, 2]) / SIZE_IN_SIGMAS)[:, None] * np.stack(sides, axis=1)
    lab = lab + noise[:, 3:6] * (lightness, chroma, chroma) * (one if contrast is None else contrast)[:, None]
    sh = (np.clip(rgb_of_oklab(lab), 0, 1) - 0.5) / C0
    return foot + points @ axes, turned_quats(axes, frames), scales, OPACITY * one, sh


# Tones

EDGE_OF_PICTURE, FRINGE = 0.08, 1.5
OUTLINE_BLUR, NEARLY, BORDER, READS, ON_TABLE = 1.5, 0.8, 3, 0.15, 1.15
LIGHTNESS, SLOPES = 0.30 + 0.04 * np.arange(13), np.array([-0.14, -0.07, 0.0, 0.07, 0.14])
AWAY, SLOPED, TOO_NEAR, TOO_FAR, APART, OPENED = 0.4, 0.4, 1.0, 0.8, (0.06, 0.16), 0.12
COMPLEMENT, CHROMA, OF_SUBJECT = 0.6, (0.018, 0.045), 0.2
WARM, COOL = np.array([0.010, 0.030]), np.array([-0.005, -0.022])


def border_alpha(alpha):
    side = max(round(EDGE_OF_PICTURE * min(alpha.shape)), 1)
    is_inside = np.zeros(alpha.shape, bool)
    is_inside[side : len(alpha) - side, side : alpha.shape[1] - side] = True
    return alpha[~is_inside].astype(np.float64).mean() if alpha.size else 0.0


def mean_lab(sh, weights, oklab):
    if not weights.sum() > 0:
        return oklab_of(np.full((1, 3), 0.5))[0]
    return weights / weights.sum() @ oklab_of(base_colors(sh))


def outline_in(rgb, alpha, *, viewmat, K, place, surface, ground_extent, oklab):
    (foot, axes, radius, *_), (*_, table, wall), own = place, surface, FRINGE * ground_extent
    rays, eye = viewmat[:3, :3] @ axes.T, axes @ (-viewmat[:3, :3].T @ viewmat[:3, 3] - foot)
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


def tones_read(outline, table, wall):
    return _reads(*outline, *np.array([[table], [wall], [0.0]])).item()


def choose_tones(outline, mean, low, high, ground, values):
    lightness, is_table, lateral = outline
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
