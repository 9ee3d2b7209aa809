"""Style features from VGG-16 or VGG-19, with a weights file of the user.

The file is torchvision's (a state dict with features.0.weight and so on); nothing is downloaded. Features are
the activations of the third block, as in ARF.
Source: Simonyan and Zisserman 2015; Zhang et al. 2022, ARF, section 4.
"""

from pathlib import Path

import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

from brushgs.errors import SceneError

# Channels of the 3 x 3 convolutions up to the third block; "pool" halves the picture. torchvision numbers
# convolutions, ReLUs and pools alike.
_BLOCKS: dict[int, tuple[int | str, ...]] = {16: (64, 64, "pool", 128, 128, "pool", 256, 256, 256)}
_BLOCKS[19] = (*_BLOCKS[16], 256)
_FIRST_OF_BLOCK_3 = 6  # index in `_BLOCKS`
_MEAN, _STD = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # ImageNet normalization of the input
HUB_NAMES = ("vgg16-397923af.pth", "vgg19-dcbb9e9d.pth")  # file names in the cache of torch's hub


class Vgg:
    """The third block of a VGG.

    Attributes:
        depth: 16 or 19.
        strides: pixels between positions, of the single group.
        halo: pixels around a position on which its features depend.
    """

    strides = (4,)
    halo = 24  # 22 for the last layer of VGG-19, rounded up to whole positions

    def __init__(self, path: Path) -> None:
        """Read the weights.

        Raises:
            SceneError: if the file is missing, not a state dict, or not of VGG-16 or VGG-19.
        """
        state = _state(path)
        is_19 = any(name.startswith("features.34.") for name in state)
        self.depth = 19 if is_19 else 16
        self._layers: list[tuple[Tensor, Tensor] | None] = []
        place, channels = 0, 3
        for width in _BLOCKS[self.depth]:
            if width == "pool":
                self._layers.append(None)
                place += 1
                continue
            assert isinstance(width, int), "the rest are widths"
            self._layers.append(_layer(state, path, place, channels, width))
            place, channels = place + 2, width

    def __call__(self, picture: Tensor) -> list[Tensor]:
        """Features of a picture [3, H, W], 0 to 1: one group [768 or 1024, h, w]."""
        mean, std = (torch.tensor(v, dtype=picture.dtype).view(3, 1, 1) for v in (_MEAN, _STD))
        x, activations = ((picture - mean) / std)[None], []
        for row, layer in enumerate(self._layers):
            x = (
                F.max_pool2d(x, 2, ceil_mode=True)
                if layer is None
                else F.relu(F.conv2d(x, *layer, padding=1))
            )
            if row >= _FIRST_OF_BLOCK_3:
                activations.append(x[0])
        return [torch.cat(activations)]

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """The features that describe the content: all."""
        return groups


def find_weights() -> Path | None:
    """The weights file in torch's hub cache, or None."""
    folder = Path(torch.hub.get_dir()) / "checkpoints"
    return next((folder / name for name in HUB_NAMES if (folder / name).is_file()), None)


def _state(path: Path) -> dict[str, Tensor]:
    if not path.is_file():
        raise SceneError(path, "there is no such file; check the path of the VGG weights")
    try:
        state = torch.load(path, map_location="cpu", weights_only=True, mmap=True)
    except Exception as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SceneError(
            path, f"cannot be read as weights ({reason[:200]}); give torchvision's VGG"
        ) from None
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise SceneError(path, "is not a state dict of tensors; save model.state_dict() of torchvision's VGG")
    return state


def _layer(
    state: dict[str, Tensor], path: Path, place: int, channels: int, width: int
) -> tuple[Tensor, Tensor]:
    shapes = {f"features.{place}.weight": (width, channels, 3, 3), f"features.{place}.bias": (width,)}
    tensors = []
    for name, shape in shapes.items():
        value = state.get(name)
        if value is None or tuple(value.shape) != shape:
            got = "nothing" if value is None else list(value.shape)
            raise SceneError(
                path, f"{name} must have shape {list(shape)}, got {got}; give torchvision's VGG-16 or VGG-19"
            )
        if not value.is_floating_point() or not bool(torch.isfinite(value).all()):
            raise SceneError(path, f"{name} must hold finite floats; download the file again")
        tensors.append(value.float())
    return tensors[0], tensors[1]
