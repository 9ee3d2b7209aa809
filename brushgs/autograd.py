"""`project`, `rasterize` and `render` on torch tensors, with gradients; `moved` for moving strokes.

    import brushgs.autograd as ba
    strokes = ba.Gaussians.of(scene, requires_grad=True)
    frame = ba.render(strokes, camera, texture)
    loss(frame.over((1, 1, 1))).backward()

Pictures are bit-identical to those of the functions in `brushgs`. Gradients are exact derivatives of the
computed values, in float32 or float64, on the CPU; arguments are not copied. Results do not depend on the
number of threads. Memory does not grow with the number of fragments: the backward pass blends strokes again
instead of storing them. Only tensors that require a gradient get one.

Where the derivative does not exist, the gradient is:

- Zero at thresholds: box edges at pixel centers, alphas under 1/255, fragments behind a finished pixel,
  alphas clamped to 0.99, colors clamped to 0, the choice of image level, culling and order. So the kernel
  "ellipse" and `filter="nearest"` give gradients to colors, opacities and depths, but not to the shape of a
  box.
- Zero for the angle of a round ellipse (direction below rounding, 1e-14). Just above, it is as large as 1 /
  anisotropy.
- None through `Directions`, nor through the size that `num_sigmas=None` takes from the texture.
- Straight through the rounding of a texture tensor to 8 bits.

Second derivatives and the soft order are refused.

Needs PyTorch: `pip install torch`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from brushgs.brushes.brush_set import Brush, BrushSet, Sigmas
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Filter, Order, ViewLock
from brushgs.rendering.backward import (
    BOX_COLUMNS,
    BoxGradients,
    FrameGradients,
    project_backward,
    rasterize_backward,
)
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.motion import COLOR, OPACITY, SHIFT, SIZE, TURN, Pose, match
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import LOW_PASS, Directions, ProjectOptions, project_by
from brushgs.rendering.rasterize import RasterOptions, rasterize_traced
from brushgs.rendering.rasterize import rasterize as rasterize_arrays
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import LAYER_COLUMNS
from brushgs.values.boxes import Boxes as BoxArrays
from brushgs.values.camera import Camera
from brushgs.values.colors import rgb_of
from brushgs.values.gaussians import GAUSSIAN_COLUMNS
from brushgs.values.gaussians import Gaussians as GaussianArrays
from brushgs.values.quats import quat_products, rotation_matrices
from brushgs.values.sh import C0

try:
    import torch
    from torch import Tensor
    from torch.autograd.function import once_differentiable
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        "brushgs.autograd: needs PyTorch, which is not installed; pip install torch", name="torch"
    ) from error


@dataclass(frozen=True, eq=False)
class Gaussians:
    """N Gaussians as tensors of one dtype, float32 or float64; shapes and ranges as in `brushgs.Gaussians`.

    Values are checked on use.

    Raises:
        TypeError: if a column is not a tensor, not on the CPU, or of another dtype.
    """

    means: Tensor  # [N, 3]
    quats: Tensor  # [N, 4]
    scales: Tensor  # [N, 3]
    opacities: Tensor  # [N]
    sh: Tensor  # [N, k, 3]
    antialiased: bool = field(default=False, kw_only=True)
    brushes: Tensor | None = field(default=None, kw_only=True)  # [N] uint8: no gradient
    ids: Tensor | None = field(default=None, kw_only=True)  # [N] int32: no gradient

    def __post_init__(self) -> None:
        _check_tensors("Gaussians", {name: getattr(self, name) for name in GAUSSIAN_COLUMNS})
        _check_integers("Gaussians", brushes=(self.brushes, torch.uint8), ids=(self.ids, torch.int32))

    @classmethod
    def of(cls, gaussians: GaussianArrays, *, requires_grad: bool = False) -> Self:
        """Copies of the columns of a scene, in its dtype."""
        columns = (torch.tensor(getattr(gaussians, name)) for name in GAUSSIAN_COLUMNS)
        tensors = (column.requires_grad_(requires_grad) for column in columns)
        integers = {"brushes": _integers(gaussians.brushes), "ids": _integers(gaussians.ids)}
        return cls(*tensors, antialiased=gaussians.antialiased, **integers)

    def numpy(self) -> GaussianArrays:
        """The scene without gradients, sharing the memory of contiguous tensors.

        Raises:
            ValueError: if a shape or value breaks the rules of `brushgs.Gaussians`.
        """
        columns = (_array(getattr(self, name)) for name in GAUSSIAN_COLUMNS)
        brushes, ids = (None if column is None else _array(column) for column in (self.brushes, self.ids))
        return GaussianArrays(*columns, antialiased=self.antialiased, brushes=brushes, ids=ids)

    def __len__(self) -> int:
        return len(self.means)


@dataclass(frozen=True, eq=False)
class Boxes:
    """M oriented rectangles as tensors, nearest first; shapes, units and ranges as in `brushgs.Boxes`.

    Raises:
        TypeError: if a column is not a tensor, not on the CPU, or of another dtype.
    """

    centers: Tensor  # [M, 2]
    half_extents: Tensor  # [M, 2]
    angles: Tensor  # [M]
    depths: Tensor  # [M]
    colors: Tensor  # [M, 3]
    opacities: Tensor  # [M]
    ids: Tensor  # [M] int32, the Gaussian (row) behind each box: no gradient
    setbacks: Tensor | None = None  # [M], for underpaint: no gradient
    brushes: Tensor | None = None  # [M] uint8, rows of a brush set: no gradient

    def __post_init__(self) -> None:
        optional = {} if self.setbacks is None else {"setbacks": self.setbacks}
        _check_tensors("Boxes", {name: getattr(self, name) for name in BOX_COLUMNS} | optional)
        _check_integers("Boxes", ids=(self.ids, torch.int32), brushes=(self.brushes, torch.uint8))

    @classmethod
    def of(cls, boxes: BoxArrays, *, requires_grad: bool = False) -> Self:
        """Copies of the columns of boxes without softness, in their dtype.

        Raises:
            ValueError: if the boxes have a softness.
        """
        if boxes.softness is not None:
            raise ValueError('Boxes: boxes must have no softness here; project with order="depth"')
        columns = {n: torch.tensor(getattr(boxes, n)).requires_grad_(requires_grad) for n in BOX_COLUMNS}
        setbacks = None if boxes.setbacks is None else torch.tensor(boxes.setbacks)
        brushes = _integers(boxes.brushes)
        return cls(**columns, ids=torch.tensor(boxes.ids), setbacks=setbacks, brushes=brushes)

    def __len__(self) -> int:
        return len(self.centers)


@dataclass(frozen=True, eq=False)
class Frame:
    """A picture as tensors, as in `brushgs.Frame`."""

    rgb: Tensor  # [H, W, 3]
    alpha: Tensor  # [H, W]
    depth: Tensor | None = None  # [H, W]

    def over(self, background: Sequence[float] | Tensor | str) -> Tensor:
        """The picture on a background, [H, W, 3].

        Args:
            background: RGB color [3] or tensor [H, W, 3], display-encoded, 0 to 1; or a color name or
                "#rrggbb".

        Raises:
            ValueError: for another shape or an unknown color.
        """
        rgb = rgb_of(background) if isinstance(background, str) else background
        behind = torch.as_tensor(rgb, dtype=self.rgb.dtype)
        if tuple(behind.shape) not in ((3,), tuple(self.rgb.shape)):
            raise ValueError(
                f"over: background must have shape [3] or {list(self.rgb.shape)}, got {list(behind.shape)}"
            )
        return self.rgb + (1 - self.alpha[..., None]) * behind


def project(
    gaussians: Gaussians,
    camera: Camera,
    *,
    num_sigmas: float | F64 = 2.0,
    low_pass: float = LOW_PASS,
    lock: ViewLock | Directions = "off",
    fade: bool = False,
    order: Order = "depth",
    underpaint: bool = False,
    num_threads: int | None = None,
) -> Boxes:
    """Project Gaussians to boxes: `brushgs.project` with gradients for all columns of the Gaussians.

    Culled Gaussians get zeros. SH degrees that are all zero get gradients too.

    Args:
        gaussians: N Gaussians in world space.
        camera: one pinhole camera; it gets no gradient.
        num_sigmas: see `brushgs.project`, as for the others.
        low_pass: pixels squared.
        lock: "off" and "anchor" pass gradients through the angle, `Directions` do not.
        fade: fade strokes that would otherwise appear or vanish.
        order: "depth"; "soft" has no gradient.
        underpaint: whether boxes have setbacks; these have no gradient.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if a value is out of range or `order` is "soft".
    """
    options = ProjectOptions(
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        lock=lock,
        fade=fade,
        order=order,
        underpaint=underpaint,
        num_threads=num_threads,
    )
    return _projected("project", gaussians, camera, options)


def _projected(where: str, gaussians: Gaussians, camera: Camera, options: ProjectOptions) -> Boxes:
    _check_gaussians(where, gaussians)
    if options.order != "depth":
        raise ValueError(
            f'{where}: order must be "depth", got {options.order!r}; the soft order has no gradient, '
            'refine with "depth" and paint with "soft"'
        )
    columns = (getattr(gaussians, name) for name in GAUSSIAN_COLUMNS)
    constants = gaussians.antialiased, gaussians.brushes
    made: list[str] = []  # column names
    boxes = _Project.apply(camera, options, constants, made, *columns)
    return Boxes(**dict(zip(made, boxes, strict=True)))


def rasterize(
    boxes: Boxes,
    texture: Brush | Tensor | Sequence[Tensor],
    *,
    height: int,
    width: int,
    filter: Filter = "mip",
    depth: bool = True,
    underpaint: Underpaint | None = None,
    streaks: float = 0.0,
    min_transmittance: float = MIN_TRANSMITTANCE,
    num_threads: int | None = None,
) -> Frame:
    """Paint boxes with a stroke texture: `brushgs.rasterize` with gradients for the boxes and the texture.

    Args:
        boxes: M strokes, nearest first.
        texture: a brush, its name or path; or a coverage tensor [h, w], 0 to 1, which gets a gradient, also
            through the levels of `filter="mip"`. A list of such tensors is a set of brushes.
        height: pixels, see `brushgs.rasterize`, as for the others.
        width: pixels.
        filter: sampling of stroke images.
        depth: whether the frame has a depth, with gradient.
        underpaint: soft copies behind strokes; their gradients add to those of the boxes.
        streaks: amplitude of streaks along strokes.
        min_transmittance: fragments behind a pixel with less transmittance get no gradient.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if a value is out of range.
    """
    if not isinstance(boxes, Boxes):
        raise TypeError(
            f"rasterize: boxes must be brushgs.autograd.Boxes, got {type(boxes).__name__}; use Boxes.of"
        )
    brush_set, coverages = _brushes_of("rasterize", texture)
    options: dict[str, Any] = {"height": height, "width": width, "filter": filter, "depth": depth}
    options |= {"underpaint": underpaint, "streaks": streaks}
    options |= {"min_transmittance": min_transmittance, "num_threads": num_threads}
    columns = (getattr(boxes, name) for name in BOX_COLUMNS)
    constants = boxes.ids, boxes.setbacks, boxes.brushes
    rgb, alpha, *layers = _Rasterize.apply(brush_set, options, constants, *columns, *coverages)
    return Frame(rgb, alpha, **dict(zip(LAYER_COLUMNS, layers, strict=True)))


def render(
    gaussians: Gaussians,
    camera: Camera,
    texture: Brush | Tensor | Sequence[Tensor],
    *,
    lock: ViewLock | Directions = "anchor",
    order: Order = "depth",
    filter: Filter = "mip",
    num_sigmas: Sigmas | None = None,
    low_pass: float = LOW_PASS,
    depth: bool = True,
    underpaint: bool | Underpaint = False,
    streaks: float = 0.0,
    num_threads: int | None = None,
) -> Frame:
    """Paint Gaussians in one view: `brushgs.render` with gradients.

    Args:
        gaussians: N Gaussians in world space; each becomes a stroke.
        camera: one pinhole camera; its size is the size of the picture.
        texture: see `rasterize`.
        lock: see `project`; the built-in kernels are drawn along the axes of the ellipse.
        order: "depth"; "soft" has no gradient.
        filter: see `rasterize`.
        num_sigmas: half length of a box in standard deviations; None takes the texture's, held fixed.
        low_pass: see `project`.
        depth: see `rasterize`.
        underpaint: see `brushgs.render`.
        streaks: see `rasterize`.
        num_threads: see `rasterize`.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if a value is out of range or `order` is "soft".
    """
    brush_set, coverages = _brushes_of("render", texture)
    options = RenderOptions.of(
        brush_set,
        lock=lock,
        filter=filter,
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        num_threads=num_threads,
    )
    _check_gaussians("render", gaussians)
    brushes = None if gaussians.brushes is None else _array(gaussians.brushes)
    projection = replace(options.projection_of(len(gaussians), brushes), order=order)
    boxes = _projected("render", gaussians, camera, projection)
    return rasterize(
        boxes,
        coverages or brush_set,
        height=camera.height,
        width=camera.width,
        filter=filter,
        depth=depth,
        underpaint=options.underpaint,
        streaks=options.streaks,
        num_threads=num_threads,
    )


def moved(gaussians: Gaussians, pose: Pose, *, has_color: bool = True) -> Gaussians:
    """Strokes at one moment: `Pose.moved` with gradients for all columns of the strokes.

    The pose gets no gradient.

    Args:
        gaussians: N strokes at their reference moments; strokes without an id in the pose do not move.
        pose: poses of strokes at the moment.
        has_color: whether strokes follow color changes.

    Raises:
        TypeError: if `gaussians` has another type.
        ValueError: if a shape or value breaks the rules of `brushgs.Gaussians`.
    """
    _check_gaussians("moved", gaussians)
    rows, found = match(gaussians.numpy(), pose.ids)
    if len(rows) == 0:
        return gaussians
    numbers = pose.numbers[found].astype(np.float64)
    size, turn = np.exp(numbers[:, SIZE]), numbers[:, TURN]
    moves, pivots = torch.from_numpy(rows), torch.from_numpy(pose.pivots[found])
    spins = torch.from_numpy(size[:, None, None] * rotation_matrices(turn))
    products = torch.from_numpy(quat_products(turn[:, None], np.eye(4)[None]))  # with each unit quaternion
    shifts, sizes, factors = (torch.from_numpy(v) for v in (numbers[:, SHIFT], size, numbers[:, OPACITY]))
    # In float64, as `Pose.moved`: distances from a pivot are small beside its coordinates.
    means, quats, scales, opacities = (
        getattr(gaussians, name)[moves].double() for name in ("means", "quats", "scales", "opacities")
    )
    found_columns = {
        "means": pivots + shifts + torch.einsum("nij,nj->ni", spins, means - pivots),
        "quats": torch.einsum("nji,nj->ni", products, quats),
        "scales": sizes[:, None] * scales,
        "opacities": (factors * opacities).clamp(0, 1),
    }
    columns = {
        name: getattr(gaussians, name).index_put((moves,), column.to(gaussians.means.dtype))
        for name, column in found_columns.items()
    }
    if has_color:
        base = gaussians.sh[moves, 0].double() + torch.from_numpy(numbers[:, COLOR] / C0)
        places = moves, torch.zeros_like(moves)
        columns["sh"] = gaussians.sh.index_put(places, base.to(gaussians.sh.dtype))
    return replace(gaussians, **columns)


def _check_gaussians(where: str, gaussians: Any) -> None:
    if not isinstance(gaussians, Gaussians):
        raise TypeError(
            f"{where}: gaussians must be brushgs.autograd.Gaussians, got {type(gaussians).__name__}; "
            "use Gaussians.of"
        )


class _Project(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(
        ctx: Any,
        camera: Camera,
        options: ProjectOptions,
        constants: tuple[bool, Tensor | None],  # antialiased, brushes
        made: list[str],  # filled with the names of the returned columns
        *columns: Tensor,
    ) -> tuple[Tensor, ...]:
        antialiased, brushes = constants
        rows = None if brushes is None else _array(brushes)
        gaussians = GaussianArrays(*map(_array, columns), antialiased=antialiased, brushes=rows)
        boxes, _ = project_by(gaussians, camera, options)
        optional = (name for name in ("setbacks", "brushes") if getattr(boxes, name) is not None)
        names = (*BOX_COLUMNS, "ids", *optional)
        made += names
        outputs = {name: _tensor(getattr(boxes, name)) for name in names}
        ctx.gaussians, ctx.boxes, ctx.camera, ctx.options = gaussians, boxes, camera, options
        ctx.set_materialize_grads(False)
        ctx.mark_non_differentiable(*(outputs[name] for name in names[len(BOX_COLUMNS) :]))
        ctx.save_for_backward(*columns, outputs["ids"], outputs["colors"])  # torch checks that none changes
        return tuple(outputs.values())

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, *gradients: Tensor | None) -> tuple[Tensor | None, ...]:
        _ = ctx.saved_tensors  # raises where one was changed in place
        needs = zip(GAUSSIAN_COLUMNS, ctx.needs_input_grad[4:], strict=True)
        by_box: dict[str, Any] = {
            name: None if g is None else _array(g) for name, g in zip(BOX_COLUMNS, gradients, strict=False)
        }
        found = project_backward(
            ctx.gaussians,
            ctx.camera,
            ctx.boxes,
            BoxGradients(**by_box),
            ctx.options,
            columns=[name for name, is_needed in needs if is_needed],
        )
        by_column = (getattr(found, name) for name in GAUSSIAN_COLUMNS)
        return None, None, None, None, *(None if g is None else torch.from_numpy(g) for g in by_column)


class _Rasterize(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(
        ctx: Any,
        brush_set: BrushSet,
        options: dict[str, Any],
        constants: tuple[Tensor, Tensor | None, Tensor | None],  # ids, setbacks and brushes
        *tensors: Tensor,  # the columns, then coverages given as tensors
    ) -> tuple[Tensor | None, ...]:
        columns, coverages = tensors[: len(BOX_COLUMNS)], tensors[len(BOX_COLUMNS) :]
        given = zip(("ids", "setbacks", "brushes"), constants, strict=True)
        arrays = {name: _array(c) for name, c in zip(BOX_COLUMNS, columns, strict=True)}
        arrays |= {name: _array(c) for name, c in given if c is not None}
        boxes = BoxArrays(**arrays)
        ctx.trace = None
        if any(ctx.needs_input_grad):
            frame, ctx.trace = rasterize_traced(boxes, brush_set, RasterOptions(**options))
        else:
            frame = rasterize_arrays(boxes, brush_set, **options)
        planes = (frame.rgb, frame.alpha, *(getattr(frame, name) for name in LAYER_COLUMNS))
        picture = [None if plane is None else torch.from_numpy(plane) for plane in planes]
        ctx.boxes, ctx.frame, ctx.brush_set, ctx.options = boxes, frame, brush_set, options
        ctx.coverage_dtypes = [coverage.dtype for coverage in coverages]
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*columns, *(c for c in constants if c is not None), *picture)
        return tuple(picture)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, *gradients: Tensor | None) -> tuple[Tensor | None, ...]:
        _ = ctx.saved_tensors  # raises where one was changed in place
        v_rgb, v_alpha, *v_layers = (None if g is None else _array(g) for g in gradients)
        needs = ctx.needs_input_grad[3:]
        needs_coverages = needs[len(BOX_COLUMNS) :]
        found = rasterize_backward(
            ctx.boxes,
            ctx.brush_set,
            ctx.frame,
            FrameGradients(
                np.zeros_like(ctx.frame.rgb) if v_rgb is None else v_rgb,
                v_alpha,
                dict(zip(LAYER_COLUMNS, v_layers, strict=True)),
            ),
            RasterOptions(**ctx.options),
            with_coverage=any(needs_coverages),
            trace=ctx.trace,
        )
        by_column = (getattr(found, name) for name in BOX_COLUMNS)
        by_coverage = found.coverages or [None] * len(needs_coverages)
        return (
            None,
            None,
            None,
            *(
                torch.from_numpy(g) if is_needed else None
                for g, is_needed in zip(by_column, needs, strict=False)
            ),
            *(
                torch.from_numpy(g).to(dtype) if g is not None and is_needed else None
                for g, is_needed, dtype in zip(by_coverage, needs_coverages, ctx.coverage_dtypes, strict=True)
            ),
        )


def _array(tensor: Tensor) -> Any:
    """The values; shares the memory of a contiguous tensor."""
    return tensor.detach().contiguous().numpy()


def _tensor(column: Array) -> Tensor:
    """A column of fresh boxes as a tensor; nobody else uses its memory."""
    column = column.view()
    column.flags.writeable = True  # boxes are read-only; torch has no read-only tensors
    return torch.from_numpy(column)


def _check_tensors(where: str, columns: dict[str, Any]) -> None:
    for name, column in columns.items():
        if not isinstance(column, Tensor):
            raise TypeError(f"{where}: {name} must be a torch tensor, got {type(column).__name__}")
        if column.device.type != "cpu":
            raise TypeError(f"{where}: {name} must be on the CPU, got {column.device}; call .cpu() on it")
        if column.dtype not in (torch.float32, torch.float64):
            raise TypeError(
                f"{where}: {name} must be float32 or float64, got {_name(column)}; call .float() on it"
            )
        first, first_column = next(iter(columns.items()))
        if column.dtype != first_column.dtype:
            raise TypeError(
                f"{where}: {name} must be {_name(first_column)} like {first}, got {_name(column)}"
            )


def _check_integers(where: str, **columns: tuple[Tensor | None, torch.dtype]) -> None:
    for name, (column, dtype) in columns.items():
        if column is not None and not (isinstance(column, Tensor) and column.dtype == dtype):
            what = _name(column) if isinstance(column, Tensor) else type(column).__name__
            kind = str(dtype).removeprefix("torch.")
            raise TypeError(f"{where}: {name} must be a torch tensor of {kind}, got {what}")


def _integers(column: Any) -> Tensor | None:
    """A copy of a column of row numbers."""
    return None if column is None else torch.tensor(column)


def _name(tensor: Tensor) -> str:
    return str(tensor.dtype).removeprefix("torch.")


def _brushes_of(
    where: str, texture: Brush | Tensor | Sequence[Tensor]
) -> tuple[BrushSet, tuple[Tensor, ...]]:
    """The brush set, and its coverages if given as tensors."""
    tensors = (texture,) if isinstance(texture, Tensor) else texture
    if not (isinstance(tensors, Sequence) and tensors and isinstance(tensors[0], Tensor)):
        return BrushSet.of(texture), ()
    for coverage in tensors:
        _check_tensors(where, {"texture": coverage})
    return BrushSet(tuple(StrokeTexture.from_coverage(_array(c)) for c in tensors)), tuple(tensors)
