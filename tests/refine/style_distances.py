"""How far strokes are from a painting in colours and directions; weights that are random."""

from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812

from brushgs.passes.color.recolor import Palette
from brushgs.refine.filter_bank import REACH, oriented_filters
from brushgs.values.colors import LUMINANCE

PATCH = 9  # pixels of a scale, that are neighbours
VGG_16 = (64, 64, 0, 128, 128, 0, 256, 256, 256)


def distances(strokes, validation_views, drawing, painting) -> tuple[float, float, float]:
    """Distance of the colours, of 255, and of the directions, 0 to 1; grain of the strokes."""
    background = painting[..., :3].mean(axis=(0, 1))
    colors, weights, energies = [], [], 0.0
    for view in validation_views:
        frame = drawing.frame(strokes, view.camera)
        shown = frame.alpha > 0.05
        colors.append(np.clip(frame.rgb[shown] / frame.alpha[shown][:, None], 0, 1))
        weights.append(frame.alpha[shown])
        energies = energies + _energies(frame.over(background), frame.alpha)
    own = Palette.of_colors(np.concatenate(colors), np.concatenate(weights), space="srgb")
    wanted = Palette.of_image(painting, space="srgb")
    spread = np.linalg.norm(_root(own.covariance) - _root(wanted.covariance))
    away = 255 * (np.linalg.norm(own.mean - wanted.mean) + spread)
    there = _energies(painting[..., :3], np.ones(painting.shape[:2]))
    turned = 0.5 * np.abs(_shares(energies) - _shares(there)).sum(axis=1).mean()
    return float(away), float(turned), _grain(energies)


def _energies(picture, alpha):
    """[3, 9] energy of edges by scale and direction, and of what patches agree on, where all is painted."""
    angles = 2 * np.pi * np.arange(8) / 8  # of a half turn, doubled
    axes = torch.tensor(np.stack([np.cos(angles), np.sin(angles)]), dtype=torch.float32)
    luminance = torch.from_numpy(np.asarray(picture @ np.array(LUMINANCE), dtype=np.float32))[None, None]
    painted, found = torch.from_numpy((alpha > 0.5).astype(np.float32))[None, None], []
    for scale in (1, 2, 4):
        padded = F.pad(F.avg_pool2d(luminance, scale), (REACH,) * 4, mode="replicate")
        energy = F.conv2d(padded, oriented_filters()[:8, None])[0].square()
        inside = 1 - F.max_pool2d(1 - F.avg_pool2d(painted, scale), 2 * REACH + 1, 1, REACH)[0]
        energy = energy * (inside > 0.99)
        agreed = F.avg_pool2d(torch.einsum("ak,khw->ahw", axes, energy), PATCH)
        both = F.avg_pool2d(energy, PATCH).sum().clamp_min(1e-12)
        whole = energy.sum(dim=(1, 2))
        found.append(torch.cat([whole, (whole.sum() * agreed.norm(dim=0).sum() / both)[None]]))
    return torch.stack(found).numpy()


def _shares(energies):
    directions = energies[:, :8]
    return directions / np.maximum(directions.sum(axis=1, keepdims=True), 1e-12)


def _grain(energies) -> float:
    return float((energies[:, 8] / np.maximum(energies[:, :8].sum(axis=1), 1e-12)).mean())


def _root(covariance):
    values, axes = np.linalg.eigh(covariance)
    return (axes * np.sqrt(np.maximum(values, 0))) @ axes.T


def save_random_vgg(path: Path) -> None:
    """A file of torchvision's layout of VGG-16 as far as it is read, random (He et al. 2015)."""
    torch.manual_seed(0)
    state, place, channels = {}, 0, 3
    for width in VGG_16:
        if width == 0:
            place += 1
            continue
        state[f"features.{place}.weight"] = torch.randn(width, channels, 3, 3) * (2 / (9 * channels)) ** 0.5
        state[f"features.{place}.bias"] = torch.zeros(width)
        place, channels = place + 2, width
    torch.save(state, path)
