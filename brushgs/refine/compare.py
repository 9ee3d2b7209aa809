"""`brushgs compare`: measures of paintings against the plain pictures, each other, and a style image.

Measures without weights are those of `brushgs.measure`; a folder of weights adds `NETWORKS`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import is_dir
from brushgs.formats.pictures.images import read_image
from brushgs.formats.registry import PICTURE_FORMATS, PICTURES_READ, suffixes_of
from brushgs.measure.likeness import SSIM_SIDE, flip, psnr, ssim
from brushgs.measure.uiqm import BLOCK, uiqm
from brushgs.values.arrays import Array
from brushgs.values.colors import flatten

if TYPE_CHECKING:
    from brushgs.refine.perceptual import Network

LEAST_SIDE = 16  # pixels: the least that every measure accepts
_PAIRS: dict[str, tuple[str, Callable[[Array, Array], float]]] = {
    "psnr": ("dB, more is nearer", psnr),
    "ssim": ("structural similarity, 1 is equal", ssim),
    "flip": ("visible difference, 0 is equal", flip),
}
assert max(SSIM_SIDE, BLOCK) <= LEAST_SIDE, "see there"


@dataclass(frozen=True)
class Figure:
    """A measure, as means over pictures.

    Attributes:
        name: of the measure.
        words: what it measures.
        values: mean by comparison, such as with plain pictures; "alone" for measures of single pictures.
            None for an infinite mean, such as the PSNR of equal pictures.
    """

    name: str
    words: str
    values: dict[str, float | None]


@dataclass
class Comparison:
    """All figures.

    Attributes:
        pictures: number of paintings.
        figures: in the order of the tables.
        weights: file -> hash.
        missing: a sentence for each measure whose weights are missing.
    """

    pictures: int
    figures: list[Figure] = field(default_factory=list)
    weights: dict[str, str] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Pictures:
    """Paintings [H, W, 3] on white, and what they are compared with.

    Attributes:
        painted: n pictures of one size, in the order of a film if several.
        plain: n pictures of that size, or none.
        style: a picture of any size, or None.
    """

    painted: Sequence[Array]
    plain: Sequence[Array] = ()
    style: Array | None = None

    @classmethod
    def read(cls, painted: Path, plain: Path | None = None, style: Path | None = None) -> "Pictures":
        """Read files; of a folder all pictures, in the order of their names.

        Raises:
            SceneError: if a file cannot be read, or sizes or numbers differ.
        """
        own = _read(painted)
        others = () if plain is None else _read(plain)
        if plain is not None and len(others) != len(own):
            counts = f"holds {len(others)} pictures for the {len(own)} of {painted}"
            raise SceneError(plain, f"{counts}; give as many")
        sizes = [picture.shape[:2] for picture in (*own, *others)]
        if odd := next((row for row, size in enumerate(sizes) if size != sizes[0]), None):
            path = painted if odd < len(own) else plain
            size, first = (f"{w}x{h}" for h, w in (sizes[odd], sizes[0]))
            raise SceneError(path or painted, f"has a picture of {size} pixels, and the first has {first}")
        if min(sizes[0]) < LEAST_SIDE:
            raise SceneError(painted, f"must be at least {LEAST_SIDE} pixels wide and high to be measured")
        return cls(own, others, None if style is None else flatten(_rgb(read_image(style))))

    def pairs(self, *, of_any_size: bool) -> Iterator[tuple[str, list[tuple[Array, Array]]]]:
        """Name and pairs of pictures of each comparison."""
        if self.plain:
            yield "plain", list(zip(self.painted, self.plain, strict=True))
        if len(self.painted) > 1:
            yield "next", list(pairwise(self.painted))
        if self.style is not None and of_any_size:
            yield "style", [(picture, self.style) for picture in self.painted]


def compare_pictures(
    pictures: Pictures, weights: Path | None = None, on_measure: Callable[[str], None] = lambda name: None
) -> Comparison:
    """All measures of pictures.

    Args:
        pictures: what is compared.
        weights: folder of weights, see `brushgs.refine.perceptual.NETWORKS`; None for measures without.
        on_measure: called before each measure with its name.

    Raises:
        SceneError: if weights are damaged or not what they should be.
    """
    found = Comparison(len(pictures.painted))
    for name, (words, measure) in _PAIRS.items():
        on_measure(name)
        values = {
            to: _mean([measure(*pair) for pair in pairs]) for to, pairs in pictures.pairs(of_any_size=False)
        }
        _add(found, Figure(name, words, values))
    on_measure("uiqm")
    _add(found, Figure("uiqm", "liveliness", {"alone": _mean([uiqm(one) for one in pictures.painted])}))
    if weights is None:
        return found
    if not is_dir(weights):
        raise SceneError(weights, "is no folder; give the one with the weights")
    from brushgs.refine.perceptual import NETWORKS
    from brushgs.refine.weights import hash_of

    for network in NETWORKS:
        if (sentence := network.missing_from(weights)) is not None:
            found.missing[network.name] = sentence
            continue
        on_measure(network.name)
        _add(found, Figure(network.name, network.words, _values_of(network, weights, pictures)))
        for path in network.paths(weights):
            found.weights[str(path.relative_to(weights))] = hash_of(path)
    return found


def _values_of(network: "Network", weights: Path, pictures: Pictures) -> dict[str, float | None]:
    """Mean values of a network, by comparison."""
    values: dict[str, float | None] = {}
    if network.pair is not None:
        distance = network.pair(weights)
        for to, pairs in pictures.pairs(of_any_size=False):
            values[to] = _mean([distance(*pair) for pair in pairs])
    if network.embed is not None:
        values = _cosines(pictures, network.embed(weights))
    if network.alone is not None:
        quality = network.alone(weights)
        values["alone"] = _mean([quality(one) for one in pictures.painted])
    return values


def _cosines(pictures: Pictures, embed: Callable[[Array], Array]) -> dict[str, float | None]:
    """Mean cosines by comparison; each picture is embedded once."""
    known: dict[int, Array] = {}

    def of(picture: Array) -> Array:
        if id(picture) not in known:
            known[id(picture)] = embed(picture)
        return known[id(picture)]

    return {
        to: _mean([float(of(a) @ of(b)) for a, b in pairs]) for to, pairs in pictures.pairs(of_any_size=True)
    }


def _add(found: Comparison, figure: Figure) -> None:
    if figure.values:
        found.figures.append(figure)


def _mean(values: list[float]) -> float | None:
    mean = float(np.mean(values))
    return mean if np.isfinite(mean) else None


def _read(path: Path) -> list[Array]:
    if not is_dir(path):
        return [flatten(_rgb(read_image(path)))]
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in suffixes_of(PICTURE_FORMATS))
    if not files:
        raise SceneError(path, f"holds no pictures; put some in it: {PICTURES_READ}")
    return [flatten(_rgb(read_image(file))) for file in files]


def _rgb(pixels: Array) -> Array:
    """[H, W, 3 or 4] of a picture as read, which may be gray."""
    channels = pixels.shape[-1]
    return pixels[..., [0, 0, 0, 1][: channels + 2]] if channels < 3 else pixels
