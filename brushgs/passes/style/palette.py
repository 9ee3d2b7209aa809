"""The palette of a painting: a few named colors, each with samples of the similar colors in the painting.

Pixels are sampled at even steps of opacity and clustered in OKLab. Each cluster is stored as colors that
stand for equal parts of it: halving it repeatedly and drawing one pixel of each leaf gives rare colors and
tails their share.
"""

import numpy as np

from brushgs.passes.groups import compacted
from brushgs.passes.style.color_names import color_names
from brushgs.values.arrays import F64, Array, Rows, check
from brushgs.values.colors import oklab_of, rgb_of_oklab, split_alpha
from brushgs.values.style import NamedColor, StylePalette

MOST_COLORS, FEWEST_COLORS = 8, 5
NUM_PIXELS = 1 << 16  # sampled from larger paintings
NUM_SAMPLES, FEWEST_SAMPLES = 768, 12  # of the palette, and of each color: 6 bytes each in a file
# OKLab as clustered: chroma spans a third of the range of lightness, and names depend on hue.
CHROMA_WEIGHT = 2.0
NEAR = 0.075  # in that space: colors nearer than this are merged, if enough remain
REACH = 0.12  # OKLab: weight radius of the mean in `nearest_color`
_ROUNDS = 20
_SEED = 20160


def learn_palette(image: Array) -> StylePalette:
    """The palette of a painting.

    Args:
        image: [H, W, C] as `read_image` returns it: gray or RGB, with or without alpha; transparent areas do
            not count.

    Returns:
        5 to 8 colors, the most frequent first; fewer if the painting has fewer. Equal paintings give equal
        palettes.

    Raises:
        TypeError: if `image` is not an array.
        ValueError: if it has other channels, is empty or fully transparent.
    """
    channels = check("learn_palette", image=(image, "H W C"))["C"]
    if not 1 <= channels <= 4:
        raise ValueError(f"learn_palette: image must have 1 to 4 channels, got {channels}")
    rng = np.random.default_rng(_SEED)
    rgb = _sampled_pixels(image, rng)
    lab = oklab_of(rgb) * (1, CHROMA_WEIGHT, CHROMA_WEIGHT)
    labels = _clusters(lab)
    sizes = np.bincount(labels)
    order = np.argsort(-sizes, kind="stable")
    found = []
    for label in order:
        rows = np.flatnonzero(labels == label)
        middle = rgb_of_oklab(lab[rows].mean(axis=0, keepdims=True) / (1, CHROMA_WEIGHT, CHROMA_WEIGHT))[0]
        middle = np.rint(255 * np.clip(middle, 0, 1)) / 255  # rounded as in a file
        share = len(rows) / len(rgb)
        count = min(len(rows), max(FEWEST_SAMPLES, round(NUM_SAMPLES * share)))
        samples = rgb[_representatives(lab, rows, count, rng)]
        found.append((middle, share, (samples - middle).astype(np.float32)))
    names = color_names(np.stack([middle for middle, _, _ in found]))
    return StylePalette(tuple(NamedColor(name, *parts) for name, parts in zip(names, found, strict=True)))


def _sampled_pixels(image: Array, rng: np.random.Generator) -> F64:
    """[n, 3] colors of pixels at even steps of the sum of alpha."""
    rgb, alpha = split_alpha(image.reshape(-1, image.shape[-1]))
    if alpha is None:
        alpha = np.ones(len(rgb), np.float32)
    sums = np.cumsum(alpha, dtype=np.float64)
    if len(sums) == 0 or not sums[-1] > 0:
        raise ValueError("learn_palette: image must have a pixel that is not transparent, got none")
    count = min(len(rgb), NUM_PIXELS)
    # Jittered within the steps: a repeating pattern, such as a weave, would be sampled at one phase only.
    places = (np.arange(count) + rng.random(count)) / count * sums[-1]
    rows = np.minimum(np.searchsorted(sums, places, side="right"), len(rgb) - 1)
    return np.asarray(rgb[rows], np.float64)


def _clusters(lab: F64) -> Rows:
    """[n] the cluster of each color: split where the spread is largest, refined, near clusters merged."""
    labels = np.zeros(len(lab), np.intp)
    for new in range(1, MOST_COLORS):
        spreads = [_spread(lab[labels == label]) for label in range(new)]
        widest = max(range(new), key=lambda label: spreads[label][0])
        if spreads[widest][0] <= 1e-9:
            break
        rows = np.flatnonzero(labels == widest)
        along = (lab[rows] - lab[rows].mean(axis=0)) @ spreads[widest][1]
        labels[rows[along > 0]] = new
        labels = _refined(lab, labels)
    while True:
        middles = _middles(lab, labels)
        if len(middles) <= FEWEST_COLORS:
            return labels
        distances = np.linalg.norm(middles[:, None] - middles, axis=2) + 9.0 * np.eye(len(middles))
        one, other = np.unravel_index(distances.argmin(), distances.shape)
        if distances[one, other] > NEAR:
            return labels
        labels[labels == max(one, other)] = min(one, other)
        labels = _refined(lab, np.unique(labels, return_inverse=True)[1])


def _spread(colors: F64) -> tuple[float, F64]:
    """Sum of squared distances from the mean, and the direction of largest spread."""
    if len(colors) < 2:
        return 0.0, np.array([1.0, 0, 0])
    values, axes = np.linalg.eigh(np.cov(colors.T, bias=True))
    return float(len(colors) * values[-1]), axes[:, -1]


def _refined(lab: F64, labels: Rows) -> Rows:
    """Lloyd's iteration from these labels; no cluster becomes empty."""
    for _ in range(_ROUNDS):
        middles = _middles(lab, labels)
        scores = lab @ (2 * middles.T) - (middles**2).sum(axis=1)
        new = compacted(scores.argmax(axis=1))[0].astype(np.intp)
        if np.array_equal(new, labels):
            break
        labels = new
    return labels


def _middles(lab: F64, labels: Rows) -> F64:
    counts = np.bincount(labels)
    sums = np.stack([np.bincount(labels, column) for column in lab.T], axis=1)
    return np.asarray(sums / counts[:, None])


def _representatives(lab: F64, rows: Rows, count: int, rng: np.random.Generator) -> Rows:
    """`count` of the rows, one from each of as many equal parts made by repeated halving."""
    if count <= 1:
        return rows[[int(rng.integers(len(rows)))]]
    first = count // 2
    cut = round(len(rows) * first / count)
    axis = int(np.ptp(lab[rows], axis=0).argmax())
    halves = np.argpartition(lab[rows, axis], cut) if cut < len(rows) else np.arange(len(rows))
    return np.concatenate(
        [
            _representatives(lab, rows[halves[:cut]], first, rng),
            _representatives(lab, rows[halves[cut:]], count - first, rng),
        ]
    )


def nearest_color(palette: StylePalette, rgb: F64) -> F64:
    """A color [3] of a painting near another one [3].

    It is the mean of the painting's colors, weighted by nearness in OKLab and by the area that they cover.
    """
    samples = np.clip(palette.samples, 0, 1)
    away = oklab_of(samples) - oklab_of(np.clip(rgb, 0, 1)[None])
    far = np.einsum("si,si->s", away, away) / (2 * REACH**2)
    shares = palette.weights * np.exp(far.min() - far)
    return np.asarray(shares @ samples / shares.sum())
