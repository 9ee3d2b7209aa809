"""A seamless all-around map of colors and directions, quilted from the calm parts of a painting.

Blocks of colors and directions, averaged over cells of about 1 % of the height, are laid side by side. Each
comes from about the same height of the painting, mirrored or not, and is the one that fits its neighbors
best. Columns wrap around, so the last blocks fit the first ones and there is no seam.
Source: Efros and Freeman 2001, Image quilting for texture synthesis and transfer.
"""

import numpy as np

from brushgs.passes.color.color_space import oklab_planes
from brushgs.passes.form.mark_directions import mark_pairs, shrunk
from brushgs.passes.style.averages import averaged
from brushgs.passes.style.calm import calm_cells, filled
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.colors import rgb_of_oklab
from brushgs.values.style import StyleStage

ROWS, COLUMNS = 96, 288  # cells of the map
BORDER = 0.03  # of the shorter side: frames and scan margins, cut off
MOST_SIDE = 1024  # pixels: larger paintings are averaged
BLOCK, OVERLAP = 32, 12  # cells
TRIES = 120  # candidate blocks, half of them mirrored
HEIGHT_SPREAD = 0.06  # standard deviation of a block's source height around its target, in heights
FLOW = 0.15  # OKLab: color difference that a right angle between directions counts as
FILLED = 0.08  # cost of a block of filled cells only, squared OKLab
AGAIN = 0.004  # cost of reusing a source place, squared OKLab
_SEED = 20260


def learn_stage(image: Array, flatness: float = 0.0) -> StyleStage:
    """The surroundings in a painting, as a map for the surroundings of any subject.

    Args:
        image: [H, W, C] as `read_image` returns it, 32 x 32 pixels or more.
        flatness: how much the painting is a print, 0 to 1.
    """
    colors, flow = _cells(image)
    calm = calm_cells(colors, flatness)
    field = filled(np.concatenate([colors, flow], axis=-1), calm)
    found = quilted(field, calm.astype(np.float64))
    rgb = np.clip(rgb_of_oklab(found[..., :3].reshape(-1, 3)), 0, 1).reshape(*found.shape[:2], 3)
    lengths = np.linalg.norm(found[..., 3:], axis=-1, keepdims=True)
    flow = found[..., 3:] / np.maximum(lengths, 1)
    return StyleStage(rgb.astype(np.float32), flow.astype(np.float32))


def _cells(image: Array) -> tuple[F64, F64]:
    """OKLab [h, w, 3] and directions [h, w, 2] of a painting without its margin, averaged over cells."""
    margin = int(BORDER * min(image.shape[:2]))
    image = image[margin : image.shape[0] - margin, margin : image.shape[1] - margin]
    lab = oklab_planes(averaged(image, MOST_SIDE)).astype(np.float64).transpose(1, 2, 0)
    columns = max(round(ROWS * image.shape[1] / image.shape[0]), BLOCK)
    return _resized(lab, columns), _resized(mark_pairs(*shrunk(image)), columns)


def _resized(field: F64, columns: int) -> F64:
    """A field [h, w, k] resized to `ROWS` x `columns`: means over cells, smoothed to about one cell."""
    from scipy.ndimage import gaussian_filter, map_coordinates

    height, width = field.shape[:2]
    y, x = ((np.arange(n) + 0.5) * size / n - 0.5 for n, size in ((ROWS, height), (columns, width)))
    places = np.stack(np.meshgrid(y, x, indexing="ij"))
    blurs = max(0.5 * height / ROWS, 1e-3), max(0.5 * width / columns, 1e-3)
    smooth = (gaussian_filter(field[..., k], blurs) for k in range(field.shape[-1]))
    return np.stack([map_coordinates(one, places, order=1, mode="nearest") for one in smooth], axis=-1)


def quilted(field: F64, calm: F64, *, seed: int = _SEED) -> F64:
    """[ROWS, COLUMNS, 5] a field [ROWS, w, 5] of colors and directions, continued all around.

    Args:
        field: OKLab and directions, w >= `BLOCK`.
        calm: [ROWS, w] 1 in original cells, 0 in filled ones.
        seed: another seed gives another map.
    """
    rng = np.random.default_rng(seed)
    scale = np.array([1.0, 1.0, 1.0, FLOW, FLOW])
    mirrored = field[:, ::-1] * (1, 1, 1, 1, -1)
    sources = [(field * scale, calm), (mirrored * scale, calm[:, ::-1])]
    sums, weights = np.zeros((ROWS, COLUMNS, 5)), np.zeros((ROWS, COLUMNS))
    window = _window()
    used: list[tuple[int, int]] = []
    for top in _starts(ROWS - BLOCK):
        for left in np.linspace(0, COLUMNS, round(COLUMNS / (BLOCK - OVERLAP)), endpoint=False).astype(int):
            columns = (left + np.arange(BLOCK)) % COLUMNS
            there = weights[top : top + BLOCK][:, columns]
            now = sums[top : top + BLOCK][:, columns] / np.maximum(there, 1e-9)[..., None]
            block, place = _best(sources, now, there > 0, top, used, rng)
            used = [*used[-COLUMNS // BLOCK :], place]
            sums[top : top + BLOCK, columns] += block * window[..., None]
            weights[top : top + BLOCK, columns] += window
    return np.asarray(sums / weights[..., None] / scale)


def _best(
    sources: list[tuple[F64, F64]],
    now: F64,
    is_laid: Mask,
    top: int,
    used: list[tuple[int, int]],
    rng: np.random.Generator,
) -> tuple[F64, tuple[int, int]]:
    """The block that best fits those already laid, and its source."""
    width = sources[0][0].shape[1]
    laid = np.maximum(np.count_nonzero(is_laid), 1)
    heights = np.clip(np.rint(top + rng.normal(0, HEIGHT_SPREAD * ROWS, TRIES)), 0, ROWS - BLOCK)
    lefts = rng.integers(0, width - BLOCK + 1, TRIES)
    best, cost, place = now, np.inf, (0, 0)
    for number, (y, x) in enumerate(zip(heights.astype(int).tolist(), lefts.tolist(), strict=True)):
        field, calm = sources[number % 2]
        block = field[y : y + BLOCK, x : x + BLOCK]
        own = width - BLOCK - x if number % 2 else x
        near = sum(abs(own - b) + abs(y - a) < BLOCK for a, b in used)
        price = float(((block - now) ** 2).sum(axis=-1)[is_laid].sum()) / laid
        price += FILLED * (1 - float(calm[y : y + BLOCK, x : x + BLOCK].mean())) + AGAIN * near
        if price < cost:
            best, cost, place = block, price, (y, own)
    return best, place


def _window() -> F64:
    ramp = np.minimum((np.arange(BLOCK) + 1.0) / OVERLAP, 1.0)
    one = np.minimum(ramp, ramp[::-1])
    return np.outer(one, one)


def _starts(last: int) -> list[int]:
    """First rows of blocks, from 0 to the last."""
    count = -(-last // (BLOCK - OVERLAP)) + 1
    return [round(last * k / max(count - 1, 1)) for k in range(count)]
