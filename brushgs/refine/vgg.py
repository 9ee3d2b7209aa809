"""Features of VGG-16 or VGG-19, with a weights file of the user.

Source: Simonyan and Zisserman 2015; Zhang et al. 2022, ARF, section 4 (features of the third block);
Gatys et al. 2016 (features of single layers).
"""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

from brushgs.options.experiments import style_layer
from brushgs.refine.weights import find_vgg, read_state, tensor_of

# Channels of the 3 x 3 convolutions of each block; between blocks, the picture is halved. torchvision counts
# convolutions, ReLUs and pools in one sequence.
WIDTHS = 64, 128, 256, 512, 512
CONVOLUTIONS = {16: (2, 2, 3, 3, 3), 19: (2, 2, 4, 4, 4)}
MEAN, STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # ImageNet normalization of the input
BLOCK_3 = ("conv3",)


class Vgg:
    """Some layers of a VGG.

    Attributes:
        depth: 16 or 19.
        strides: pixels between positions, of each group.
        halo: pixels around a position on which its features depend.
    """

    def __init__(self, path: Path, layers: Sequence[str] = BLOCK_3, *, is_split: bool = False) -> None:
        """Read the weights.

        Args:
            path: a state dict as torchvision names it.
            layers: "conv3" for the third block, "conv3_1" for its first layer; from the first to the deepest.
            is_split: a group of features for each layer; else one for each block, as in ARF.

        Raises:
            SceneError: if the file is missing, damaged, or not of VGG-16 or VGG-19.
            ValueError: if this VGG has no such layer.
        """
        state = read_state(path)
        self.depth = 19 if any(name.startswith("features.34.") for name in state) else 16
        self._chosen = _chosen(layers, self.depth)
        deepest, place, channels = max(self._chosen), 0, 3
        self._layers: list[tuple[int, int, Tensor, Tensor]] = []
        reach = 0
        for block, layer in _places(self.depth):
            place += layer == 1 and block > 1
            if (block, layer) > deepest:
                break
            width, name, reach = WIDTHS[block - 1], f"features.{place}", reach + 2 ** (block - 1)
            cure = "give torchvision's VGG-16 or VGG-19"
            weight = tensor_of(state, path, f"{name}.weight", (width, channels, 3, 3), cure)
            self._layers.append(
                (block, layer, weight, tensor_of(state, path, f"{name}.bias", (width,), cure))
            )
            place, channels = place + 2, width
        names = self._chosen if is_split else [(block, 0) for block, _ in self._chosen]
        self._groups = list(dict.fromkeys(names))
        self.strides = tuple(2 ** (block - 1) for block, _ in self._groups)
        self.halo = reach + max(self.strides) - 1

    def activations(
        self, normalized: Tensor, pool: Callable[[Tensor], Tensor]
    ) -> Iterator[tuple[int, int, Tensor]]:
        """Block, layer and activations [1, D, h, w] of a normalized picture [1, 3, H, W].

        `pool` halves those of a block for the next.
        """
        x = normalized
        for block, layer, weight, bias in self._layers:
            if layer == 1 and block > 1:
                x = pool(x)
            x = F.relu(F.conv2d(x, weight, bias, padding=1))
            yield block, layer, x

    def __call__(self, picture: Tensor) -> list[Tensor]:
        """Features of a picture [3, H, W], 0 to 1: the groups [D, h, w]."""
        mean, std = (torch.tensor(v, dtype=picture.dtype).view(3, 1, 1) for v in (MEAN, STD))
        found: dict[tuple[int, int], list[Tensor]] = {group: [] for group in self._groups}
        for block, layer, x in self.activations(((picture - mean) / std)[None], _pool):
            if (block, layer) in self._chosen:
                found[(block, layer) if (block, layer) in found else (block, 0)].append(x[0])
        return [torch.cat(group) for group in found.values()]

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """All features: each describes the content."""
        return groups


def _pool(x: Tensor) -> Tensor:
    return F.max_pool2d(
        x, 2, ceil_mode=True
    )  # includes positions of incomplete cells at the right and the bottom


def find_weights() -> Path | None:
    """The weights file in torch's hub cache, or None."""
    return find_vgg(Path(torch.hub.get_dir()) / "checkpoints")


def _places(depth: int) -> list[tuple[int, int]]:
    """Block and layer of each convolution, both from 1."""
    return [(block, layer) for block, n in enumerate(CONVOLUTIONS[depth], 1) for layer in range(1, n + 1)]


def _chosen(layers: Sequence[str], depth: int) -> list[tuple[int, int]]:
    """Block and layer of the named convolutions, in order of depth."""
    named = {name: style_layer(name) for name in layers}
    chosen = []
    for name, (block, layer) in named.items():
        own = [place for place in _places(depth) if place[0] == block and layer in (0, place[1])]
        if not own:
            most = CONVOLUTIONS[depth][block - 1]
            raise ValueError(f"style-layers has {name}, and block {block} of VGG-{depth} has {most} layers")
        chosen += own
    return sorted(set(chosen))
