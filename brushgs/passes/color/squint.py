"""A picture seen through half-closed eyes: its masses, their values and their temperature.

Input: a picture and a mask of its subject. Output: CIELAB numbers, L* 0 to 100, b* from blue to yellow.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from brushgs.passes.color.color_space import Space
from brushgs.values.arrays import F64, Array, Mask, check, gaussian_weights

BLUR = 0.035  # of the shorter side
LOW, HIGH = 5, 95  # percentiles of L* after the blur, ends of a picture's range
AROUND_LOW, AROUND_HIGH = (0.03, 0.07), (0.93, 0.97)  # shares of sorted pixels that represent these ends
DARKS, LIGHTS = 30, 70  # percentiles on the subject below and above which its darks and lights lie
IS_SUBJECT, IS_GROUND = 0.5, 0.1  # minimum coverage of a subject pixel, and maximum of a ground pixel
FEWEST = 16  # minimum number of pixels of a subject, and of a ground
_LAB = Space("lab")


class ThreeValues(NamedTuple):
    """Median L* of the lights and darks of a subject and of the ground around it; None if not visible."""

    lights: float | None
    darks: float | None
    ground: float | None


class Warmth(NamedTuple):
    """Temperature of a subject.

    Attributes:
        lights: b* of its lights minus that of its darks.
        correlation: of L* and b* of its pixels, -1 to 1; 0 if one of them is constant.
        chroma: mean distance from gray in a* and b*.
        apart: L* of its lights minus that of its darks, after the blur.
    """

    lights: float
    correlation: float
    chroma: float
    apart: float


@dataclass(frozen=True, eq=False)
class Squint:
    """A picture as seen through half-closed eyes.

    Attributes:
        lab: [H, W, 3] CIELAB of the picture.
        values: [H, W] L*, blurred.
        is_subject: [H, W] whether a pixel is covered by the subject.
        is_ground: [H, W] whether it is hardly covered.
    """

    lab: F64
    values: F64
    is_subject: Mask
    is_ground: Mask

    @classmethod
    def of(cls, picture: Array, subject: Array) -> "Squint":
        """Squint at a picture.

        Args:
            picture: [H, W, 3] display-encoded, opaque; clipped to 0 to 1.
            subject: [H, W] 0 to 1: coverage by its subject.

        Raises:
            ValueError: if the sizes differ or there are no pixels.
        """
        check("Squint", picture=(picture, "H W 3"), subject=(subject, "H W"))
        if subject.size == 0:
            raise ValueError("Squint: a picture must have pixels, got none")
        inside = np.clip(np.asarray(picture, np.float64), 0, 1)
        lab = lab_of(inside.reshape(-1, 3)).reshape(inside.shape)
        is_subject = subject > IS_SUBJECT
        return cls(lab, squinted(lab[..., 0]), is_subject, subject < IS_GROUND)

    @property
    def range(self) -> float:
        """From the 5th to the 95th percentile of L* after the blur."""
        low, high = np.percentile(self.values, (LOW, HIGH))
        return float(high - low)

    @property
    def has_subject(self) -> bool:
        """Whether the subject is large enough for lights and darks."""
        return int(self.is_subject.sum()) >= FEWEST

    @property
    def masses(self) -> tuple[Mask, Mask]:
        """[H, W] the darks and the lights of the subject, by L* after the blur."""
        if not self.has_subject:
            return np.zeros_like(self.is_subject), np.zeros_like(self.is_subject)
        low, high = np.percentile(self.values[self.is_subject], (DARKS, LIGHTS))
        return self.is_subject & (self.values < low), self.is_subject & (self.values > high)

    @property
    def warmth(self) -> Warmth:
        """The temperature of the subject; all 0 if it has no lights or no darks."""
        darks, lights = self.masses
        if not (darks.any() and lights.any()):
            return Warmth(0.0, 0.0, 0.0, 0.0)
        of_subject = self.lab[self.is_subject]
        spread = of_subject.std(axis=0)
        together = float(np.mean((of_subject[:, 0] - of_subject[:, 0].mean()) * of_subject[:, 2]))
        varies = spread[0] > 1e-6 and spread[2] > 1e-6
        return Warmth(
            float(self.lab[lights, 2].mean() - self.lab[darks, 2].mean()),
            together / float(spread[0] * spread[2]) if varies else 0.0,
            float(np.hypot(of_subject[:, 1], of_subject[:, 2]).mean()),
            float(self.values[lights].mean() - self.values[darks].mean()),
        )

    @property
    def three_values(self) -> ThreeValues:
        """The values of the subject's lights and darks, and of the ground."""
        darks, lights = self.masses
        light = self.lab[..., 0]
        medians = (
            float(np.median(light[mask])) if mask.sum() >= FEWEST / 4 else None
            for mask in (lights, darks, self.is_ground)
        )
        return ThreeValues(*medians)


def lab_of(rgb: F64) -> F64:
    """CIELAB [n, 3] of display-encoded colors [n, 3], L* 0 to 100."""
    return 100 * _LAB.to(rgb)


def rgb_of_lab(lab: F64) -> F64:
    """The inverse of `lab_of`, also out of gamut."""
    return _LAB.back(lab / 100)


def squinted(values: F64) -> F64:
    """Maps [..., H, W] with the blur of half-closed eyes; no weight outside."""
    height, width = values.shape[-2:]
    sigma = BLUR * min(height, width)
    # No matrix product: for maps this small its threads cost more than they save.
    rows = np.einsum("...ij,kj->...ik", values, _weights(width, sigma))
    return np.asarray(np.einsum("ki,...ij->...kj", _weights(height, sigma), rows))


def _weights(count: int, sigma: float) -> F64:
    """[count, count] weight of each pixel of a line at each other, with sum 1."""
    weights = gaussian_weights(count, sigma)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
