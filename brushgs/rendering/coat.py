"""Coats: sets of strokes with their options of painting. A painting has one or more, made once for a job."""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Blend
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.project import Directions, ProjectCounts
from brushgs.rendering.relief import keep_relief
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.rendering.canonical import Canonical
    from brushgs.rendering.cut import Cut
    from brushgs.rendering.effect import Effect
    from brushgs.rendering.motion import Pose
    from brushgs.rendering.nested import Nested
    from brushgs.values.arrays import F64, Rows


@dataclass(frozen=True, eq=False)
class Coat:
    """Strokes that are laid together.

    Attributes:
        name: for reports.
        strokes: in space.
        texture: brush or brushes.
        options: for rendering.
        blend: "cover", or "glaze" to multiply with what lies below.
        dry: share of the paper's tooth that marks leave open, 0 to 1; see `press`.
        tolerance: of the depth test: stroke sizes by which a stroke may lie behind the canvas; None for no
            test.
        border: width of the border in which strokes thin out, see `thin_to_border`; 0 for none.
        normals: [N, 3] for strokes visible only edge-on, see `fade_by_facing`; None for others.
        is_one_sided: strokes with normals fade when seen from behind instead.
        is_flat: strokes are pictures on flat pieces of a surface, at most 256, see `flat`.
        plain: Gaussians shown unpainted among the strokes, by the last brush, see `showing`; or None. The ids
            of their boxes follow those of the strokes.
        fields: of directions of the strokes, for the lock "canonical"; or None.
        nested: levels of strokes that keep their density on paper; None if all strokes show in every view.
        chains: [N] number of the line that each stroke is a piece of, ascending, with pieces in order; None
            if strokes are not lines.
        layers: [N] of flat strokes: of two on one surface, that of the higher layer covers; or None.
        cut: discs in which strokes are erased; or None.
        distances: [N] that stand for the depths of the strokes in every view, in their order and in frames,
            see `fixed_order`; None for depths.
        holds: [N] frames for which the drawing of each stroke is held, >= 1; None for the hold of its part.
        effect: function applied to their picture (as covering paint) before it is laid; None for none.
    """

    name: str
    strokes: Gaussians
    texture: StrokeTexture | BrushSet
    options: RenderOptions
    blend: Blend = "cover"
    dry: float = 0.0
    tolerance: float | None = None
    border: float = 0.0
    normals: Array | None = field(default=None, kw_only=True)
    is_one_sided: bool = field(default=False, kw_only=True)
    is_flat: bool = field(default=False, kw_only=True)
    plain: Gaussians | None = field(default=None, kw_only=True)
    fields: "Canonical | None" = field(default=None, kw_only=True)
    nested: "Nested | None" = field(default=None, kw_only=True)
    chains: "Rows | None" = field(default=None, kw_only=True)
    layers: "Rows | None" = field(default=None, kw_only=True)
    cut: "Cut | None" = field(default=None, kw_only=True)
    distances: "F64 | None" = field(default=None, kw_only=True)
    holds: "Rows | None" = field(default=None, kw_only=True)
    effect: "Effect | None" = field(default=None, kw_only=True)

    @property
    def needs_depth(self) -> bool:
        """Whether its own frame must have a depth."""
        return self.effect is not None or self.cut is not None

    @property
    def is_curves(self) -> bool:
        """Whether its strokes are pieces of curves, which show and fade as wholes; hatching is marks."""
        return self.chains is not None and self.nested is None

    def posed(self, pose: "Pose", *, takes_light: bool = True) -> "Coat":
        """The coat at a moment of a moving scene; `takes_light` as `has_color` of `Pose.moved`."""
        normals = None if self.normals is None else pose.turned(self.strokes, self.normals)
        strokes = pose.moved(self.strokes, has_color=takes_light)
        if self.options.relief is not None:
            keep_relief(strokes, self.strokes)
        nested = self.nested
        if nested is not None:
            nested = replace(nested, gaps=pose.turned(self.strokes, nested.gaps))
        plain = None if self.plain is None else pose.moved(self.plain)
        fields = self.fields
        if fields is not None:
            fields = fields.turned(partial(pose.turned, self.strokes))
        cut = None if self.cut is None else self.cut.posed(pose)
        return replace(
            self, strokes=strokes, normals=normals, nested=nested, plain=plain, fields=fields, cut=cut
        )

    def showing(self, plain: Gaussians) -> "Coat":
        """The coat with plain Gaussians among its strokes; without its effect, which would change them too.

        Raises:
            ValueError: if its strokes use a kernel other than that of 3DGS.
        """
        from brushgs.rendering.among import with_soft_brush

        texture, options = with_soft_brush(self.texture, self.options)
        return replace(self, texture=texture, options=options, plain=plain, effect=None)

    def boxes(self, camera: Camera, directions: Directions | None = None) -> tuple[Boxes, ProjectCounts]:
        """The boxes of one view, and cull counts."""
        options = self.options
        if directions is None and self.fields is not None:
            directions = self.fields.directions(self.strokes, camera, options)
        options = options if directions is None else options.in_direction(directions)
        boxes, counts = project_with(self.strokes, camera, options)
        if self.distances is not None:
            from brushgs.rendering.fixed_order import in_fixed_order

            boxes = in_fixed_order(boxes, self.distances)
        if self.is_flat:
            from brushgs.rendering.flat import around_outlines, in_order, planes_of

            if self.layers is not None:
                boxes = in_order(boxes, self.strokes, self.layers)
            planes = planes_of(self.strokes, boxes.ids, camera, options.num_sigmas)
            boxes = around_outlines(boxes, planes)
        if self.border:
            from brushgs.rendering.border import thin_to_border

            boxes = thin_to_border(boxes, camera, width=self.border)
        if self.normals is not None:
            from brushgs.rendering.facing import fade_by_facing

            boxes = fade_by_facing(boxes, camera, self.strokes, self.normals, is_one_sided=self.is_one_sided)
        if self.nested is not None:
            boxes = self.nested.of(boxes, self.strokes, camera, self.chains)
        if self.plain is None:
            return boxes, counts
        from brushgs.rendering.among import boxes_among

        brush, first = len(BrushSet.of(self.texture)) - 1, len(self.strokes)
        boxes, culled = boxes_among(boxes, self.plain, camera, self.options, first=first, brush=brush)
        return boxes, counts + culled

    def drawn_in(self, boxes: Boxes, camera: Camera) -> "tuple[Coat, Boxes]":
        """A flat coat and its boxes, with pictures resampled to one view."""
        from brushgs.rendering.flat import drawn_in, planes_of

        planes = planes_of(self.strokes, boxes.ids, camera, self.options.num_sigmas)
        boxes, brush_set = drawn_in(boxes, planes, BrushSet.of(self.texture))
        return replace(self, texture=brush_set), boxes
