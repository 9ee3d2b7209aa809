"""Steps of the refinement in plain torch and by kornia: time forward and backward, and how results differ.

    python -m tests.bench.kornia_candidates [--repeats 15] [--threads 2]

Both take turns in one process, so that other work on the machine slows both; times are medians of wall clock,
and "ratio" is the median over the turns of kornia over plain torch. Differences are of the values and of the
gradients by the picture: the largest absolute one over the largest absolute value of plain torch.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import kornia
import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

from brushgs.refine import filter_bank, losses, photometric, vgg
from brushgs.values.colors import LUMINANCE
from tests.bench.machine import describe

SIZES = ((384, 288), (1280, 720))


@dataclass(frozen=True)
class Candidate:
    """Two functions of a picture [H, W, C], and of a second one beside it."""

    name: str
    channels: int  # of the pictures
    own: Callable[[Tensor, Tensor], Tensor]
    other: Callable[[Tensor, Tensor], Tensor]


def _batch(picture: Tensor) -> Tensor:
    """[1, C, H, W]."""
    return picture.permute(2, 0, 1)[None]


def ssim(a: Tensor, b: Tensor) -> Tensor:
    return kornia.metrics.ssim(_batch(a), _batch(b), 11).mean()


def ssim_strided(a: Tensor, b: Tensor) -> Tensor:
    """Every second pixel of the map, which is what the own SSIM averages."""
    return kornia.metrics.ssim(_batch(a), _batch(b), 11)[..., ::2, ::2].mean()


def total_variation(a: Tensor, b: Tensor) -> Tensor:
    return kornia.losses.total_variation(a.permute(2, 0, 1), reduction="mean").mean()


def luminance(a: Tensor, b: Tensor) -> Tensor:
    return torch.einsum("hwc,c->hw", a, torch.tensor(LUMINANCE))


def luminance_kornia(a: Tensor, b: Tensor) -> Tensor:
    return kornia.color.rgb_to_grayscale(a.permute(2, 0, 1), torch.tensor(LUMINANCE))[0]


def halves(a: Tensor, b: Tensor) -> Tensor:
    return F.avg_pool2d(_batch(a), 2, ceil_mode=True)


def halves_kornia(a: Tensor, b: Tensor) -> Tensor:
    return kornia.geometry.transform.pyrdown(_batch(a))


def pyramid(a: Tensor, b: Tensor) -> Tensor:
    picture = _batch(a)
    return torch.cat(
        [picture.flatten(), *(F.avg_pool2d(picture, s, ceil_mode=True).flatten() for s in (2, 4))]
    )


def pyramid_kornia(a: Tensor, b: Tensor) -> Tensor:
    return torch.cat([level.flatten() for level in kornia.geometry.transform.build_pyramid(_batch(a), 3)])


def filters(a: Tensor, b: Tensor) -> Tensor:
    padded = F.pad(a[None, None, ..., 0], (filter_bank.REACH,) * 4, mode="replicate")
    return F.conv2d(padded, filter_bank.oriented_filters()[:, None])


def filters_grouped(a: Tensor, b: Tensor) -> Tensor:
    """The same as 16 filters of one channel each, which oneDNN convolves faster."""
    weights = filter_bank.oriented_filters()[:, None]
    padded = F.pad(a[None, None, ..., 0], (filter_bank.REACH,) * 4, mode="replicate")
    return F.conv2d(padded.expand(1, len(weights), -1, -1), weights, groups=len(weights))


def filters_kornia(a: Tensor, b: Tensor) -> Tensor:
    weights = filter_bank.oriented_filters()
    picture = a[None, None, ..., 0].expand(len(weights), 1, -1, -1)  # kornia takes one kernel per batch row
    return kornia.filters.filter2d(picture, weights, border_type="replicate").transpose(0, 1)


def gradients_kornia(a: Tensor, b: Tensor) -> Tensor:
    """Sobel gradients of first and second order, 5 maps: two directions, one width."""
    picture = a[None, None, ..., 0]
    first = kornia.filters.spatial_gradient(picture, "sobel", 1)[0, 0]
    second = kornia.filters.spatial_gradient(picture, "sobel", 2)[0, 0]
    return torch.cat([first, second])


def pool(a: Tensor, b: Tensor) -> Tensor:
    return filter_bank._pool(a.permute(2, 0, 1), filter_bank.STRIDES[0])


def pool_kornia(a: Tensor, b: Tensor) -> Tensor:
    size = 2 * filter_bank.POOL_REACH + 1
    sigma = (filter_bank.POOL_SIGMA, filter_bank.POOL_SIGMA)
    blurred = kornia.filters.gaussian_blur2d(_batch(a), (size, size), sigma, "replicate")
    return blurred[0, :, :: filter_bank.STRIDES[0], :: filter_bank.STRIDES[0]]


def blur_pool_kornia(a: Tensor, b: Tensor) -> Tensor:
    """Binomial weights of the same width (17 taps), not separable."""
    return kornia.filters.blur_pool2d(_batch(a), 17, filter_bank.STRIDES[0])[0]


def normalized(a: Tensor, b: Tensor) -> Tensor:
    mean, std = (torch.tensor(v).view(3, 1, 1) for v in (vgg._MEAN, vgg._STD))
    return (a.permute(2, 0, 1) - mean) / std


def normalized_kornia(a: Tensor, b: Tensor) -> Tensor:
    mean, std = torch.tensor(vgg._MEAN), torch.tensor(vgg._STD)
    return kornia.enhance.normalize(_batch(a), mean, std)[0]


def color_distance(a: Tensor, b: Tensor) -> Tensor:
    return losses.color_distance(a, torch.ones(a.shape[:2]), b.mean(dim=(0, 1)), 0.05 * torch.eye(3))


def color_distance_lab(a: Tensor, b: Tensor) -> Tensor:
    """The same of CIELAB colours."""
    lab = kornia.color.rgb_to_lab(_batch(a))[0].permute(1, 2, 0) / 100
    return losses.color_distance(lab, torch.ones(a.shape[:2]), b.mean(dim=(0, 1)), 0.05 * torch.eye(3))


CANDIDATES = (
    Candidate("ssim: metrics.ssim", 4, photometric.ssim, ssim),
    Candidate("ssim: metrics.ssim[::2, ::2]", 4, photometric.ssim, ssim_strided),
    Candidate(
        "total_variation: losses.total_variation", 3, lambda a, b: losses.total_variation(a), total_variation
    ),
    Candidate("luminance: color.rgb_to_grayscale", 3, luminance, luminance_kornia),
    Candidate("pyramid: transform.build_pyramid", 3, pyramid, pyramid_kornia),
    Candidate("edges and lines: filters.filter2d", 1, filters, filters_kornia),
    Candidate("grouped edges and lines: filters.filter2d", 1, filters_grouped, filters_kornia),
    Candidate("edges and lines: filters.spatial_gradient", 1, filters, gradients_kornia),
    Candidate("pooling: filters.gaussian_blur2d[::4, ::4]", 22, pool, pool_kornia),
    Candidate("pooling: filters.blur_pool2d", 22, pool, blur_pool_kornia),
    Candidate("VGG input: enhance.normalize", 3, normalized, normalized_kornia),
    Candidate("color_distance: in color.rgb_to_lab", 3, color_distance, color_distance_lab),
)


def once(
    function: Callable[[Tensor, Tensor], Tensor], a: Tensor, b: Tensor, v: Tensor
) -> tuple[float, Tensor]:
    """Seconds of value and gradient by the picture, and that gradient."""
    leaf = a.clone().requires_grad_()
    start = time.perf_counter()
    function(leaf, b).backward(v)
    return time.perf_counter() - start, leaf.grad


def difference(own: Tensor, other: Tensor) -> str:
    if own.shape != other.shape:
        return "-"
    return f"{float((own - other).abs().max() / own.abs().max().clamp_min(1e-30)):.1e}"


def measure(candidate: Candidate, width: int, height: int, repeats: int) -> str:
    torch.manual_seed(0)
    coarse = torch.rand(2, candidate.channels, height // 8, width // 8)
    fine = F.interpolate(coarse, (height, width), mode="bilinear") + 0.1 * torch.rand(
        2, candidate.channels, height, width
    )
    a, b = (0.9 * fine).clamp(0, 1).permute(0, 2, 3, 1).contiguous()
    values = [function(a, b) for function in (candidate.own, candidate.other)]
    weights = [torch.rand_like(value) for value in values]
    if values[0].shape == values[1].shape:
        weights[1] = weights[0]
    functions, seconds, slopes = (candidate.own, candidate.other), ([], []), [None, None]
    for turn in range(repeats + 1):
        for which in ((0, 1), (1, 0))[turn % 2]:
            spent, slopes[which] = once(functions[which], a, b, weights[which])
            if turn:  # the first warms up
                seconds[which].append(spent)
    own, other = (1e3 * float(np.median(s)) for s in seconds)
    ratio = float(np.median(np.divide(seconds[1], seconds[0])))
    cells = [candidate.name, f"{width}x{height}", f"{own:.2f}", f"{other:.2f}", f"{ratio:.2f}"]
    cells += [difference(*values), difference(*slopes) if values[0].shape == values[1].shape else "-"]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=15)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    torch.set_num_threads(args.threads)
    print(describe() + f"; torch {torch.__version__}, kornia {kornia.__version__}, {args.threads} threads\n")
    heads = ("step: by kornia", "size", "torch ms", "kornia ms", "ratio", "value", "gradient")
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for candidate in CANDIDATES:
        for width, height in SIZES:
            print(measure(candidate, width, height, args.repeats), flush=True)


if __name__ == "__main__":
    main()
