"""A painted view with its inputs -> requested layers, and deep samples."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from brushgs.rendering.deep import DeepMaker, Lighting, Rest
from brushgs.rendering.fragments import Fragments
from brushgs.rendering.marks import LaidCoat, Marks
from brushgs.rendering.mattes import MatteMaker, by_brush, by_layer, by_region, by_stroke, rest_name
from brushgs.rendering.places import PixelMaps, dominant_marks, motion_maps, uv_maps
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame, Sheet
from brushgs.values.layers import Layer
from brushgs.values.quats import rotation_matrices

if TYPE_CHECKING:
    from brushgs.rendering.wanted import Following, Wanted
    from brushgs.values.camera import Camera
    from brushgs.values.paths import Paths


@dataclass(frozen=True, eq=False)
class PaintedView:
    """The inputs of layers.

    Attributes:
        camera: the view.
        laid: its coats, in the order of laying.
        frame: the picture.
        unlit: the picture without the lamp.
        coverage: [H, W] alpha of the paint.
        rest: the layer behind the strokes, or None.
        is_opaque: whether `rest` is an opaque ground.
        lighting: None without a lamp.
        region_names: of the rules of the scene, in order.
        sheets: coats and light as layers; empty if not requested.
    """

    camera: "Camera"
    laid: tuple[LaidCoat, ...]
    frame: Frame
    unlit: Frame
    coverage: Array  # [H, W]
    rest: Rest | None
    is_opaque: bool
    lighting: Lighting | None
    region_names: Sequence[str] = ()
    sheets: tuple[Sheet, ...] = ()


class Maker(Protocol):
    """Collects a layer, a band of rows at a time."""

    def add(self, rows: slice, fragments: Fragments) -> None:
        """Add the fragments of the next band of rows."""


def with_layers(view: PaintedView, wanted: "Wanted") -> Frame:
    """The frame with the requested layers; layers that it cannot have are left out."""
    frame, layers = view.frame, _picture_layers(view, wanted)
    if not wanted.needs_strokes:
        return replace(frame, layers=layers, sheets=view.sheets)
    paths = _paths(view) if wanted.paths else None
    if paths is not None and not (wanted.deep or wanted.layers):
        return replace(frame, paths=paths)
    marks = Marks(view.laid, view.camera, frame.rgb.dtype)
    mattes = _mattes(view, marks, wanted)
    normal = NormalMaker(marks) if "normal" in wanted.layers else None
    following = wanted.following if "motion" in wanted.layers else None
    places = PlaceMaker(marks, following, has_uv="uv" in wanted.layers)
    deep = DeepMaker(marks, view.rest, view.lighting) if wanted.deep else None
    _fill(marks, [*mattes.values(), normal, places if places.planes else None, deep])
    if normal is not None:
        layers["normal"] = normal.normals
    layers |= places.planes | {name: matte.result() for name, matte in mattes.items()}
    return replace(frame, layers=layers, deep=None if deep is None else deep.result(), paths=paths)


def _fill(marks: Marks, makers: "Sequence[Maker | None]") -> None:
    """Show all fragments to those makers that there are."""
    asked = [maker for maker in makers if maker is not None]
    for rows, fragments in marks.bands():
        for maker in asked:
            maker.add(rows, fragments)


def _paths(view: PaintedView) -> "Paths":
    from brushgs.rendering.paths import paths_of

    ground = None
    if view.is_opaque and view.rest is not None:
        red, green, blue = np.asarray(view.rest.rgb, np.float64).reshape(-1, 3).mean(axis=0)
        ground = float(red), float(green), float(blue)
    return paths_of(view.laid, view.camera, ground, view.region_names)


def _picture_layers(view: PaintedView, wanted: "Wanted") -> dict[str, Layer]:
    """Layers that come with the picture: no strokes needed."""
    frame, layers = view.frame, dict[str, Layer](paint=view.coverage)
    for name, plane in (("depth", frame.depth), ("height", frame.height)):
        if name in wanted.layers and plane is not None:
            layers[name] = plane
    if "unlit" in wanted.layers:
        layers["unlit"] = np.concatenate([view.unlit.rgb, view.unlit.alpha[..., None]], axis=2)
    return layers


def _mattes(view: PaintedView, marks: Marks, wanted: "Wanted") -> dict[str, MatteMaker]:
    mattes = {}
    if "stroke" in wanted.layers:
        mattes["stroke"] = MatteMaker(marks, by_stroke(marks))
    if "id" in wanted.layers:
        mattes["brush"] = MatteMaker(marks, by_brush(marks))
        if (regions := by_region(marks, view.region_names)) is not None:
            mattes["region"] = MatteMaker(marks, regions)
        rest = rest_name(marks, is_opaque=view.is_opaque)
        mattes["layer"] = MatteMaker(marks, by_layer(marks), rest=rest, alpha=view.frame.alpha)
    return mattes


class NormalMaker:
    """Normals of stroke planes: their weighted mean, normalized.

    Attributes:
        normals: [H, W, 3] in camera axes; 0 where nothing is painted.
    """

    def __init__(self, marks: Marks) -> None:
        camera = marks.camera
        self._marks, self._of_marks = (
            marks,
            marks.each(lambda _, laid: normals_of(laid, camera), marks.dtype, 3),
        )
        self.normals = np.zeros((camera.height, camera.width, 3), marks.dtype)

    def add(self, rows: slice, fragments: Fragments) -> None:
        """Add the fragments of the next band of rows."""
        sums = fragments.sums(self._of_marks, self._marks.num_threads)
        lengths = np.sqrt(np.einsum("pc,pc->p", sums, sums))[:, None]
        unit = np.divide(sums, lengths, out=np.zeros_like(sums), where=lengths > 0)
        self.normals[rows] = unit.reshape(self.normals[rows].shape)


def normals_of(laid: LaidCoat, camera: "Camera") -> Array:
    """[M, 3] the normal of the plane of each stroke, its shortest axis, toward the camera; camera axes."""
    ids = laid.boxes.ids
    quats, scales, means = (
        laid.column(name)[ids].astype(np.float64) for name in ("quats", "scales", "means")
    )
    axes = rotation_matrices(quats)[np.arange(len(ids)), :, np.argmin(scales, axis=1)]
    normals = axes @ camera.viewmat[:3, :3].T
    seen_from = means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    faces_away = (normals * seen_from).sum(axis=1) > 0
    return np.asarray(np.where(faces_away[:, None], -normals, normals))


class PlaceMaker:
    """Position of a pixel's paint on its stroke, and its motion.

    Attributes:
        planes: the requested ones of "uv" [H, W, 2], 0 to 1, and "motion" [H, W, 2], pixels.
    """

    def __init__(self, marks: Marks, following: "Following | None", *, has_uv: bool) -> None:
        self._marks, self._maps = marks, dict[str, PixelMaps]()
        if has_uv:
            self._maps["uv"] = PixelMaps(uv_maps(marks))
        if following is not None:
            self._maps["motion"] = PixelMaps(motion_maps(marks, following))
        shape = marks.camera.height, marks.camera.width, 2
        self.planes: dict[str, Layer] = {name: np.zeros(shape, marks.dtype) for name in self._maps}

    def add(self, rows: slice, fragments: Fragments) -> None:
        """Add the fragments of the next band of rows."""
        shown = dominant_marks(fragments, len(self._marks), self._marks.num_threads)
        for name, maps in self._maps.items():
            plane = self.planes[name]
            assert isinstance(plane, np.ndarray), "a plane"
            places = maps.at(shown, rows, self._marks.camera.width).reshape(plane[rows].shape)
            plane[rows] = np.clip(places, 0, 1) if name == "uv" else places
