"""VGG with weights that are random."""

from pathlib import Path

import torch

from brushgs.refine.vgg import CONVOLUTIONS, WIDTHS


def random_vgg(depth: int = 16, deepest: int = 512) -> torch.nn.Sequential:
    """The convolutions of torchvision's VGG with its numbering (He et al. 2015).

    Where there would be 512 channels, there are as many as `deepest` says.
    """
    torch.manual_seed(0)
    layers, channels = [], 3
    for width, number in zip(WIDTHS, CONVOLUTIONS[depth], strict=True):
        for _ in range(number):
            convolution = torch.nn.Conv2d(channels, deepest if width == 512 else width, 3, padding=1)
            torch.nn.init.kaiming_normal_(convolution.weight, nonlinearity="relu")
            layers += [convolution, torch.nn.ReLU()]
            channels = convolution.out_channels
        layers.append(torch.nn.MaxPool2d(2))
    return torch.nn.Sequential(*layers)


def save_vgg(path: Path, depth: int = 16) -> Path:
    """A file of torchvision's layout; what lies deeper than is read need not be large."""
    state = random_vgg(depth, 1).state_dict()
    torch.save({f"features.{name}": value for name, value in state.items()}, path)
    return path
