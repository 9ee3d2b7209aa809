"""The materials of every medium: strokes, their brushes, and functions that alter strokes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from brushgs.options.look_parts import ColorConfig
from brushgs.options.media import DrawingMedium, Medium
from brushgs.pipeline.background import Background
from brushgs.pipeline.stroke_pass import nearest_regions
from brushgs.pipeline.styling import Contour
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors, seen_from

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.pipeline.media.motif import Motif
    from brushgs.pipeline.media.sight import Sight
    from brushgs.values.arrays import F64
    from brushgs.values.lines import Lines

M = TypeVar("M", bound=Medium)
BACKDROP = "backdrop"  # name of the coat around the strokes of a scene
CUT_IN = "cutting in"  # of strokes of a stage along the outline of its subject, in one view
ACCENTS = "accents"  # of pure lights and darks, which are laid last
Color = tuple[float, float, float]
CONTOUR_STRENGTH = 0.35  # of edges from which styles have contours
CONTOUR_OVERLAP = 1.7  # of their pieces, which are wide: with less the overlaps of their soft ends show
SIDE, MOST_VIEWS = 240, 3  # pixels, longer side of the views in which areas are measured, and their number
IS_PAINTED, FULL = (
    0.5,
    0.9,
)  # coverage of a painted pixel, and share of a picture that strokes paint in a room
LINE_TOLERANCE = (
    20.0  # times that of marks: a line is thin, and its own size says little about what it lies on
)


@dataclass(frozen=True, eq=False)
class Materials:
    """Inputs of a medium.

    Attributes:
        strokes: the strokes of the painting, N.
        texture: their stroke image, or images.
        options: how they are drawn.
        media: the numbers of the medium.
        color: how tones are computed.
        ground: unpainted pixels, RGB [3] or [H, W, 3]; None if transparent.
        lines: along edges of the scene; None if the medium has none.
        line_texture: their stroke image, or images.
        contour: how the lines of styles look; None without.
        cameras: of the job, or none.
        sight: the views of the job; None if the medium does not look at them.
        towards: [3] unit vector toward the lamp, world axes; None if not known.
        is_bare: whether no stage lies behind the strokes.
        motif: whose values a drawing keeps; None if strokes have others, or the medium does not look.
        is_film: whether many frames are painted.
        foot: [4] see `Place.above`; None if it is not known where the subject stands.
    """

    strokes: Gaussians
    texture: "StrokeTexture | BrushSet"
    options: RenderOptions
    media: Medium
    color: ColorConfig
    ground: Background
    lines: "Lines | None" = None
    line_texture: "StrokeTexture | BrushSet | None" = None
    contour: Contour | None = None
    cameras: Sequence[Camera] = ()
    sight: "Sight | None" = None
    towards: "F64 | None" = None
    is_bare: bool = False
    motif: "Motif | None" = None
    is_film: bool = False
    foot: "F64 | None" = None

    @cached_property
    def paper(self) -> Color:
        """One color for the ground, which drawing media leave open and mix their greys with."""
        if self.ground is None:
            return 1.0, 1.0, 1.0
        ground = np.asarray(self.ground)  # plane by plane: pairwise sums, and no copy in double
        red, green, blue = (float(ground[..., c].mean(dtype=np.float64)) for c in range(3))
        return red, green, blue

    @cached_property
    def tones(self) -> "F64":
        """[N] 0 (black) to 1 (white)."""
        from brushgs.passes.color.tone import tones

        return tones(self.shown, local=self.color.local, equalized=self.color.equalize)

    @cached_property
    def shown(self) -> Gaussians:
        """The strokes in the colors that the views of the job show on average, with their highlights.

        Tones are theirs: of a shiny scene, base colors are those of no view.
        """
        from brushgs.cameras.around import path_views

        if not self.cameras or self.strokes.sh_degree == 0:
            return self.strokes
        views = path_views(self.cameras)
        colors = [base_colors(seen_from(self.strokes, camera.position).sh) for camera in views]
        return in_colors(self.strokes, np.mean(colors, axis=0))

    @cached_property
    def areas(self) -> "F64":
        """[N] paint of each stroke in the views of the job; in space if no view shows any."""
        from brushgs.passes.color.tone import painted_areas
        from brushgs.passes.seen import shown_areas, some_small

        areas = shown_areas(self.strokes, some_small(self.cameras, MOST_VIEWS, SIDE))
        return areas if areas.any() else painted_areas(self.strokes)

    @cached_property
    def is_room(self) -> bool:
        """Whether the strokes fill the views of the job."""
        from brushgs.passes.seen import some_small
        from brushgs.rendering.render import render

        views = some_small(self.cameras, MOST_VIEWS, SIDE) if self.cameras else []
        return fill([render(self.strokes, view, "gaussian", depth=False) for view in views])

    @cached_property
    def solidity(self) -> "F64":
        """[N] 0 to 1, solidity of a stroke as paint; faint strokes are drawn fainter still."""
        return np.asarray(np.minimum(2 * self.strokes.opacities.astype(np.float64), 1))

    def marks(self, name: str, strokes: Gaussians, *, dry: float) -> Coat:
        """A coat of separate marks: without underpaint and streaks, and only on visible surfaces."""
        options = self.options.for_marks(self.texture)
        return Coat(name, strokes, self.texture, options, dry=dry, tolerance=self.media.behind)

    def glaze(self, name: str, strokes: Gaussians, *, dry: float) -> Coat:
        """A coat of transparent marks, which multiply the colors below."""
        return replace(self.marks(name, strokes, dry=dry), blend="glaze")

    def smudge(self, name: str, strokes: Gaussians) -> Coat:
        """A coat of soft tone: each stroke as the kernel "gaussian"."""
        from brushgs.brushes.texture import StrokeTexture

        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_threads=self.options.num_threads)
        return Coat(name, strokes, kernel, options)

    def contours(self) -> list[Coat]:
        """The coat of contours of styles; none where they have none."""
        contour = self.contour
        if contour is None:
            return []
        coats = self.line_coat(
            contour.color, opacity=contour.opacity, dry=0.0, strength=CONTOUR_STRENGTH, along=CONTOUR_OVERLAP
        )
        return [replace(coat, options=replace(coat.options, relief=None)) for coat in coats]

    def line_coat(
        self, color: Color, *, opacity: float, dry: float, strength: float | None = None, along: float = 1.0
    ) -> list[Coat]:
        """A coat of lines along edges, of at least a strength; none where there are no lines.

        Their pieces are `along` times as long.
        """
        if self.lines is None or self.line_texture is None or opacity == 0:
            return []
        if strength is None:
            strength = numbers_of(DrawingMedium, self).line_strength
        shown = self.lines.stronger_than(strength)
        if len(shown) == 0:
            return []
        strokes = in_colors(
            scaled(shown.strokes, along, 1.0, opacities=opacity * shown.strokes.opacities), color
        )
        strokes = nearest_regions(self.strokes, strokes)
        options = self.options.for_marks(self.line_texture)
        return [
            Coat(
                "lines",
                strokes,
                self.line_texture,
                options,
                dry=dry,
                tolerance=self.media.behind * LINE_TOLERANCE,
                normals=shown.normals,
                chains=shown.chains,
            )
        ]


def numbers_of(kind: type[M], materials: Materials) -> M:
    """The options of the medium of these materials."""
    assert isinstance(materials.media, kind), f"coats of {kind.__name__} for {materials.media}"
    return materials.media


def scaled(strokes: Gaussians, along: float, across: float, *, opacities: Array | None = None) -> Gaussians:
    """Strokes with other lengths along and across, and other opacities, clipped to 1."""
    order = np.argsort(-strokes.scales, axis=1)
    factors = np.ones_like(strokes.scales)
    rows = np.arange(len(strokes))
    factors[rows, order[:, 0]], factors[rows, order[:, 1]] = along, across
    changed = replace(strokes, scales=strokes.scales * factors)
    if opacities is None:
        return changed
    return replace(changed, opacities=np.clip(opacities, 0, 1).astype(strokes.opacities.dtype))


def fill(frames: Sequence[Frame]) -> bool:
    """Whether strokes fill pictures of them, as those of a room do; no pictures are not full."""
    return bool(frames) and float(np.mean([np.mean(frame.alpha > IS_PAINTED) for frame in frames])) > FULL


def mixed(paper: Color, colors: ArrayLike, shares: Array) -> Array:
    """[N, 3] colors between that of the paper (share 0) and others (1), [3] or [N, 3]."""
    start = np.asarray(paper)
    return np.asarray(start + (np.asarray(colors) - start) * np.asarray(shares)[:, None])
