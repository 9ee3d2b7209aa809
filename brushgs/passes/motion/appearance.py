"""Appearance of the Gaussians of one moment, for matching them to another."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from brushgs.passes.extent import robust_frame
from brushgs.passes.motion.matter import Matter
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.features import SceneFrame, contracted
from brushgs.passes.reduce.morton import morton_order
from brushgs.values.arrays import F32, F64, Array, Mask, Rows

NUM_SPACED = 2000  # Gaussians sampled to measure the spacing
NUM_COMPARED = 500  # Gaussians sampled to estimate common growth and change of light
UNLIKE = 0.5  # upper clamp of distances of looks
LEAST_SPACING = 1e-5  # radii of the scene, for scenes where most Gaussians coincide
FLATTEST = 6.0  # log sizes are clamped to the median of the largest minus this


@dataclass(frozen=True, eq=False)
class Appearance:
    """Positions and looks of n Gaussians.

    Attributes:
        means: [n, 3] world units.
        looks: [n, 6] logarithms of the sizes, ascending, and RGB, 0 to 1.
        normals: [n, 3] shortest axis; its length is the flatness, 0 (balls and needles) to 1.
        weights: [n] > 0.
        frame: center and radius of the scene at the moment.
        order: [n] rows along a space-filling curve.
    """

    means: F64
    looks: F64
    normals: F64
    weights: F64
    frame: SceneFrame
    order: Rows

    @classmethod
    def of(cls, matter: Matter) -> "Appearance":
        """The appearance of n >= 1 Gaussians."""
        lengths = np.linalg.norm(matter.axes, axis=1)
        logs = np.log(np.maximum(lengths, 1e-300))
        logs = np.maximum(logs, np.median(logs[:, 2]) - FLATTEST)
        looks = np.concatenate([logs, matter.colors], axis=1)
        flatness = 1 - lengths[:, :1] / np.maximum(lengths[:, 1:2], 1e-300)
        normals = flatness * matter.axes[:, :, 0] / np.maximum(lengths[:, :1], 1e-300)
        largest = max(float(matter.masses.max()), 1e-300)
        weights = np.maximum(matter.masses / largest, 1e-8) ** 0.25
        return cls(matter.means, looks, normals, weights, robust_frame(matter.means), matter.order)

    def __len__(self) -> int:
        return len(self.means)

    def take(self, rows: Rows, means: F64) -> "Appearance":
        """Some of the Gaussians, at new positions."""
        return replace(
            self,
            means=means,
            looks=self.looks[rows],
            normals=self.normals[rows],
            weights=self.weights[rows],
            order=np.arange(len(rows)),
        )

    def joined(self, more: "Appearance") -> "Appearance":
        """These Gaussians followed by others, in the frame of these."""
        if len(more) == 0:
            return self
        columns: dict[str, Any] = {
            name: np.concatenate([getattr(self, name), getattr(more, name)])
            for name in ("means", "looks", "normals", "weights")
        }
        places = contracted(columns["means"], self.frame)[0].astype(np.float32)
        return replace(self, **columns, order=morton_order(places))

    def in_light_of(self, other: "Appearance") -> "Appearance":
        """The same with the common growth and change of light since another moment removed.

        It is the difference of means or of medians, or none, whichever makes the looks most similar.
        """
        shifts = (middle(self.looks, axis=0) - middle(other.looks, axis=0) for middle in (np.mean, np.median))
        tried = [self.looks, *(self.looks - shift for shift in shifts)]
        rows = np.random.default_rng(0).permutation(len(self))[:NUM_COMPARED]
        away = [
            float(np.minimum(among(looks[rows].astype(np.float32), other.looks)[0], UNLIKE).mean())
            for looks in tried
        ]
        return replace(self, looks=tried[int(np.argmin(away))])

    @cached_property
    def spacing(self) -> float:
        """Median distance of a Gaussian to the nearest other, in contracted radii of the scene."""
        if len(self) < 2:
            return 1.0
        some = np.random.default_rng(0).permutation(len(self))[:NUM_SPACED]
        return max(float(np.median(nearest(self.centered, self.centered[some], 2)[0][:, 1])), LEAST_SPACING)

    @cached_property
    def centered(self) -> F64:
        """Positions [n, 3] in radii of the scene from its center, contracted far from it."""
        return contracted(self.means, self.frame)[0]

    @cached_property
    def own_places(self) -> F64:
        """`places` of the means, [n, 3]."""
        return self.centered / self.spacing

    def places(self, means: F64) -> F64:
        """World points [q, 3] in spacings of this moment, contracted far from its center."""
        return contracted(means, self.frame)[0] / self.spacing

    def keys(self, places: F64, looks: F64, unit: float, weight: float = 1.0) -> F32:
        """Search keys [q, 9]: `places` [q, 3] in `unit` spacings, and looks [q, 6] times `weight`."""
        return np.concatenate([places / unit, weight * looks], axis=1, dtype=np.float32)


def among(keys: F32, others: Array) -> tuple[F64, Rows]:
    """Distances of keys to the nearest of others, and its rows, [q] each."""
    from brushgs.passes.reduce.lloyd import assign

    distances, rows = assign(np.ascontiguousarray(keys), np.ascontiguousarray(others, np.float64))
    return distances, rows.astype(np.intp)


def mutual_nearest(keys: F32, others: F32) -> tuple[F64, Rows, Mask]:
    """As `among`, and whether the pair is a mutual nearest neighbor, [q]."""
    distances, rows = among(keys, others)
    return distances, rows, among(others, keys)[1][rows] == np.arange(len(keys))
