"""Styles: learned from a painting or an edit of a scene, applicable to any scene.

Stored as a file, see `formats.styles`. A style of a painting has a palette and marks, a style of an edit has
an edit. Colors are display-encoded RGB, 0 to 1. Lengths are shares of the shorter side of the painting; if
it is more elongated than 4:3, of the shorter side of a 4:3 picture with the same area.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, F64, U8

StyleKind = Literal["painting", "edit"]


@dataclass(frozen=True, eq=False)
class NamedColor:
    """One color of a palette, with the painting's colors close to it.

    Attributes:
        name: in words, such as "deep blue".
        rgb: [3]; may be edited in the file: the colors close to it change with it.
        share: of the painting, 0 to 1; the shares of a palette sum to 1.
        offsets: [m, 3] colors of the painting minus the learned `rgb`, equally weighted, m >= 1.
    """

    name: str
    rgb: F64
    share: float
    offsets: F32


@dataclass(frozen=True, eq=False)
class StylePalette:
    """The colors of a painting.

    Attributes:
        colors: one or more, most frequent first.
    """

    colors: tuple[NamedColor, ...]

    @property
    def samples(self) -> F64:
        """[S, 3] colors of the painting, for palette matching."""
        return np.concatenate([color.rgb + color.offsets for color in self.colors])

    @property
    def weights(self) -> F64:
        """[S] weights of the samples, sum 1."""
        return np.concatenate(
            [np.full(len(color.offsets), color.share / len(color.offsets)) for color in self.colors]
        )


@dataclass(frozen=True)
class MarkSpectrum:
    """Sizes of the marks in one kind of area: shares of the shorter side at the 20th, 50th, 80th percentile.

    Attributes:
        share: of the painting covered by such areas, 0 to 1.
        lengths: three, ascending, above 0 to 1.
        widths: likewise.
    """

    share: float
    lengths: tuple[float, ...]
    widths: tuple[float, ...]


CALM = 0.2  # share of the marks of a painting that are calm
OF_CALM = 0.5, 0.25  # contrast of the next, over the mean: of paint at least, and of a print at most
RESIDUAL_ZERO = 128  # byte for a residual of 0
RESIDUAL_STEP = 1 / 320  # OKLab per step; residuals are at most 0.4 in size


@dataclass(frozen=True, eq=False)
class MarkDictionary:
    """Marks cut out of a painting, with their colors.

    Attributes:
        colors: [n, 3] mean OKLab color of each; the most frequent kinds of marks first.
        shares: [n] share of the painting's marks that are of this kind.
        texels: [n, h, w, 4] picture of each mark, lying along the rows: OKLab residual from the mean color,
            in steps of `RESIDUAL_STEP` from `RESIDUAL_ZERO`; and coverage, 255 is full.
    """

    colors: F32
    shares: F32
    texels: U8

    def __len__(self) -> int:
        return len(self.colors)

    @classmethod
    def of_residuals(cls, colors: F64, residuals: F32, coverage: F32, shares: F64) -> "MarkDictionary":
        """Quantize OKLab means [n, 3], residuals [n, 3, h, w] and coverage [n, h, w], 0 to 1."""
        steps = np.clip(np.rint(residuals / RESIDUAL_STEP) + RESIDUAL_ZERO, 0, 255)
        alpha = np.rint(255 * coverage)[:, None]
        texels = np.concatenate([np.where(alpha > 0, steps, RESIDUAL_ZERO), alpha], axis=1)
        packed = np.ascontiguousarray(np.moveaxis(texels, 1, 3).astype(np.uint8))
        return cls(colors.astype(np.float32), shares.astype(np.float32), packed)

    @property
    def residuals(self) -> F32:
        """[n, h, w, 3] OKLab residuals from the mean colors."""
        return residuals_of(self.texels)

    @cached_property
    def contrasts(self) -> F64:
        """[n] standard deviation of the lightness within each mark, OKLab."""
        weights = self.texels[..., 3].astype(np.float64)
        squares = (weights * self.residuals[..., 0].astype(np.float64) ** 2).sum(axis=(1, 2))
        return np.asarray(np.sqrt(squares / np.maximum(weights.sum(axis=(1, 2)), 1)))

    @property
    def mean_contrast(self) -> float:
        """Mean contrast of the painting's marks, OKLab."""
        return float(np.average(self.contrasts, weights=self.shares))

    def factors_at(self, ranks: F64) -> F64:
        """Quantiles of the contrast over its mean, at `ranks` (0 to 1, any shape); 1 without any contrast."""
        mean = self.mean_contrast
        if mean == 0:
            return np.ones_like(ranks)
        order = np.argsort(self.contrasts, kind="stable")
        shares = self.shares[order].astype(np.float64)
        return np.interp(
            ranks, (np.cumsum(shares) - 0.5 * shares) / shares.sum(), self.contrasts[order] / mean
        )

    def calmest(self, share: float) -> NDArray[np.intp]:
        """Rows, ascending, of the kinds of least contrast: this share of the painting, at least one."""
        order = np.argsort(self.contrasts, kind="stable")
        sums = np.cumsum(self.shares[order].astype(np.float64))
        num = int(np.searchsorted(sums, share * sums[-1] - 1e-9)) + 1
        return np.sort(order[:num])

    def at(self, rows: NDArray[np.intp]) -> "MarkDictionary":
        """These kinds of marks."""
        return MarkDictionary(self.colors[rows], self.shares[rows], self.texels[rows])

    def first(self, num: int) -> "MarkDictionary":
        """The `num` most frequent kinds of marks."""
        return self.at(np.arange(min(num, len(self))))


def residuals_of(texels: U8) -> F32:
    """[..., 3] OKLab residuals of texels [..., 4] of marks."""
    return (texels[..., :3].astype(np.float32) - RESIDUAL_ZERO) * np.float32(RESIDUAL_STEP)


@dataclass(frozen=True, eq=False)
class StyleMarks:
    """The marks of a painting.

    Attributes:
        length: of a typical mark, as a share of the painting's shorter side, in (0, 1].
        aspect: its length over its width, 1 to 20.
        directions: [h, w, 2] unit vectors of twice the angle of marks (from +x towards +y), times a
            confidence of 0 to 1; see `brushgs.passes.form.mark_directions`.
        broken_lightness: standard deviation of OKLab lightness between neighboring marks.
        broken_chroma: the same for a and b.
        ground: [3] color that shows between marks; None if none does.
        relief: visibility of the light on ridges of paint, 0 to 1, see `LightConfig.relief`; 0 if unknown:
            the relief of the look is then kept.
        brushes: stroke images cut out of the painting, each [h, w] uint8 coverage with its mark along the
            rows; empty if no mark is isolated.
        coherent: sizes where marks run side by side; None if they do nowhere, or it is unknown.
        incoherent: sizes elsewhere; likewise.
        dictionary: marks with their colors; None if there are none.
    """

    length: float
    aspect: float
    directions: F32
    broken_lightness: float = 0.0
    broken_chroma: float = 0.0
    ground: F64 | None = None
    relief: float = 0.0
    brushes: tuple[U8, ...] = ()
    coherent: MarkSpectrum | None = None
    incoherent: MarkSpectrum | None = None
    dictionary: MarkDictionary | None = None


@dataclass(frozen=True, eq=False)
class StyleStage:
    """Surroundings of the subject of a painting, continued all around, to be used for any other subject.

    Rows go from the top of the wall to the foot of the subject; columns go around it, the last next to the
    first.

    Attributes:
        colors: [h, w, 3] about one pixel per mark, so that nothing larger is copied from the painting.
        directions: [h, w, 2] of marks, see `StyleMarks`.
    """

    colors: F32
    directions: F32


@dataclass(frozen=True, eq=False)
class StyleLines:
    """The dark contours of a painting.

    Attributes:
        share: of the painting covered by such lines, 0 to 1.
        width: of a typical line, a share of the shorter side, above 0.
        rgb: [3] their color.
    """

    share: float
    width: float
    rgb: F64


@dataclass(frozen=True, eq=False)
class Residual:
    """The part of an edit beyond its affine map: a sum of Gaussian bumps over the features of a stroke.

    Each adds bump x (weights + slopes @ color before), a local change of the affine map.

    Attributes:
        features: names of the F features, see `brushgs.passes.style.features`.
        centers: [K, F] of the bumps, in standard deviations of the features.
        width: of the bumps, in standard deviations, > 0.
        weights: [K, C] added to the C outputs: RGB, then log size, see `StyleEdit`.
        offset: [F] feature means, subtracted first.
        scale: [F] feature standard deviations, divided by next, > 0.
        slopes: [K, 3, 3] added to the matrix of the affine map; None: zero.
    """

    features: tuple[str, ...]
    centers: F32
    width: float
    weights: F32
    offset: F32
    scale: F32
    slopes: F32 | None = None


@dataclass(frozen=True, eq=False)
class StyleEdit:
    """An edit of a scene, as a function of stroke color and features.

    Attributes:
        affine: [3, 4] color after = affine[:, :3] @ color before + affine[:, 3].
        log_size: added to the logarithm of sizes.
        residual: the rest; None if there is none.
    """

    affine: F64
    log_size: float = 0.0
    residual: Residual | None = None


@dataclass(frozen=True, eq=False)
class Style:
    """A style of a painting or of an edit.

    Attributes:
        name: for reports.
        palette: of a painting; else None.
        marks: of a painting; None for a style of colors only.
        edit: of an edit; else None.
        stage: of a painting; None for the surroundings of the look.
        lines: of a painting; None if it has no contours.
    """

    name: str
    palette: StylePalette | None = None
    marks: StyleMarks | None = None
    edit: StyleEdit | None = None
    stage: StyleStage | None = None
    lines: StyleLines | None = None

    def __repr__(self) -> str:
        facts = [] if self.palette is None else [f"{len(self.palette.colors)} colors"]
        if self.marks is not None:
            facts += ["marks"]
            facts += [f"{len(self.marks.brushes)} brushes"] if self.marks.brushes else []
            facts += [f"{len(self.marks.dictionary)} marks of its own"] if self.marks.dictionary else []
        facts += [] if self.edit is None else ["an edit"]
        return f"Style({', '.join([repr(self.name), *facts])})"

    @property
    def flatness(self) -> float:
        """How far a painting is a print, 0 to 1: dark contours, and between them large areas of one color.

        Brushes leave contrast in the calmest marks as well, at least half of the mean of all marks.
        """
        if self.lines is None or self.marks is None or self.marks.dictionary is None:
            return 0.0
        calm = float(self.marks.dictionary.factors_at(np.array(CALM)))
        paint, flat = OF_CALM
        return float(np.clip((paint - calm) / (paint - flat), 0, 1))

    @property
    def kind(self) -> StyleKind:
        """Source of the style: "edit" if it has an edit, else "painting"."""
        return "painting" if self.edit is None else "edit"
