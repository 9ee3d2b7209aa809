"""Lay coats on a canvas, one after the other, to make a picture.

A later coat depends on earlier ones only through the canvas: its coverage, glazes and depth.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import rasterize_with
from brushgs.rendering.project import Directions
from brushgs.rendering.rasterize import Below
from brushgs.rendering.relief import canvas_scale
from brushgs.rendering.wanted import NOTHING, Wanted
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.rendering.day import Day
    from brushgs.rendering.depth_test import DepthTest
    from brushgs.rendering.layers import PaintedView
    from brushgs.rendering.light import Lamp
    from brushgs.rendering.marks import LaidCoat
    from brushgs.rendering.motion import Pose
    from brushgs.rendering.rigs import Rig
    from brushgs.rendering.sheets import SheetMaker
    from brushgs.rendering.surface import Surface
    from brushgs.values.frame import Sheet

CARRIED = 0.5  # share of the height below that shows through a coat, such as threads of canvas
CARRIED_MOVING = 0.0  # the same while the camera moves, see `Painting.is_moving`


class Canvas:
    """The state of one view while it is painted.

    Args:
        camera: gives the size.
        painting: whose coats are laid; of a transparent one height and grain of the surface still apply.
        wanted: requested layers of the frame.
    """

    def __init__(self, camera: Camera, painting: "Painting", wanted: Wanted = NOTHING) -> None:
        surface, part, dpi, is_moving = painting.surface, painting.part, painting.dpi, painting.is_moving
        self._wanted, self._region_names = wanted, painting.region_names
        size = camera.width, camera.height
        self._part, self._dpi, self._scale = part, dpi, canvas_scale(*size, dpi)
        self._painted: Part | None = None  # all of the picture
        reach = None if part is None else painting.reach(camera)
        if part is not None and reach is not None and not wanted.is_any:
            self._painted = part.grown(reach, *size)
        if surface is not None:
            surface = surface.seen_in(camera, self._painted)
        self._laid: list[LaidCoat] = []  # filled if layers need every stroke
        self._sheets = _sheet_maker() if wanted.sheets else None
        self._finished: PaintedView | None = None  # set if any layer is requested
        self._camera, self._surface, self._is_transparent = camera, surface, painting.is_transparent
        self._is_moving, self._hidden = is_moving, 1 - (CARRIED_MOVING if is_moving else CARRIED)
        self._frame: Frame | None = None  # of the strokes alone
        self._tint: Array | None = None  # [H, W, 3] product of all glazes over the ground

    def lay(self, coat: Coat, boxes: Boxes) -> Frame:
        """Lay the boxes of a coat; returns its own frame, whose arrays the next call overwrites."""
        coat, boxes, more = self._ready(coat, boxes)
        blend = "cover" if coat.effect is not None else coat.blend
        given = more | {"part": self._painted, "dpi": self._dpi}
        painted = rasterize_with(boxes, self._camera, coat.texture, coat.options, blend=blend, **given)
        if coat.cut is not None:
            others = coat.cut.without(boxes)
            bare = partial(
                rasterize_with, others, self._camera, coat.texture, coat.options, blend=blend, **given
            )
            painted = coat.cut.applied(painted, self._camera, bare, self._painted)
        frame = painted
        if coat.effect is not None:
            part = {} if self._painted is None else {"part": self._painted}
            frame = coat.effect(painted, self._camera, self._surface, **part)
        if coat.dry and self._surface is not None:
            frame = _pressed(frame, coat, self._surface.grain)
        if self._wanted.needs_strokes:
            from brushgs.rendering.marks import LaidCoat

            self._laid.append(LaidCoat.of(coat, boxes, painted, frame, **more, dpi=self._dpi))
        if self._sheets is not None:
            self._sheets.lay(coat, frame)
        if coat.blend == "glaze":
            self._glaze(frame)
        else:
            self._frame = frame if self._frame is None else _over(frame, self._frame, self._hidden)
        return frame

    def lay_within(self, coat: Coat, boxes: Boxes) -> None:
        """`lay` without a frame of its own if nothing needs it; tiles without strokes take no time."""
        below = self._frame
        if below is None or not self._fits_within(coat, boxes, below):
            self.lay(coat, boxes)
            return
        coat, boxes, given = self._ready(coat, boxes)
        given |= {"part": self._painted, "dpi": self._dpi, "below": Below(below, self._hidden)}
        self._frame = rasterize_with(boxes, self._camera, coat.texture, coat.options, **given)

    def _fits_within(self, coat: Coat, boxes: Boxes, below: Frame) -> bool:
        """Whether nothing needs the coat's own frame, and the frame below has all of its planes."""
        is_changed = coat.effect is not None or coat.cut is not None or bool(coat.dry)
        is_kept = self._wanted.needs_strokes or self._sheets is not None
        lacks_plane = (below.depth is None and coat.options.depth) or (
            below.height is None and coat.options.relief is not None
        )
        is_alike = boxes.centers.dtype == below.rgb.dtype
        return is_alike and coat.blend == "cover" and not (is_changed or is_kept or lacks_plane)

    def _ready(self, coat: Coat, boxes: Boxes) -> tuple[Coat, Boxes, dict[str, Any]]:
        """A coat and its boxes as they are painted, and options of `rasterize` for the depth test."""
        if coat.is_flat:
            coat, boxes = coat.drawn_in(boxes, self._camera)
        boxes, test = self._tested(coat, boxes)
        return coat, boxes, {} if test is None else {"in_front_of": test}

    def _tested(self, coat: Coat, boxes: Boxes) -> "tuple[Boxes, DepthTest | None]":
        """The boxes of a coat, and the test that shows them only in front of what is painted already."""
        if coat.tolerance is None or self._frame is None:
            return boxes, None
        from brushgs.rendering.depth_test import DepthTest

        test = DepthTest.by_picture(self._frame, boxes, coat.strokes, sizes=coat.tolerance)
        if not self._is_moving or not coat.is_curves or coat.chains is None:
            return boxes, test
        from brushgs.rendering.along_lines import along_lines

        return along_lines(boxes, test, coat.chains)

    def _glaze(self, glaze: Frame) -> None:
        """Multiply what lies below by the colors of a glaze."""
        if self._frame is not None:
            np.multiply(self._frame.rgb, glaze.rgb, out=self._frame.rgb)
        if self._tint is None:
            self._tint = glaze.rgb
        else:
            np.multiply(self._tint, glaze.rgb, out=self._tint)

    def finish(self, lamp: "Lamp | None" = None) -> Frame:
        """The picture: opaque if the surface has a color, lit if there is a lamp; see `layered`.

        It is made in the arrays of the coats, unless layers need these.
        """
        frame = self._frame
        if frame is None:
            held = self._painted or Part.whole(self._camera.width, self._camera.height)
            shape = held.height, held.width
            dtype = np.float32 if self._tint is None else self._tint.dtype
            frame = Frame(np.zeros((*shape, 3), dtype), np.zeros(shape, dtype))
        coverage = frame.alpha
        surface, height, num_threads = self._surface, frame.height, num_threads_or_default(None)
        lamp = None if lamp is None else lamp.seen_by(self._camera)
        if surface is not None and lamp is not None:
            paint, height = height, self._out(height, frame.alpha)
            _core.raise_ground(
                alpha=frame.alpha,
                ground=_like(frame.alpha, surface.height),
                paint=paint,
                hidden=self._hidden,
                height=height,
                num_threads=num_threads,
            )
        if surface is not None and not self._is_transparent:
            picture, opaque = self._out(frame.rgb, frame.rgb), self._out(frame.alpha, frame.alpha)
            _core.lay_on_ground(
                rgb=frame.rgb,
                alpha=frame.alpha,
                ground=_like(frame.rgb, surface.rgb),
                tint=_like(frame.rgb, self._tint),
                picture=picture,
                num_threads=num_threads,
            )
            opaque.fill(1)
            frame = replace(frame, rgb=picture, alpha=opaque)
        elif self._tint is not None:
            frame = _with_glazes(frame, self._tint)
        unlit, lighting = frame, None
        if lamp is not None and height is not None:
            from brushgs.rendering.light import BLUR, BLUR_MOVING, light

            blur = BLUR_MOVING if self._is_moving else BLUR
            out = self._out(frame.rgb, frame.rgb)
            rgb = light(frame.rgb, height, lamp, alpha=frame.alpha, blur=blur, scale=self._scale, out=out)
            frame, lighting = replace(frame, rgb=rgb, height=height), (height, lamp, blur, self._scale)
        if self._wanted.is_any:
            self._finished = self._seen(frame, unlit, coverage, lighting)
        return self._cut(frame)

    def _out(self, plane: Array | None, like: Array) -> Array:
        """A plane for a result: the same one, which is in cache, unless layers need what it holds."""
        return _new_plane(like) if plane is None or self._wanted.is_any else plane

    def layered(self) -> Frame:
        """The finished picture with the requested layers."""
        from brushgs.rendering.layers import with_layers

        assert self._finished is not None, "finish the picture first, of which something is wanted"
        return self._cut(with_layers(self._finished, self._wanted))

    def _cut(self, frame: Frame) -> Frame:
        """The requested part of a frame."""
        if self._part is None:
            return frame
        return frame.cut(self._part if self._painted is None else self._part.inside(self._painted))

    def _seen(
        self, frame: Frame, unlit: Frame, coverage: Array, lighting: "tuple[Array, Lamp, float, float] | None"
    ) -> "PaintedView":
        """The inputs of the layers."""
        from brushgs.rendering.deep import Lighting, Rest
        from brushgs.rendering.layers import PaintedView

        is_opaque, is_deep = self._surface is not None and not self._is_transparent, self._wanted.deep
        rest, has_rest = None, is_deep or self._wanted.paths
        if has_rest and self._surface is not None and is_opaque:
            rest = Rest.ground(self._surface.rgb, self._tint if is_deep else None)
        elif has_rest and self._tint is not None:
            rest = Rest.glazes(self._tint)
        light = Lighting.of(*lighting) if lighting and (is_deep or self._sheets) else None
        sheets: tuple[Sheet, ...] = ()
        if self._sheets is not None:
            opaque = self._surface.rgb if self._surface is not None and is_opaque else None
            sheets = self._sheets.result(opaque, light)
        return PaintedView(
            self._camera,
            tuple(self._laid),
            frame,
            unlit,
            coverage,
            rest,
            is_opaque,
            light if is_deep else None,
            self._region_names,
            sheets,
        )


@dataclass(frozen=True, eq=False)
class Painting:
    """All inputs of a frame except its camera.

    Attributes:
        coats: in the order of laying, at least one.
        surface: the ground, in the size of the pictures; None for strokes alone.
        lamp: lights the height of paint and canvas; None for flat pictures.
        is_transparent: leave out the ground: strokes alone.
        is_moving: whether the camera moves between frames. Paint then hides the height below it, and the
            lamp shines on a smoother height: otherwise canvas would stand still while the subject moves,
            coats would move against each other, and ridges as fine as pixels would glitter. Along an orbit of
            240 frames lit oil flickers 1.01 to 1.06 times as much as flat oil, and 2.7 to 3.9 times if lit
            like stills.
        region_names: of the strokes' regions, from region 1; for mattes.
        day: moving sun; None for constant light.
        part: the pixels of frames, bit-identical to those of the whole picture; None for all.
        dpi: pixels per inch on paper: threads, grain, bristles and the sharpness of the light then have a
            physical size. None: all scale with the picture.
        rig: replaces the camera of a frame, for spherical and stereo pictures; None for one camera.
    """

    coats: tuple[Coat, ...]
    surface: "Surface | None" = None
    lamp: "Lamp | None" = None
    is_transparent: bool = False
    is_moving: bool = False
    region_names: tuple[str, ...] = ()
    day: "Day | None" = None
    part: Part | None = None
    dpi: float | None = None
    rig: "Rig | None" = None

    @classmethod
    def alone(cls, coats: Sequence[Coat]) -> "Painting":
        """Coats without ground and relief, drawn as a still, without tracks (which belong to a path)."""
        coats = tuple(replace(coat, options=coat.options.as_still()) for coat in coats)
        return cls(coats).with_depth(False)

    def canvas(self, camera: Camera, wanted: Wanted = NOTHING) -> "Canvas":
        """The bare canvas of one view, with requested layers."""
        return Canvas(camera, self, wanted)

    def reach(self, camera: Camera) -> int | None:
        """Radius of the pixels that a pixel depends on; None for the whole picture."""
        if self.is_moving and any(coat.is_curves and coat.tolerance is not None for coat in self.coats):
            return None
        reaches = [coat.effect.reach(camera) for coat in self.coats if coat.effect is not None]
        of_effects = [reach for reach in reaches if reach is not None]
        if len(of_effects) < len(reaches):
            return None
        if self.lamp is None:
            return max(of_effects, default=0)
        from brushgs.rendering.light import BLUR, BLUR_MOVING, blur_taps

        scale = canvas_scale(camera.width, camera.height, self.dpi)
        taps = blur_taps(BLUR_MOVING if self.is_moving else BLUR, scale)
        return max(of_effects, default=0) + len(taps) // 2 + 1  # slopes are differences of neighbors

    def posed(self, pose: "Pose", *, takes_light: bool = True) -> "Painting":
        """The same painting at a moment of a moving scene, see `Coat.posed`."""
        return replace(self, coats=tuple(coat.posed(pose, takes_light=takes_light) for coat in self.coats))

    def without_effects(self) -> "Painting":
        """The same painting for programs that cannot run effects, see `Effect.stand_in`."""
        from brushgs.rendering.effect import without_effect

        return replace(self, coats=tuple(map(without_effect, self.coats)))

    def with_depth(self, depth: bool) -> "Painting":
        """The same painting with or without depth in its frames; depth tests and effects keep their depth."""
        tested = [coat.tolerance is not None for coat in self.coats]
        last = max((i for i, is_tested in enumerate(tested) if is_tested), default=0)
        coats = [
            replace(coat, options=replace(coat.options, depth=depth or i < last or coat.needs_depth))
            for i, coat in enumerate(self.coats)
        ]
        return replace(self, coats=tuple(coats))

    def frame(
        self,
        camera: Camera,
        directions: Sequence[Directions | None] = (),
        *,
        boxes: Callable[[Coat], Boxes] | None = None,
        wanted: Wanted = NOTHING,
    ) -> Frame:
        """Paint one view.

        Args:
            camera: the view.
            directions: of the strokes of each tracked coat, see `track_directions`.
            boxes: returns the boxes of a coat, in place of `Coat.boxes`; see `Hand`.
            wanted: requested outputs beside colors.
        """
        if self.rig is not None:
            return self.rig.frame(self, camera, directions, wanted=wanted)
        painting = self.with_depth(True) if "depth" in wanted.layers else self
        canvas = painting.canvas(camera, wanted)
        for coat, of_coat in zip_longest(painting.coats, directions):
            canvas.lay_within(coat, coat.boxes(camera, of_coat)[0] if boxes is None else boxes(coat))
        frame = canvas.finish(self.lamp)
        return canvas.layered() if wanted.is_any else frame


def _sheet_maker() -> "SheetMaker":
    from brushgs.rendering.sheets import SheetMaker

    return SheetMaker()


def _pressed(frame: Frame, coat: Coat, grain: Array) -> Frame:
    from brushgs.rendering.tooth import press

    if coat.blend == "cover":
        return press(frame, grain, coat.dry)
    absorbed = press(
        replace(frame, rgb=1 - frame.rgb), grain, coat.dry
    )  # a tint is 1 where nothing is painted
    return replace(absorbed, rgb=1 - absorbed.rgb)


def _over(front: Frame, back: Frame, hidden: float) -> Frame:
    """Composite one frame of strokes over another in the arrays of `back`, as allocation would take longer.

    Paint hides the share `hidden` of the height below it.
    """
    _core.lay_over(
        rgb=_like(back.rgb, front.rgb),
        alpha=_like(back.rgb, front.alpha),
        depth=_like(back.rgb, front.depth),
        height=_like(back.rgb, front.height),
        below_rgb=back.rgb,
        below_alpha=back.alpha,
        below_depth=back.depth,
        below_height=back.height,
        hidden=hidden,
        num_threads=num_threads_or_default(None),
    )
    depth = None if front.depth is None else back.depth
    height = front.height if back.height is None else back.height
    return Frame(back.rgb, back.alpha, depth, height)


def _new_plane(like: Array) -> Array:
    """Like `np.empty_like`, but from pooled memory: fresh pages take longer than filling them."""
    new: Any = _core.new_plane_float32 if like.dtype == np.float32 else _core.new_plane_float64
    plane: Array = new(list(like.shape))
    return plane


def _like(array: Array, other: Array | None) -> Any:
    """`other`, contiguous and in the dtype of `array`; None for None."""
    return None if other is None else np.ascontiguousarray(other, array.dtype)


def _with_glazes(frame: Frame, tint: Array) -> Frame:
    """Glazes without a ground: color and alpha that give the same picture on white."""
    passed, darkest = 1 - frame.alpha, tint.min(axis=2)
    rgb = frame.rgb + (passed[..., None] * (tint - darkest[..., None]))
    return replace(frame, rgb=rgb, alpha=1 - passed * darkest)
