"""The values that travel through brushgs: Gaussians, FirstView, Camera, Boxes and Frame.

Each is a frozen set of NumPy columns, checked once where it is made, so that no later step needs to
check it again. Conventions (used everywhere): quaternions are w, x, y, z; camera axes x right, y down,
z forward; `viewmat` takes world to camera on column vectors; the centre of the pixel in row i and
column j lies at (j + 0.5, i + 0.5); colours are display-encoded, as the scene was trained; angles in
radians from +x towards +y.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from math import radians
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from brushgs.arrays import Array, check
from brushgs.colors import rgb_of
from brushgs.columns import RowChoice, check_finite, check_rows, freeze_columns, row_choice
from brushgs.layers import DeepSamples, Layer
from brushgs.png import png_bytes
from brushgs.threads import num_threads_or_default

SH_TERMS = {1: 0, 4: 1, 9: 2, 16: 3}  # number of spherical-harmonic terms -> degree
# The layers of a frame beside its colour: field of `Frame` -> column of `Boxes`, [M] or [M, channels], whose
# alpha-weighted mean it is. Boxes without the column give frames without the layer. How many channels the
# core has room for is said in core/include/brushgs/layers.hpp.
LAYER_COLUMNS = {"depth": "depths"}
_OPTIONAL = {"softness": "M", "setbacks": "M", "reliefs": "M 2"}  # columns of Boxes, >= 0 -> shape
_SHOWN_SIDE = 1024  # pixels: notebooks keep what they show, and have columns about as wide
GAUSSIAN_COLUMNS = (
    "means",
    "quats",
    "scales",
    "opacities",
    "sh",
)  # of Gaussians, in order
_GAUSSIAN_INTEGERS: dict[str, type[np.integer[Any]]] = {
    "brushes": np.uint8,
    "ids": np.int32,
    "regions": np.uint8,
}
_WITHOUT = {"brushes": 0, "ids": -1, "regions": 0}  # what rows have that come without the column


@dataclass(frozen=True, eq=False)
class Gaussians:
    """N anisotropic 3D Gaussians with view-dependent colour: a scene, or the strokes made of one.

    All columns share one dtype, float32 or float64, and become read-only views: no copy is made of arrays
    that are already contiguous. Lists, and arrays of whole numbers, are taken too, in the dtype of the arrays
    beside them, or as float32.

    `gaussians[rows]` are those of an index array, a mask, a list of either or a slice, and `a + b` is both.

    Attributes:
        means: [N, 3] centres, world units, finite.
        quats: [N, 4] rotations as w, x, y, z; any non-zero length, normalised where used.
        scales: [N, 3] standard deviations along the own axes, world units, >= 0.
        opacities: [N] 0 to 1.
        sh: [N, k, 3] spherical-harmonic coefficients of RGB, k = (degree + 1)^2 in 1, 4, 9, 16; the
            colour seen is max(0, 0.5 + sum of coefficient x basis). Source: Kerbl et al. 2023.
        antialiased: whether they were trained with the opacity compensation of Mip-Splatting: `project` then
            multiplies opacities by the root of det S / det(S + low_pass I), S the projected covariance, so
            that what is thinner than a pixel gets fainter. Strokes made of such Gaussians keep it: in five
            scenes a flat brush came 0.0 to 3.2 dB nearer to the plain picture so, the plain kernel 0.4 dB
            further away to 6.8 dB nearer. Source: Yu et al. 2024, Mip-Splatting, section 5.2.
        brushes: [N] uint8, the brush of each stroke: its row of a `BrushSet`; None: the first for all.
        ids: [N] int32, where things move: of which row of a `MovingScene` each is a moment, or which stroke
            of a `StrokeMotion` it moves with, -1 for what rests; None where nothing moves. Rows that are
            taken keep theirs.
        regions: [N] uint8, the part of the scene that each belongs to: 0 elsewhere, else the number of its
            rule, from 1, see `brushgs.options.rules`; None where all is treated alike.
        finest: >= 0, standard deviation of the finest line that pictures show from the distance that strokes
            are made for, world units: passes take thinner Gaussians for that, see `brushgs.passes.finest`.
            None where no view is known: passes then take the distance of 2.4 radii. `render` ignores it.

    Raises:
        TypeError: if a column holds no numbers, or dtypes differ; or `brushes`, `ids` or `regions` hold other
            than whole numbers.
        ValueError: if a shape is wrong or a value is outside the range above; names column and row.

    Example:
        >>> where, turned, size = [[0, 0, 0]], [[1, 0, 0, 0]], [[1, 0.2, 0.1]]
        >>> one = bg.Gaussians(where, turned, size, opacities=[0.8], sh=[[[1, 0, 0]]])
        >>> one
        Gaussians(1, SH 0)
        >>> gaussians[gaussians.opacities > 0.5] + one
        Gaussians(..., SH 3)
    """

    means: Array  # [N, 3]
    quats: Array  # [N, 4]
    scales: Array  # [N, 3]
    opacities: Array  # [N]
    sh: Array  # [N, k, 3]
    antialiased: bool = field(default=False, kw_only=True)
    brushes: NDArray[np.uint8] | None = field(default=None, kw_only=True)  # [N]
    ids: NDArray[np.int32] | None = field(default=None, kw_only=True)  # [N]
    regions: NDArray[np.uint8] | None = field(default=None, kw_only=True)  # [N]
    finest: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        freeze_columns("Gaussians", self, _GAUSSIAN_INTEGERS)
        sizes = check(
            "Gaussians",
            means=(self.means, "N 3"),
            quats=(self.quats, "N 4"),
            scales=(self.scales, "N 3"),
            opacities=(self.opacities, "N"),
            sh=(self.sh, "N k 3"),
            **{name: (column, "N") for name, column in self._integers().items() if column is not None},
        )
        if sizes["k"] not in SH_TERMS:
            raise ValueError(f"Gaussians: sh must have 1, 4, 9 or 16 terms, got {sizes['k']}")
        check_finite("Gaussians", self)
        # The masks of rows are made only where a cheap test of all values at once finds a fault.
        if self.scales.min(initial=0) < 0:
            check_rows("Gaussians", "scales", "be >= 0", np.any(self.scales < 0, axis=1))
        outside = (self.opacities < 0) | (self.opacities > 1)
        check_rows("Gaussians", "opacities", "lie in 0 to 1 (decoded, not logits)", outside)
        if self.finest is not None and not 0 <= self.finest < np.inf:
            raise ValueError(f"Gaussians: finest must be >= 0 and finite, got {self.finest}")
        if not self.quats[:, 0].all():
            check_rows("Gaussians", "quats", "have a length above zero", np.asarray(~self.quats.any(axis=1)))

    def __len__(self) -> int:
        return len(self.means)

    @property
    def sh_degree(self) -> int:
        """Degree of the spherical harmonics, 0 to 3."""
        return SH_TERMS[self.sh.shape[1]]

    def columns(self) -> dict[str, Any]:
        """The columns of numbers by name; `brushes`, `ids` and `regions` are not among them."""
        return {name: getattr(self, name) for name in GAUSSIAN_COLUMNS}

    def _integers(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in _GAUSSIAN_INTEGERS}

    def take(self, rows: RowChoice) -> "Gaussians":
        """The rows chosen by an index array, a mask, a list of either or a slice, in that order.

        Raises:
            TypeError: if it is something else, such as a single number, which would leave no table.
            IndexError: if a row lies beyond the last, or a mask has another length.
        """
        chosen = row_choice("Gaussians", rows)
        columns = self.columns() | self._integers()
        taken: dict[str, Any] = {name: c if c is None else c[chosen] for name, c in columns.items()}
        return replace(self, **taken)

    def __getitem__(self, rows: RowChoice) -> "Gaussians":
        """`take`."""
        return self.take(rows)

    __iter__ = None  # a row alone is no value here; without this Python would try [0], [1] and so on

    def __add__(self, other: "Gaussians") -> "Gaussians":
        """Both, these first, with nothing lost.

        Spherical harmonics are of the higher degree, filled up with zeros, and the dtype is the wider one.
        Where one alone has `brushes` or `regions`, the others take the first brush and lie elsewhere (0);
        where one alone has `ids`, the others rest (-1).

        Raises:
            ValueError: if one was trained `antialiased` and the other was not: they are drawn in two ways.
        """
        if not isinstance(other, Gaussians):
            return NotImplemented
        if self.antialiased != other.antialiased:
            raise ValueError(
                "Gaussians: both must be antialiased, or neither; set it with dataclasses.replace"
            )
        return Gaussians.joined([self._in_the_form_of(other), other])

    def _in_the_form_of(self, other: "Gaussians") -> "Gaussians":
        """The same with the wider dtype, the higher SH degree and the columns of both."""
        columns: dict[str, Any] = self.astype(np.result_type(self.means, other.means).type).columns()
        columns["sh"] = _with_terms(columns["sh"], max(self.sh.shape[1], other.sh.shape[1]))
        for name, dtype in _GAUSSIAN_INTEGERS.items():
            if getattr(self, name) is None and getattr(other, name) is not None:
                columns[name] = np.full(len(self), _WITHOUT[name], dtype)
        return replace(self, **columns)

    def __repr__(self) -> str:
        facts = [f"{len(self):,}", f"SH {self.sh_degree}"]
        facts += ["float64"] if self.means.dtype == np.float64 else []
        facts += ["antialiased"] if self.antialiased else []
        facts += [name for name, column in self._integers().items() if column is not None]
        return f"Gaussians({', '.join(facts)})"

    @staticmethod
    def joined(parts: "Sequence[Gaussians]") -> "Gaussians":
        """Several behind each other, with the SH degree, the dtype and the columns of the first.

        Terms above that degree are cut, those that a part lacks are zero. Parts without brushes or regions
        have 0 there, parts without ids -1.

        Args:
            parts: at least one.
        """
        first, num_terms = parts[0], parts[0].sh.shape[1]
        columns: dict[str, Any] = {}
        for name, column in (first.columns() | first._integers()).items():
            if column is None:
                columns[name] = None
                continue
            others = [getattr(part, name) for part in parts[1:]]
            if name == "sh":
                others = [_with_terms(other, num_terms) for other in others]
            others = [
                np.full(len(part), _WITHOUT[name], column.dtype)
                if other is None
                else other.astype(column.dtype, copy=False)
                for part, other in zip(parts[1:], others, strict=True)
            ]
            columns[name] = np.concatenate([column, *others])
        return replace(first, **columns)

    def astype(self, dtype: type[np.floating[Any]]) -> "Gaussians":
        """The same Gaussians with all columns of numbers as float32 or float64."""
        cast = {name: column.astype(dtype, copy=False) for name, column in self.columns().items()}
        return replace(self, **cast)


@dataclass(frozen=True, eq=False)
class FirstView:
    """How a scene is seen where the user gives no view.

    It is all that the cameras of a scene depend on beside the options of the user, so strokes that carry the
    first view of their scene are seen by the very same cameras.

    Attributes:
        points: [m, 3] points of the subject, float64, world units: the vertices of its convex hull, which is
            all that framing depends on.
        up: [3] unit vector, world axes.
        azimuth: radians, see `frame_scene`.
        elevation: radians above the horizon.
        eye: [3] where a scene is seen from inside: position of the camera, which looks along azimuth and
            elevation; None if the subject is framed from outside.
        has_surroundings: whether the scene is more than its subject.
        probability: that `up` is right, 0 to 1; None where it was not estimated but stated.
        ups: the six axes with their probabilities, the most probable first; empty where up was stated.
        front: azimuth of the front of the subject, radians; `azimuth` may lie to one side of it.
        is_front_sure: False where the front was estimated and its back shows hardly less.
        whole: [2, 3] low and high corner of the whole scene but for strays; None where it is its subject.
        stood: [k, 2] azimuths and elevations, radians, from which the scene was photographed; None where that
            is not known.
    """

    points: NDArray[np.float64]
    up: NDArray[np.float64]
    azimuth: float
    elevation: float
    eye: NDArray[np.float64] | None = None
    has_surroundings: bool = False
    probability: float | None = None
    ups: tuple[tuple[str, float], ...] = ()
    front: float = 0.0
    is_front_sure: bool = True
    whole: NDArray[np.float64] | None = None
    stood: NDArray[np.float64] | None = None


@dataclass(frozen=True, eq=False)
class Camera:
    """One pinhole camera.

    Attributes:
        viewmat: [4, 4] camera from world, rigid (rotation and translation, no scale), float64.
        K: [3, 3] pinhole intrinsics in pixels, without skew, float64.
        width: image width in pixels, >= 1.
        height: image height in pixels, >= 1.
        near: camera z in world units at or below which Gaussians are culled, > 0.

    Raises:
        ValueError: if a shape or value breaks the rules above.
    """

    viewmat: NDArray[np.float64]  # [4, 4]
    K: NDArray[np.float64]  # [3, 3]
    width: int
    height: int
    near: float = 0.01

    def __post_init__(self) -> None:
        viewmat = np.array(self.viewmat, dtype=np.float64)
        K = np.array(self.K, dtype=np.float64)
        check("Camera", viewmat=(viewmat, "4 4"), K=(K, "3 3"))
        for name, matrix in (("viewmat", viewmat), ("K", K)):
            if not np.isfinite(matrix).all():
                raise ValueError(f"Camera: {name} must be finite, got {matrix.tolist()}")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        rotation = viewmat[:3, :3]
        is_rotation = np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4) and np.linalg.det(rotation) > 0
        if not is_rotation or not np.array_equal(viewmat[3], (0, 0, 0, 1)):
            raise ValueError(
                "Camera: viewmat must be a rotation and a translation; remove scale and mirroring"
            )
        if (
            K[0, 0] <= 0
            or K[1, 1] <= 0
            or K[0, 1] != 0
            or K[1, 0] != 0
            or not np.array_equal(K[2], (0, 0, 1))
        ):
            raise ValueError(f"Camera: K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {K.tolist()}")
        if self.width < 1 or self.height < 1:
            raise ValueError(f"Camera: size must be at least 1x1, got {self.width}x{self.height}")
        if not self.near > 0:
            raise ValueError(f"Camera: near must be > 0, got {self.near}")

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, -1.0, 0.0),
        *,
        width: int,
        height: int,
        fov_y: float = radians(50.0),
        near: float = 0.01,
    ) -> "Camera":
        """A camera at `eye` that looks at `target`, with `up` pointing up in the picture.

        Args:
            eye: [3] camera centre, world units.
            target: [3] point in the middle of the picture, world units.
            up: [3] direction in the world, any length. Where it is parallel to the view another
                axis takes its place.
            width: pixels.
            height: pixels.
            fov_y: vertical field of view, radians, in (0, pi).
            near: world units, > 0.

        Raises:
            ValueError: if `eye` and `target` coincide or `fov_y` is out of range.

        Example:
            >>> bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=640, height=480)
            Camera(640x480, 50 degrees high, at 0, -1, -4)
        """
        eye, target, up = (np.asarray(v, dtype=np.float64) for v in (eye, target, up))
        forward = target - eye
        distance = np.linalg.norm(forward)
        if not distance > 0 or not np.isfinite(distance):
            raise ValueError(f"Camera: eye and target must differ, got {eye.tolist()} and {target.tolist()}")
        if not 0 < fov_y < np.pi:
            raise ValueError(f"Camera: fov_y must be in (0, pi) radians, got {fov_y}")
        forward = forward / distance
        right = np.cross(forward, up)
        if np.linalg.norm(right) < 1e-9 * np.linalg.norm(up) + 1e-300:
            right = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
        right = right / np.linalg.norm(right)
        viewmat = np.eye(4)
        viewmat[:3, :3] = right, np.cross(forward, right), forward
        viewmat[:3, 3] = -viewmat[:3, :3] @ eye
        focal = 0.5 * height / np.tan(0.5 * fov_y)
        K = np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])
        return cls(viewmat, K, width, height, near)

    def __repr__(self) -> str:
        fov = np.degrees(2 * np.arctan(0.5 * self.height / self.K[1, 1]))
        x, y, z = self.position
        return f"Camera({self.width}x{self.height}, {fov:.4g} degrees high, at {x:.4g}, {y:.4g}, {z:.4g})"

    @property
    def position(self) -> NDArray[np.float64]:
        """[3] camera centre in world units."""
        return np.asarray(-self.viewmat[:3, :3].T @ self.viewmat[:3, 3])

    def resized(self, width: int, height: int) -> "Camera":
        """The same view in another size: the vertical field of view stays, the sides are cropped or grow."""
        factor = height / self.height
        K = self.K.copy()
        K[:2, :2] *= factor
        K[0, 2] = 0.5 * width + (K[0, 2] - 0.5 * self.width) * factor
        K[1, 2] *= factor
        return replace(self, K=K, width=width, height=height)

    def in_side(self, side: int) -> "Camera":
        """The same view, `resized` so that its longer side has so many pixels, >= 1."""
        share = side / max(self.width, self.height)
        return self.resized(max(round(share * self.width), 1), max(round(share * self.height), 1))


_BOX_INTEGERS: dict[str, type[np.integer[Any]]] = {"ids": np.int32, "brushes": np.uint8}


@dataclass(frozen=True, eq=False)
class Boxes:
    """M oriented rectangles on the image plane, one a stroke, nearest first.

    Columns are arrays of float32 or of float64, `ids` of int32, `brushes` of uint8, or lists of numbers; see
    `Gaussians`.

    Attributes:
        centers: [M, 2] (x, y), pixels.
        half_extents: [M, 2] (along u, along v), pixels, >= 0.
        angles: [M] direction of the u axis, radians from +x towards +y; v = (-sin, cos).
        depths: [M] camera z of the centre, world units, ascending.
        colors: [M, 3] RGB, >= 0, display-encoded.
        opacities: [M] 0 to 1.
        ids: [M] int32, the Gaussian (row) behind each box.
        softness: [M] world units, >= 0, or None. Two boxes whose depths differ by less than the root of the
            sum of their squared softness hide each other in part, see `rasterize`; None is zero for all.
        setbacks: [M] world units, >= 0, or None: how far behind each stroke its underpaint lies, see
            `rasterize`; None for boxes without.
        brushes: [M] uint8, the brush of each box: its row of a `BrushSet`; None: the first for all.
        reliefs: [M, 2] pixels, >= 0, or None: the thickness of each stroke's paint, and what the height of
            its brush, less 1/2, is multiplied by; see `rasterize`.

    Raises:
        TypeError: if a column has another dtype.
        ValueError: if a shape is wrong, the depths descend or a softness, setback or relief is negative.

    Example:
        >>> boxes = bg.project(strokes, camera)
        >>> nearest = boxes[:100]
        >>> nearest.centers.shape
        (100, 2)
    """

    centers: Array  # [M, 2]
    half_extents: Array  # [M, 2]
    angles: Array  # [M]
    depths: Array  # [M]
    colors: Array  # [M, 3]
    opacities: Array  # [M]
    ids: NDArray[np.int32]  # [M]
    softness: Array | None = None  # [M]
    setbacks: Array | None = None  # [M]
    brushes: NDArray[np.uint8] | None = None  # [M]
    reliefs: Array | None = None  # [M, 2]

    def __post_init__(self) -> None:
        freeze_columns("Boxes", self, _BOX_INTEGERS)
        check(
            "Boxes",
            centers=(self.centers, "M 2"),
            half_extents=(self.half_extents, "M 2"),
            angles=(self.angles, "M"),
            depths=(self.depths, "M"),
            colors=(self.colors, "M 3"),
            opacities=(self.opacities, "M"),
            ids=(self.ids, "M"),
            **{name: (column, _OPTIONAL[name]) for name, column in self._optional().items()},
            **({} if self.brushes is None else {"brushes": (self.brushes, "M")}),
        )
        check_finite("Boxes", self)
        check_rows("Boxes", "depths", "ascend: sort by depth", np.diff(self.depths) < 0)
        for name, column in self._optional().items():
            if column.min(initial=0) < 0:
                check_rows("Boxes", name, "be >= 0", np.any(column.reshape(len(self), -1) < 0, axis=1))

    def __len__(self) -> int:
        return len(self.centers)

    def _optional(self) -> dict[str, Array]:
        columns = {name: getattr(self, name) for name in _OPTIONAL}
        return {name: column for name, column in columns.items() if column is not None}

    def attributes(self) -> dict[str, Array]:
        """The columns that become layers of a frame, by the name of the layer; see `LAYER_COLUMNS`."""
        columns = {name: getattr(self, column) for name, column in LAYER_COLUMNS.items()}
        return {name: column for name, column in columns.items() if column is not None}

    def take(self, rows: RowChoice) -> "Boxes":
        """The rows chosen as those of `Gaussians`, in that order, which must be one by depth."""
        chosen = row_choice("Boxes", rows)
        columns = {f.name: getattr(self, f.name) for f in fields(self)}
        taken: dict[str, Any] = {n: None if c is None else c[chosen] for n, c in columns.items()}
        return Boxes(**taken)

    def __getitem__(self, rows: RowChoice) -> "Boxes":
        """`take`."""
        return self.take(rows)

    __iter__ = None  # as of Gaussians

    def __repr__(self) -> str:
        facts = [f"{len(self):,}"] + (["float64"] if self.centers.dtype == np.float64 else [])
        facts += [*self._optional()] + ([] if self.brushes is None else ["brushes"])
        return f"Boxes({', '.join(facts)})"

    def astype(self, dtype: type[np.floating[Any]]) -> "Boxes":
        """The same boxes with all columns but `ids` and `brushes` as float32 or float64."""
        floats = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _BOX_INTEGERS}
        cast: dict[str, Any] = {n: c if c is None else c.astype(dtype, copy=False) for n, c in floats.items()}
        return replace(self, **cast)


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture.

    A notebook shows it as it is: transparent where nothing is painted, at most 1024 pixels wide and high.
    `np.asarray(frame)` is what image libraries take: [H, W, 4] RGBA, 0 to 1, colour not multiplied by alpha,
    as in `plt.imshow(frame)`; as bytes, `PIL.Image.fromarray(np.asarray(frame, np.uint8))`.

    Attributes:
        rgb: [H, W, 3] colour premultiplied by alpha, display-encoded, float32 or float64.
        alpha: [H, W] 1 - transmittance, 0 to 1.
        depth: [H, W] alpha-weighted mean camera z, 0 where nothing is painted; None if the frame has none.
        height: [H, W] how high the paint stands, pixels: the sum over strokes of the weight of their colour
            times the height of their paint, so 0 where nothing is painted, see `rasterize`; None if the frame
            has none.
        layers: those that were asked for, by name: "depth" and "height" as above; "normal" [H, W, 3] unit
            vectors in camera axes, 0 where nothing is painted; "motion" [H, W, 2] (right, down), pixels to
            where the same paint is in the next frame; "uv" [H, W, 2] place on the stroke that shows most,
            0 to 1; "unlit" [H, W, 4] the picture without the lamp, premultiplied; and mattes: "stroke",
            "brush", "region", "layer". With any comes "paint" [H, W], how much of a pixel is painted, also
            where a ground makes the picture opaque.
        deep: every stroke in every pixel, where that was asked for.

    Example:
        >>> frame = bg.render(strokes, camera, "flat")
        >>> np.asarray(frame).shape
        (240, 320, 4)
        >>> frame.over("white").shape
        (240, 320, 3)
    """

    rgb: Array  # [H, W, 3]
    alpha: Array  # [H, W]
    depth: Array | None = None  # [H, W]
    height: Array | None = None  # [H, W]
    layers: Mapping[str, Layer] = field(default_factory=dict, kw_only=True)
    deep: DeepSamples | None = field(default=None, kw_only=True)

    def __repr__(self) -> str:
        height, width = self.alpha.shape
        facts = [f"{width}x{height}"] + (["float64"] if self.rgb.dtype == np.float64 else [])
        facts += ["depth"] if self.depth is not None else []
        facts += ["height"] if self.height is not None else []
        facts += [f"layers {' '.join(self.layers)}"] if self.layers else []
        facts += ["deep"] if self.deep is not None else []
        return f"Frame({', '.join(facts)})"

    def straight_colors(self) -> Array:
        """[H, W, 3] colour not multiplied by alpha; 0 where nothing is painted."""
        alpha = self.alpha[..., None]
        return np.divide(self.rgb, alpha, out=np.zeros_like(self.rgb), where=alpha > 0)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """[H, W, 4] RGBA as image libraries take it: display-encoded, straight alpha, clipped to 0 to 1.

        Args:
            dtype: of floats; None for that of the frame. Or uint8 or uint16, for 0 to 255 or 65535.
            copy: the array is always a new one, so it must not be False.

        Raises:
            TypeError: if `dtype` is another.
            ValueError: if `copy` is False.
        """
        if copy is False:
            raise ValueError("Frame: its RGBA is a new array, so copy must not be False")
        kind = self.rgb.dtype if dtype is None else np.dtype(dtype)
        rgba = np.concatenate([self.straight_colors(), self.alpha[..., None]], axis=-1).clip(0, 1)
        if kind.kind == "f":
            return rgba.astype(kind, copy=False)
        if kind not in (np.uint8, np.uint16):
            raise TypeError(f"Frame: dtype must be one of floats, uint8 or uint16, got {kind}")
        return (rgba * np.iinfo(kind).max + 0.5).astype(kind)

    def _repr_png_(self) -> bytes:
        """What a notebook shows: the frame as `brushgs.save` writes a PNG, made smaller where it is large."""
        height, width = self.alpha.shape
        step = -(-max(height, width) // _SHOWN_SIDE)
        shown = self if step == 1 else Frame(_averaged(self.rgb, step), _averaged(self.alpha, step))
        pixels = np.asarray(shown, np.uint8)
        return png_bytes(pixels[..., :3] if (pixels[..., 3] == 255).all() else pixels)

    def over(self, background: Sequence[float] | Array | str) -> Array:
        """The picture on a background, [H, W, 3].

        Args:
            background: one RGB colour or an [H, W, 3] array, display-encoded, 0 to 1; or a colour as on the
                command line: "#rrggbb" or a name, such as "white", "toned" or "gray".

        Raises:
            ValueError: if it has another shape, or is no known colour.
        """
        return np.asarray(self.rgb + (1 - self.alpha[..., None]) * self._behind(background))

    def bytes_over(self, background: Sequence[float] | Array | str) -> NDArray[np.uint8]:
        """The picture on a background as a screen shows it, uint8 [H, W, 3]: `over`, clipped and rounded.

        One pass over memory: a sixth of the time of rounding the result of `over`, and the same bits.

        Args:
            background: see `over`.
        """
        from brushgs.native import core as _core

        rgb, alpha, behind = map(np.ascontiguousarray, (self.rgb, self.alpha, self._behind(background)))
        pixels = np.empty(rgb.shape, np.uint8)
        num_threads = num_threads_or_default(None)
        _core.finish(rgb=rgb, alpha=alpha, background=behind, num_threads=num_threads, bytes=pixels)
        return pixels

    def _behind(self, background: Sequence[float] | Array | str) -> Array:
        """The background in the dtype of the frame, [3] or [H, W, 3]."""
        rgb = rgb_of(background) if isinstance(background, str) else background
        behind = np.asarray(rgb, dtype=self.rgb.dtype)
        if behind.shape not in ((3,), self.rgb.shape):
            raise ValueError(
                f"over: background must have shape [3] or {list(self.rgb.shape)}, got {list(behind.shape)}"
            )
        return behind


def _averaged(values: Array, step: int) -> Array:
    """Means of blocks of step x step pixels of [H, W, ...]; those at the right and lower edge are smaller."""
    height, width = values.shape[:2]
    rows, columns = np.arange(0, height, step), np.arange(0, width, step)
    sums = np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff(rows, append=height), np.diff(columns, append=width)).astype(values.dtype)
    return np.asarray(sums / counts.reshape(counts.shape + (1,) * (values.ndim - 2)))


def _with_terms(sh: Array, num_terms: int) -> Array:
    """Coefficients [N, k, 3] with so many terms: cut, or filled with zeros."""
    missing = num_terms - sh.shape[1]
    return np.pad(sh, ((0, 0), (0, missing), (0, 0))) if missing > 0 else sh[:, :num_terms]
