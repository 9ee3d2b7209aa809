"""`project`, `rasterize` and `render` on torch tensors, with gradients.

    import brushgs.autograd as ba
    strokes = ba.Gaussians.of(scene, requires_grad=True)
    frame = ba.render(strokes, camera, texture)
    loss(frame.over((1, 1, 1))).backward()

Pictures are those of the functions of the same names in `brushgs`, bit for bit. Gradients are the derivative
of what was computed, in float32 or float64, on the CPU; arguments are not copied. They do not depend on the
number of threads, nor the memory they take on the number of fragments: strokes are blended once more,
not kept fragment by fragment. Only what requires a gradient gets one.

Where the derivative does not exist, the gradient is:

- Zero from what decides by a threshold: whether a pixel centre lies in a box (its edge), alphas under 1/255,
  what lies behind a finished pixel, alphas clamped to 0.99, colours clamped to 0, the level of the image that
  serves a box, which Gaussians have boxes and in what order. So the kernel "ellipse" and `filter="nearest"`
  give gradients to colours, opacities and depths, and none to the shape of a box.
- Zero by the angle of a round ellipse (its direction below rounding, 1e-14). Just above, that gradient is as
  large as one over the anisotropy.
- None through `Directions`, nor through the size that `num_sigmas=None` takes from the texture.
- Through the rounding of a texture tensor to 8 bits, as if there were none.

Second derivatives (after a loss that is not linear in the picture) and the soft order are refused.

Needs PyTorch: `pip install torch`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

import brushgs.scene as scene
from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.colors import rgb_of
from brushgs.options.choices import Filter, Order, ViewLock
from brushgs.rendering.backward import (
    BOX_COLUMNS,
    BoxGradients,
    project_backward,
    rasterize_backward,
)
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import LOW_PASS, Directions, ProjectOptions, project_by
from brushgs.rendering.rasterize import rasterize as rasterize_arrays
from brushgs.rendering.underpaint import Underpaint
from brushgs.scene import GAUSSIAN_COLUMNS, LAYERS, Camera

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

    Values are checked where they are used.

    Raises:
        TypeError: if a column is no tensor, on another device than the CPU or of another dtype.
    """

    means: Tensor  # [N, 3]
    quats: Tensor  # [N, 4]
    scales: Tensor  # [N, 3]
    opacities: Tensor  # [N]
    sh: Tensor  # [N, k, 3]
    antialiased: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        _check_tensors("Gaussians", {name: getattr(self, name) for name in GAUSSIAN_COLUMNS})

    @classmethod
    def of(cls, gaussians: scene.Gaussians, *, requires_grad: bool = False) -> Self:
        """Copies of the columns of a scene, in its dtype."""
        columns = (torch.tensor(getattr(gaussians, name)) for name in GAUSSIAN_COLUMNS)
        tensors = (column.requires_grad_(requires_grad) for column in columns)
        return cls(*tensors, antialiased=gaussians.antialiased)

    def numpy(self) -> scene.Gaussians:
        """The scene without gradients; it shares the memory of contiguous tensors.

        Raises:
            ValueError: if a shape or value breaks the rules of `brushgs.Gaussians`.
        """
        columns = (_array(getattr(self, name)) for name in GAUSSIAN_COLUMNS)
        return scene.Gaussians(*columns, antialiased=self.antialiased)

    def __len__(self) -> int:
        return len(self.means)


@dataclass(frozen=True, eq=False)
class Boxes:
    """M oriented rectangles as tensors, nearest first; shapes, units and ranges as in `brushgs.Boxes`.

    Raises:
        TypeError: if a column is no tensor, on another device than the CPU or of another dtype.
    """

    centers: Tensor  # [M, 2]
    half_extents: Tensor  # [M, 2]
    angles: Tensor  # [M]
    depths: Tensor  # [M]
    colors: Tensor  # [M, 3]
    opacities: Tensor  # [M]
    ids: Tensor  # [M] int32, the Gaussian (row) behind each box: no gradient
    setbacks: Tensor | None = None  # [M], for underpaint: no gradient

    def __post_init__(self) -> None:
        optional = {} if self.setbacks is None else {"setbacks": self.setbacks}
        _check_tensors("Boxes", {name: getattr(self, name) for name in BOX_COLUMNS} | optional)

    @classmethod
    def of(cls, boxes: scene.Boxes, *, requires_grad: bool = False) -> Self:
        """Copies of the columns of boxes without softness, in their dtype.

        Raises:
            ValueError: if the boxes have a softness.
        """
        if boxes.softness is not None:
            raise ValueError('Boxes: boxes must have no softness here; project with order="depth"')
        columns = {n: torch.tensor(getattr(boxes, n)).requires_grad_(requires_grad) for n in BOX_COLUMNS}
        setbacks = None if boxes.setbacks is None else torch.tensor(boxes.setbacks)
        return cls(**columns, ids=torch.tensor(boxes.ids), setbacks=setbacks)

    def __len__(self) -> int:
        return len(self.centers)


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture as tensors; as in `brushgs.Frame`."""

    rgb: Tensor  # [H, W, 3]
    alpha: Tensor  # [H, W]
    depth: Tensor | None = None  # [H, W]

    def over(self, background: Sequence[float] | Tensor | str) -> Tensor:
        """The picture on a background, [H, W, 3].

        Args:
            background: one RGB colour or an [H, W, 3] tensor, display-encoded, 0 to 1; or a colour by name or
                as "#rrggbb".

        Raises:
            ValueError: if it has another shape, or is no known colour.
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
    num_sigmas: float = 2.0,
    low_pass: float = LOW_PASS,
    lock: ViewLock | Directions = "off",
    fade: bool = False,
    order: Order = "depth",
    underpaint: bool = False,
    num_threads: int | None = None,
) -> Boxes:
    """Project Gaussians to boxes: `brushgs.project` with gradients by all columns of the Gaussians.

    Culled Gaussians get zeros. SH degrees that are zero throughout have their gradient too.

    Args:
        gaussians: N Gaussians in world space.
        camera: one pinhole camera; it gets no gradient.
        num_sigmas: see `brushgs.project`, like the others.
        low_pass: pixels squared.
        lock: "off" and "anchor" pass gradients through the angle, `Directions` do not.
        fade: whether strokes fade that would otherwise appear or vanish.
        order: "depth"; "soft" has no gradient.
        underpaint: whether boxes have setbacks, which pass no gradients on.
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
    if not isinstance(gaussians, Gaussians):
        raise TypeError(
            f"{where}: gaussians must be brushgs.autograd.Gaussians, got {type(gaussians).__name__}; "
            "use Gaussians.of"
        )
    if options.order != "depth":
        raise ValueError(
            f'{where}: order must be "depth", got {options.order!r}; the soft order has no gradient, '
            'refine with "depth" and paint with "soft"'
        )
    columns = (getattr(gaussians, name) for name in GAUSSIAN_COLUMNS)
    return Boxes(*_Project.apply(camera, options, gaussians.antialiased, *columns))


def rasterize(
    boxes: Boxes,
    texture: StrokeTexture | str | Path | Tensor,
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
    """Paint boxes with a stroke texture: `brushgs.rasterize` with gradients by the boxes and the texture.

    Args:
        boxes: M strokes, nearest first.
        texture: what fills a box, or its name or path; or the coverage of a stroke image as a tensor [h, w]
            of 0 to 1, which then gets a gradient: through the levels of `filter="mip"` as well, by the
            transpose of what makes them.
        height: pixels, see `brushgs.rasterize`, like the others.
        width: pixels.
        filter: how a stroke image is read.
        depth: whether the frame has a depth, which has a gradient too.
        underpaint: what lies behind each stroke; its gradients add to those of the box.
        streaks: amplitude of the streaks along strokes.
        min_transmittance: what lies behind a pixel that lets less light through has no gradient.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if a value is out of range.
    """
    if not isinstance(boxes, Boxes):
        raise TypeError(
            f"rasterize: boxes must be brushgs.autograd.Boxes, got {type(boxes).__name__}; use Boxes.of"
        )
    stroke, coverage = _stroke_of("rasterize", texture)
    options: dict[str, Any] = {"height": height, "width": width, "filter": filter, "depth": depth}
    options |= {"underpaint": underpaint, "streaks": streaks}
    options |= {"min_transmittance": min_transmittance, "num_threads": num_threads}
    columns = (getattr(boxes, name) for name in BOX_COLUMNS)
    constants = boxes.ids, boxes.setbacks
    rgb, alpha, *layers = _Rasterize.apply(stroke, options, constants, coverage, *columns)
    return Frame(rgb, alpha, **dict(zip(LAYERS, layers, strict=True)))


def render(
    gaussians: Gaussians,
    camera: Camera,
    texture: StrokeTexture | str | Path | Tensor,
    *,
    lock: ViewLock | Directions = "anchor",
    order: Order = "depth",
    filter: Filter = "mip",
    num_sigmas: float | None = None,
    low_pass: float = LOW_PASS,
    depth: bool = True,
    underpaint: bool | Underpaint = False,
    streaks: float = 0.0,
    num_threads: int | None = None,
) -> Frame:
    """Paint Gaussians as one camera sees them: `brushgs.render` with gradients.

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
    stroke, coverage = _stroke_of("render", texture)
    options = RenderOptions.of(
        stroke,
        lock=lock,
        filter=filter,
        num_sigmas=num_sigmas,
        low_pass=low_pass,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        num_threads=num_threads,
    )
    boxes = _projected("render", gaussians, camera, replace(options.projection, order=order))
    return rasterize(
        boxes,
        stroke if coverage is None else coverage,
        height=camera.height,
        width=camera.width,
        filter=filter,
        depth=depth,
        underpaint=options.underpaint,
        streaks=options.streaks,
        num_threads=num_threads,
    )


class _Project(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(
        ctx: Any, camera: Camera, options: ProjectOptions, antialiased: bool, *columns: Tensor
    ) -> tuple[Tensor, ...]:
        gaussians = scene.Gaussians(*map(_array, columns), antialiased=antialiased)
        boxes, _ = project_by(gaussians, camera, options)
        names = (*BOX_COLUMNS, "ids") if boxes.setbacks is None else (*BOX_COLUMNS, "ids", "setbacks")
        outputs = {name: _tensor(getattr(boxes, name)) for name in names}
        ctx.gaussians, ctx.boxes, ctx.camera, ctx.options = gaussians, boxes, camera, options
        ctx.set_materialize_grads(False)
        ctx.mark_non_differentiable(*(outputs[name] for name in names[len(BOX_COLUMNS) :]))
        ctx.save_for_backward(*columns, outputs["ids"], outputs["colors"])  # torch sees that none changes
        return tuple(outputs.values())

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, *gradients: Tensor | None) -> tuple[Tensor | None, ...]:
        _ = ctx.saved_tensors  # raises where one was changed in place
        needs = zip(GAUSSIAN_COLUMNS, ctx.needs_input_grad[3:], strict=True)
        found = project_backward(
            ctx.gaussians,
            ctx.camera,
            ctx.boxes,
            BoxGradients(*(None if g is None else _array(g) for g in gradients[: len(BOX_COLUMNS)])),
            ctx.options,
            columns=[name for name, is_needed in needs if is_needed],
        )
        by_column = (getattr(found, name) for name in GAUSSIAN_COLUMNS)
        return None, None, None, *(None if g is None else torch.from_numpy(g) for g in by_column)


class _Rasterize(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(
        ctx: Any,
        texture: StrokeTexture,
        options: dict[str, Any],
        constants: tuple[Tensor, Tensor | None],  # ids and setbacks
        coverage: Tensor | None,  # what `texture` was made of
        *columns: Tensor,
    ) -> tuple[Tensor | None, ...]:
        ids, setbacks = constants
        arrays = {name: _array(c) for name, c in zip((*BOX_COLUMNS, "ids"), (*columns, ids), strict=True)}
        boxes = scene.Boxes(**arrays, setbacks=None if setbacks is None else _array(setbacks))
        frame = rasterize_arrays(boxes, texture, **options)
        planes = (frame.rgb, frame.alpha, *(getattr(frame, name) for name in LAYERS))
        picture = [None if plane is None else torch.from_numpy(plane) for plane in planes]
        ctx.boxes, ctx.frame, ctx.texture, ctx.options = boxes, frame, texture, options
        ctx.coverage_dtype = None if coverage is None else coverage.dtype
        ctx.set_materialize_grads(False)
        ctx.save_for_backward(*columns, *(c for c in constants if c is not None), *picture)
        return tuple(picture)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, *gradients: Tensor | None) -> tuple[Tensor | None, ...]:
        _ = ctx.saved_tensors  # raises where one was changed in place
        v_rgb, v_alpha, *v_layers = (None if g is None else _array(g) for g in gradients)
        needs_coverage, *needs = ctx.needs_input_grad[3:]
        found = rasterize_backward(
            ctx.boxes,
            ctx.texture,
            ctx.frame,
            np.zeros_like(ctx.frame.rgb) if v_rgb is None else v_rgb,
            v_alpha,
            dict(zip(LAYERS, v_layers, strict=True)),
            with_coverage=needs_coverage,
            **{
                name: value for name, value in ctx.options.items() if name not in ("height", "width", "depth")
            },
        )
        by_column = (getattr(found, name) for name in BOX_COLUMNS)
        return (
            None,
            None,
            None,
            None if found.coverage is None else torch.from_numpy(found.coverage).to(ctx.coverage_dtype),
            *(
                torch.from_numpy(g) if is_needed else None
                for g, is_needed in zip(by_column, needs, strict=True)
            ),
        )


def _array(tensor: Tensor) -> Any:
    """The values, in the memory of the tensor where it is contiguous."""
    return tensor.detach().contiguous().numpy()


def _tensor(column: Array) -> Tensor:
    """A column of fresh boxes, in the memory that they do not share with anyone."""
    column = column.view()
    column.flags.writeable = True  # boxes are read-only; torch knows no such thing
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


def _name(tensor: Tensor) -> str:
    return str(tensor.dtype).removeprefix("torch.")


def _stroke_of(
    where: str, texture: StrokeTexture | str | Path | Tensor
) -> tuple[StrokeTexture, Tensor | None]:
    """The texture, and the coverage that it was made of where that is a tensor."""
    if not isinstance(texture, Tensor):
        return StrokeTexture.of(texture), None
    _check_tensors(where, {"texture": texture})
    return StrokeTexture.from_coverage(_array(texture)), texture
