"""Networks for perceptual and caption-based comparison of pictures, with weights in a folder of the user.

`NETWORKS` is the table of them. Pictures are [H, W, 3], display-encoded, 0 to 1. LPIPS and DISTS are formulas
on the features of `Vgg`: their libraries need torchvision, whose wheels do not load beside PyTorch for CPUs.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from msgspec import Struct
from torch import Tensor

from brushgs.errors import SceneError
from brushgs.formats.files import is_dir, is_plain, read_whole
from brushgs.formats.schema import MAX_BYTES, decode
from brushgs.passes.where.clip import MODEL, PICKLES, WEIGHTS, ClipEncoder, pretrained
from brushgs.refine.vgg import MEAN, STD, WIDTHS, Vgg
from brushgs.refine.weights import VGG_16, WeightsFile, read_state, tensor_of
from brushgs.values.arrays import F64, Array

LAST_OF_BLOCKS = ("conv1_2", "conv2_2", "conv3_3", "conv4_3", "conv5_3")
LPIPS_SHIFT, LPIPS_SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)  # of values -1 to 1
DISTS_STABILIZER = 1e-6
LEAST_SIDE = 16  # pixels: the fifth block has one position
DINO_SIDE = 224  # pixels, of pictures that DINOv2 was trained with
PROMPTS = ("Good photo.", "Bad photo.")
_HALF = torch.tensor([0.5, 1.0, 0.5])  # Hann window of five, without its zeros

LPIPS_FILE = WeightsFile(
    "LPIPS",
    ("lpips_vgg.pth", "vgg.pth"),
    "its linear layers on VGG-16, lin0.model.1.weight to lin4.model.1.weight",
    "https://github.com/richzhang/PerceptualSimilarity/tree/master/lpips/weights/v0.1",
)
DISTS_FILE = WeightsFile(
    "DISTS",
    ("dists.pt", "weights.pt"),
    "alpha and beta, [1, 1475, 1, 1] each",
    "https://github.com/dingkeyan93/DISTS/tree/master/DISTS_pytorch",
)

Pair = Callable[[Array, Array], float]
Embed = Callable[[Array], F64]


class Lpips:
    """LPIPS on VGG-16, version 0.1: 0 for equal pictures.

    Source: Zhang et al. 2018, The Unreasonable Effectiveness of Deep Features as a Perceptual Metric, eq. 1.
    """

    def __init__(self, folder: Path) -> None:
        """Read the weights.

        Raises:
            SceneError: if files are missing or not these weights.
        """
        self._vgg = _vgg_16(folder)
        path = LPIPS_FILE.need(folder)
        state, cure = read_state(path), f"give those of {LPIPS_FILE.source}"
        self._weights = [
            tensor_of(state, path, f"lin{row}.model.1.weight", (1, width, 1, 1), cure)
            for row, width in enumerate(WIDTHS)
        ]

    def __call__(self, picture: Array, truth: Array) -> float:
        """The distance of two pictures of one size."""
        first, second = (
            [layer / (layer.norm(dim=1, keepdim=True) + 1e-10) for layer in self._layers(picture)]
            for picture in (picture, truth)
        )
        terms = zip(first, second, self._weights, strict=True)
        return float(sum((F.conv2d((a - b).square(), weight)).mean() for a, b, weight in terms))

    def _layers(self, picture: Array) -> list[Tensor]:
        scaled = (2 * _tensor(picture) - 1 - _channels(LPIPS_SHIFT)) / _channels(LPIPS_SCALE)
        return _last_of_blocks(self._vgg, scaled, lambda x: F.max_pool2d(x, 2))


class Dists:
    """DISTS: 0 for equal pictures. Pictures are not resized, as the authors' demonstration does.

    Source: Ding et al. 2020, Image Quality Assessment: Unifying Structure and Texture Similarity, eq. 4 to 7.
    """

    def __init__(self, folder: Path) -> None:
        """Read the weights.

        Raises:
            SceneError: if files are missing or not these weights.
        """
        self._vgg = _vgg_16(folder)
        path, widths = DISTS_FILE.need(folder), (3, *WIDTHS)
        state, cure = read_state(path), f"give those of {DISTS_FILE.source}"
        alpha, beta = (
            tensor_of(state, path, name, (1, sum(widths), 1, 1), cure).flatten() for name in ("alpha", "beta")
        )
        total = alpha.sum() + beta.sum()
        self._alphas, self._betas = ((v / total).split(widths) for v in (alpha, beta))

    def __call__(self, picture: Array, truth: Array) -> float:
        """The distance of two pictures of one size."""
        likeness = torch.zeros(())
        layers = zip(self._layers(picture), self._layers(truth), self._alphas, self._betas, strict=True)
        for a, b, alpha, beta in layers:
            mean_a, mean_b = a.mean(dim=1), b.mean(dim=1)
            texture = (2 * mean_a * mean_b + DISTS_STABILIZER) / (
                mean_a.square() + mean_b.square() + DISTS_STABILIZER
            )
            spreads = a.var(dim=1, correction=0) + b.var(dim=1, correction=0)
            covariance = (a * b).mean(dim=1) - mean_a * mean_b
            structure = (2 * covariance + DISTS_STABILIZER) / (spreads + DISTS_STABILIZER)
            likeness = likeness + (alpha * texture).sum() + (beta * structure).sum()
        return float(1 - likeness)

    def _layers(self, picture: Array) -> list[Tensor]:
        x = _tensor(picture)
        deeper = _last_of_blocks(self._vgg, (x - _channels(MEAN)) / _channels(STD), _root_of_mean_square)
        return [layer[0].flatten(1) for layer in (x, *deeper)]


class ClipPictures:
    """Embeddings of whole pictures by CLIP, and its CLIP-IQA.

    Sources: Radford et al. 2021, CLIP; Wang, Chan and Loy 2023, Exploring CLIP for Assessing the Look and
    Feel of Images (CLIP-IQA; theirs is a ResNet-50 without position embedding).
    """

    def __init__(self, folder: Path) -> None:
        """Open `folder`/clip, see `ClipEncoder`.

        Raises:
            SceneError: if it is not a CLIP model.
        """
        self._folder = folder / "clip"
        self._encoder = ClipEncoder(self._folder)
        self._words = self._encoder.of_words(PROMPTS)

    def embed(self, picture: Array) -> F64:
        """[D] unit vector of the middle square of a picture."""
        window = _square(picture, self._encoder.side * self._encoder.patch)
        return _finite(self._folder, self._encoder.of_pictures(window[None])[0])

    def quality(self, picture: Array) -> float:
        """CLIP-IQA: probability that a picture is "Good photo.", not "Bad photo."; higher is better."""
        good, bad = 100 * (self._words @ self.embed(picture))
        return float(1 / (1 + np.exp(bad - good)))


class _DinoConfig(Struct):
    model_type: Any = None
    image_size: int = DINO_SIDE


class Dino:
    """Embeddings of whole pictures by DINO or DINOv2: the class token of the last layer.

    Sources: Caron et al. 2021, Emerging Properties in Self-Supervised Vision Transformers; Oquab et al. 2023.
    """

    def __init__(self, folder: Path) -> None:
        """Open `folder`/dino.

        Raises:
            SceneError: if it is not such a model, or a library is missing.
        """
        self._folder = folder / "dino"
        self._model, kind, side = _opened_dino(self._folder)
        self._side = side if kind == "vit" else min(side, DINO_SIDE)

    def embed(self, picture: Array) -> F64:
        """[D] unit vector of the middle square of a picture."""
        x = _tensor(_square(picture, self._side))
        with torch.inference_mode():
            found = self._model((x - _channels(MEAN)) / _channels(STD)).last_hidden_state[0, 0]
        vector = _finite(self._folder, found.double().numpy())
        return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-12))


@dataclass(frozen=True)
class Network:
    """A row of the table of networks.

    Attributes:
        name: of the measure.
        words: what it measures, and which end is good.
        files: its weights in the folder.
        model: subfolder with a model of transformers, or "".
        pair: opens a distance of two pictures of one size; or None.
        embed: opens an embedding, whose cosine is the measure; pictures may differ in size; or None.
        alone: opens a measure of a single picture; or None.
    """

    name: str
    words: str
    files: tuple[WeightsFile, ...] = ()
    model: str = ""
    pair: Callable[[Path], Pair] | None = None
    embed: Callable[[Path], Embed] | None = None
    alone: Callable[[Path], Callable[[Array], float]] | None = None

    def missing_from(self, folder: Path) -> str | None:
        """The message about the first file that a folder lacks, or None."""
        if self.model and not is_dir(folder / self.model):
            return f"{folder} lacks the folder {self.model}: {_MODELS[self.model]}"
        return next((file.missing_from(folder) for file in self.files if file.find(folder) is None), None)

    def paths(self, folder: Path) -> Sequence[Path]:
        """The files that it uses."""
        named = [file.need(folder) for file in self.files]
        return named + ([folder / self.model / WEIGHTS[0]] if self.model else [])


_DINO_MODEL = (
    "bring DINO or DINOv2 as ViTModel or Dinov2Model of transformers save it (config.json, "
    "model.safetensors), published at https://huggingface.co/facebook"
)
_MODELS = {"clip": f"{MODEL}, published at https://huggingface.co/openai", "dino": _DINO_MODEL}
NETWORKS = (
    Network("lpips", "perceptual distance, 0 is equal", (VGG_16, LPIPS_FILE), pair=Lpips),
    Network("dists", "distance of structure and texture, 0 is equal", (VGG_16, DISTS_FILE), pair=Dists),
    Network("clip", "cosine of CLIP, 1 is equal", model="clip", embed=lambda f: ClipPictures(f).embed),
    Network("dino", "cosine of DINO, 1 is equal", model="dino", embed=lambda f: Dino(f).embed),
    Network("clip-iqa", "quality by CLIP, 1 is best", model="clip", alone=lambda f: ClipPictures(f).quality),
)


def _opened_dino(folder: Path) -> tuple[Any, str, int]:
    """The model, its type, and the side of its pictures."""
    path = folder / "config.json"
    if not is_plain(path):
        raise SceneError(folder, f"has no config.json; {_DINO_MODEL}")
    config = decode(path, read_whole(path, MAX_BYTES), _DinoConfig, _DINO_MODEL)
    if config.model_type not in ("vit", "dinov2"):
        raise SceneError(path, f"must have the model_type 'vit' or 'dinov2'; {_DINO_MODEL}")
    if not is_plain(folder / WEIGHTS[0]):
        pickles = sorted(path.name for path in folder.iterdir() if path.name.endswith(PICKLES))
        found = f", and {pickles[0]} can be a pickle that runs code" if pickles else ""
        raise SceneError(folder, f"has no {WEIGHTS[0]}{found}; {_DINO_MODEL}")
    try:
        from transformers import Dinov2Model, ViTModel
        from transformers.utils import logging
    except ImportError:
        raise SceneError(folder, "is read by transformers; pip install 'brushgs[text]'") from None
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    kind = {"vit": ViTModel, "dinov2": Dinov2Model}[config.model_type]
    options = {"add_pooling_layer": False} if config.model_type == "vit" else {}
    model = pretrained(kind, folder, "DINO", _DINO_MODEL, **options)
    return model, config.model_type, config.image_size


def _vgg_16(folder: Path) -> Vgg:
    return Vgg(VGG_16.need(folder), LAST_OF_BLOCKS)


def _last_of_blocks(vgg: Vgg, normalized: Tensor, pool: Callable[[Tensor], Tensor]) -> list[Tensor]:
    """Activations of the last layer of each block of VGG-16."""
    lasts: dict[int, Tensor] = {}
    with torch.inference_mode():
        for block, _, x in vgg.activations(normalized, pool):
            lasts[block] = x
    return list(lasts.values())


def _root_of_mean_square(x: Tensor) -> Tensor:
    """The pooling of DISTS: root of the mean square, by a Hann window."""
    window = _HALF[:, None] * _HALF
    kernel = (window / window.sum()).expand(x.shape[1], 1, 3, 3)
    return (F.conv2d(x.square(), kernel, stride=2, padding=1, groups=x.shape[1]) + 1e-12).sqrt()


def _square(picture: Array, side: int) -> Array:
    """The middle square of a picture, at a model's size (antialiased bicubic, shorter side fitted)."""
    height, width = picture.shape[:2]
    short = min(height, width)
    size = (max(side, round(height * side / short)), max(side, round(width * side / short)))
    fitted = F.interpolate(_tensor(picture), size, mode="bicubic", antialias=True).clamp(0, 1)[0]
    top, left = (size[0] - side) // 2, (size[1] - side) // 2
    return np.asarray(fitted[:, top : top + side, left : left + side].permute(1, 2, 0))


def _tensor(picture: Array) -> Tensor:
    """[1, 3, H, W] of a picture [H, W, 3]."""
    return torch.from_numpy(np.ascontiguousarray(np.moveaxis(picture, -1, 0), dtype=np.float32))[None]


def _channels(values: tuple[float, float, float]) -> Tensor:
    return torch.tensor(values).view(1, 3, 1, 1)


def _finite(folder: Path, vector: F64) -> F64:
    if not np.isfinite(vector).all():
        raise SceneError(
            folder, "gives numbers that are not finite: its weights are damaged; download it again"
        )
    return vector
