"""Network weights in a folder of the user: file names, and reading.

A state dict is read from safetensors, or from a torch file whose pickle contains only tensors. Nothing is
downloaded.
"""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from brushgs.errors import SceneError
from brushgs.formats.files import is_dir, is_plain


@dataclass(frozen=True)
class WeightsFile:
    """A file of weights.

    Attributes:
        what: the network.
        names: file names to look for, in this order; also with the suffix .safetensors.
        layout: of its tensors.
        source: where its authors publish it.
    """

    what: str
    names: tuple[str, ...]
    layout: str
    source: str

    def find(self, folder: Path) -> Path | None:
        """The file in a folder, or None."""
        names = (n for name in self.names for n in (name, f"{name.rpartition('.')[0]}.safetensors"))
        return next((folder / name for name in names if is_plain(folder / name)), None)

    def missing_from(self, folder: Path) -> str:
        """The message about a folder without it."""
        return (
            f"{folder} lacks {self.names[0]} (or .safetensors), the weights of {self.what}: {self.layout}, "
            f"published at {self.source}"
        )

    def need(self, folder: Path) -> Path:
        """The file in a folder.

        Raises:
            SceneError: if it is missing.
        """
        if not is_dir(folder):
            raise SceneError(folder, "is no folder; give the one with the weights")
        found = self.find(folder)
        if found is None:
            raise SceneError(folder, self.missing_from(folder).removeprefix(f"{folder} "))
        return found


TORCHVISION = "https://download.pytorch.org/models"
VGG_19 = WeightsFile(
    "VGG-19",
    ("vgg19-dcbb9e9d.pth", "vgg19.pth"),
    "torchvision's state dict, features.N.weight and features.N.bias",
    f"{TORCHVISION}/vgg19-dcbb9e9d.pth",
)
VGG_16 = WeightsFile(
    "VGG-16", ("vgg16-397923af.pth", "vgg16.pth"), VGG_19.layout, f"{TORCHVISION}/vgg16-397923af.pth"
)


def find_vgg(folder: Path) -> Path | None:
    """The weights of VGG-16, else those of VGG-19, in a folder; None if there are none."""
    return VGG_16.find(folder) or VGG_19.find(folder)


def read_state(path: Path) -> dict[str, Tensor]:
    """The tensors of a file, by name.

    Raises:
        SceneError: if it is missing, damaged, holds more than tensors, or would run code.
    """
    if not path.is_file():
        raise SceneError(path, "there is no such file; check the path of the weights")
    try:
        if path.suffix == ".safetensors":
            from safetensors.torch import load_file

            return dict(load_file(path))
        state = torch.load(path, map_location="cpu", weights_only=True, mmap=True)
    except ImportError:
        cure = "pip install safetensors, or give a state dict of torch (.pth)"
        raise SceneError(path, f"is read by safetensors, which is not installed; {cure}") from None
    except Exception as error:  # any error of the libraries for invalid files
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SceneError(
            path, f"cannot be read as weights ({reason[:200]}); give a state dict of tensors"
        ) from None
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise SceneError(path, "is not a state dict of tensors; save model.state_dict()")
    return state


def tensor_of(
    state: Mapping[str, Tensor], path: Path, name: str, shape: tuple[int, ...], cure: str
) -> Tensor:
    """A tensor of a state dict, in float32.

    Raises:
        SceneError: if it is missing, has another shape, or holds other numbers than finite floats.
    """
    value = state.get(name)
    if value is None or tuple(value.shape) != shape:
        got = "nothing" if value is None else list(value.shape)
        raise SceneError(path, f"{name} must have shape {list(shape)}, got {got}; {cure}")
    if not value.is_floating_point() or not bool(torch.isfinite(value).all()):
        raise SceneError(path, f"{name} must hold finite floats; download the file again")
    return value.float()


def hash_of(path: Path) -> str:
    """SHA-256 of a file; torchvision's file names contain its first digits."""
    with path.open("rb") as file:
        return f"sha256 {hashlib.file_digest(file, 'sha256').hexdigest()}"
