"""A painting -> contents of a page: a header and columns of numbers.

The common source of the file of `brushgs export` and the server of `brushgs view`. All numbers come from the
functions of the exact renderer. Names in the header are camelCase, as in JavaScript.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.brushes.brush_set import BrushSet, Sigmas
from brushgs.brushes.texture import StrokeTexture
from brushgs.outlets.page.columns import coarse_to_fine, columns_of, plain_left_out, shown_by
from brushgs.outlets.page.effects import effect_facts, in_page, omitted_of
from brushgs.outlets.page.images import reduced
from brushgs.outlets.page.motion import PageMotion
from brushgs.outlets.page.view import PageView
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.rendering.light import BLUR, LEAST_RISE
from brushgs.rendering.relief import paint_height
from brushgs.rendering.surface import Recipe, Surface
from brushgs.values.arrays import F64, Rows
from brushgs.values.camera import Camera
from brushgs.values.sh import used_sh_degree
from brushgs.version import __version__

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.light import Lamp
    from brushgs.rendering.options import RenderOptions

VERSION = 1  # of the header; grows when a key changes its name or meaning
MOST_GROUND = 640  # px, longer side of a picture used as ground
_HALF = np.finfo(np.float16)
_DTYPES: dict[str, type[np.generic]] = dict.fromkeys(("means", "quats", "scales", "gaps"), np.float32)
_DTYPES |= dict.fromkeys(("brush", "region", "streakStart"), np.uint8)
_DTYPES |= {"fields": np.uint16, "lines": np.uint32}


@dataclass(frozen=True, eq=False)
class PageContents:
    """The contents of a page.

    Attributes:
        header: for JSON, finite numbers only; refers to arrays by name, see `page_contents`.
        arrays: columns and images by name: float32, float16 or unsigned integers.
        rows: for each coat, rows of its strokes in page order.
        omitted: sentences on parts of the painting that the page does not show.
    """

    header: Mapping[str, Any]
    arrays: Mapping[str, NDArray[Any]]
    rows: tuple[Rows, ...] = ()
    omitted: tuple[str, ...] = ()

    @property
    def num_strokes(self) -> int:
        """Number of strokes of all coats."""
        return sum(coat["count"] for coat in self.header["coats"])


class Stop(NamedTuple):
    """A view that a page leads to.

    Attributes:
        title: any text.
        camera: the view; the page keeps its own lens, and is level.
    """

    title: str
    camera: Camera


@dataclass
class _Collected:
    """Header and arrays collected from coats."""

    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    brushes: list[dict[str, Any]] = field(default_factory=list)
    rows: list[Rows] = field(default_factory=list)
    omitted: list[str] = field(default_factory=list)
    _known: dict[tuple[bytes, bytes | None, tuple[float, bytes] | None], int] = field(default_factory=dict)

    def add(self, name: str, array: NDArray[Any], dtype: type[np.generic]) -> str:
        self.arrays[name] = np.ascontiguousarray(array, dtype)
        return name

    def column(self, coat: int, name: str, values: NDArray[Any], usual: type[np.generic]) -> str:
        """Add a column as the dtype in `_DTYPES`, else the usual one; values are clamped to its range."""
        dtype = _DTYPES.get(name, usual)
        if dtype == np.float16:
            values = np.clip(values, float(_HALF.min), float(_HALF.max))
        return self.add(f"coat{coat}.{name}", values, dtype)

    def omit(self, sentence: str) -> None:
        if sentence not in self.omitted:
            self.omitted.append(sentence)

    def brush(self, texture: StrokeTexture) -> int:
        """The index of a brush image in the page; equal ones are stored once."""
        height = None if texture.height is None else paint_height(texture)
        shape = np.array(texture.coverage.shape).tobytes()
        tint = texture.tint
        key = (
            shape + texture.coverage.tobytes(),
            None if height is None else height.tobytes(),
            None if tint is None else (tint.step, tint.texels.tobytes()),
        )
        if key not in self._known:
            index = self._known[key] = len(self.brushes)
            rows, columns = texture.coverage.shape
            self.brushes.append(
                {
                    "name": texture.name,
                    "rows": rows,
                    "columns": columns,
                    "coverage": self.add(f"brush{index}.coverage", texture.coverage, np.uint8),
                    "height": None if height is None else self.add(f"brush{index}.height", height, np.uint8),
                    "tint": None if tint is None else self.add(f"brush{index}.tint", tint.texels, np.uint8),
                    "tintStep": 0.0 if tint is None else tint.step,
                }
            )
        return self._known[key]


def page_contents(
    painting: "Painting",
    camera: Camera,
    *,
    view: PageView,
    title: str,
    command: tuple[str, Sequence[str]],
    background: ArrayLike | None = None,
    regions: Sequence[str] = (),
    stops: Sequence[Stop] = (),
    motion: PageMotion | None = None,
) -> PageContents:
    """The contents of a page for a painting.

    Args:
        painting: at least one coat.
        camera: the first view, as for `render`.
        view: target of the page's camera.
        title: any text; the page shows it as text only.
        command: scene and options of `brushgs render SCENE OPTIONS` that paint the same.
        background: behind the strokes, if the painting has no surface: one RGB color or a picture [H, W, 3];
            None for transparent.
        regions: names of the strokes' regions, from region 1, any text; missing names become numbers.
        stops: views that the page leads through.
        motion: of the strokes, which are then as made, each at its reference moment; None if nothing moves.

    Returns:
        The header has the keys version, title, generator, command, camera (first view, world axes), origin
        (means are relative to it), up, center, radius, isInside, subject, surface, background, isTransparent,
        lamp, brushes, coats and stops; motion, the times of its keys, where strokes move; and regions, their
        names, where a coat has a column of them. Rows of a coat are sorted by `coarse_to_fine`; what belongs
        to a row of the strokes was computed before. Strokes of an opacity under 1/255, which no renderer
        paints, are left out.
    """
    collected = _Collected()
    whole, painting = painting, in_page(painting)
    coats = [
        _coat(number, coat, own, view.center, collected)
        for number, (coat, own) in enumerate(zip(painting.coats, whole.coats, strict=True))
    ]
    for coat in whole.coats:
        for sentence in omitted_of(coat, moves=motion is not None):
            collected.omit(sentence)
    surface = None if painting.surface is None else _surface(painting.surface, collected)
    behind = None if background is None else np.asarray(background, np.float64)
    if surface is None and behind is not None and behind.ndim == 3:
        surface, behind = _board(Recipe("flat", behind, 0.0, 0), collected), None
    header = {
        "version": VERSION,
        "title": title,
        "generator": f"brushgs {__version__}",
        "command": {"scene": command[0], "options": list(command[1])},
        "camera": {
            "viewmat": camera.viewmat.ravel().tolist(),
            "K": camera.K.ravel().tolist(),
            "width": int(camera.width),
            "height": int(camera.height),
            "near": float(camera.near),
        },
        "origin": view.center.tolist(),
        "up": view.up.tolist(),
        "center": view.center.tolist(),
        "radius": view.radius,
        "isInside": view.is_inside,
        "subject": None if view.subject is None else list(view.subject),
        "surface": surface,
        "background": None if behind is None else behind.tolist(),
        "isTransparent": painting.is_transparent,
        "lamp": None if painting.lamp is None else _lamp(painting.lamp.seen_by(camera)),
        "brushes": collected.brushes,
        "coats": coats,
        "stops": [{"title": one.title, "viewmat": one.camera.viewmat.ravel().tolist()} for one in stops],
    }
    if motion is not None:
        _add_motion(header, motion, painting, collected)
    if any("region" in coat["arrays"] for coat in coats):
        header["regions"] = _names_of_regions(painting, regions)
    return PageContents(header, collected.arrays, tuple(collected.rows), tuple(collected.omitted))


def _add_motion(
    header: dict[str, Any], motion: PageMotion, painting: "Painting", collected: _Collected
) -> None:
    header["motion"] = {"times": motion.times.tolist()}
    origin = np.array(header["origin"])
    for number, (coat, rows) in enumerate(zip(painting.coats, collected.rows, strict=True)):
        if coat.plain is not None:
            collected.omit("Gaussians that are not painted stand still in the page")
            rows = rows[rows < len(coat.strokes)]
        found = motion.of_coat(coat.strokes, rows, origin)
        if found is not None:
            numbers, columns = found
            arrays = {
                name: collected.add(f"coat{number}.{name}", values, values.dtype.type)
                for name, values in columns.items()
            }
            header["coats"][number]["motion"] = {**numbers, "arrays": arrays}


def _names_of_regions(painting: "Painting", names: Sequence[str]) -> list[str]:
    """A name for each region from 1, as many as there are names or numbers."""
    columns = [coat.strokes.regions for coat in painting.coats if coat.strokes.regions is not None]
    highest = max(int(column.max(initial=0)) for column in columns)
    return [*names, *(f"Region {number}" for number in range(len(names) + 1, highest + 1))]


def _coat(number: int, coat: "Coat", own: "Coat", origin: F64, collected: _Collected) -> dict[str, Any]:
    """The header of a coat as a page draws it; `own` is the same with its effect."""
    options = coat.options
    brush_set, strokes = BrushSet.of(coat.texture), shown_by(coat)
    is_image = brush_set.kind == "image"
    _note_omitted(coat, brush_set, collected)
    order = coarse_to_fine(strokes)
    rows = order[strokes.opacities[order] >= MIN_ALPHA]
    collected.rows.append(rows)
    brushes, used = brush_set.rows_of("page_contents", strokes.brushes), np.zeros(1, np.intp)
    if brushes is not None and len(rows):
        used = np.unique(brushes[rows].astype(np.intp))
    brush = np.searchsorted(used, brushes) if brushes is not None and len(used) > 1 else None
    columns = columns_of(coat, strokes, origin, brush)
    effect = effect_facts(own, origin)
    if effect["washes"]:  # their colors are mapped when they were blended
        effect["washes"]["shDegree"] = used_sh_degree(own.strokes)
        columns["washSh"] = own.strokes.sh[:, : (used_sh_degree(own.strokes) + 1) ** 2]
    # The outlines of blacks follow tones to 1 in 100,000: half floats would move them.
    usual = np.float32 if effect["blacks"] else np.float16
    arrays = {name: collected.column(number, name, values[rows], usual) for name, values in columns.items()}
    return {
        "name": coat.name,
        "isBackdrop": coat.name == BACKDROP,
        "isOneSided": coat.is_one_sided,
        "isFlat": coat.is_flat,
        "count": len(rows),
        "blend": coat.blend,
        "dry": coat.dry,
        "tolerance": coat.tolerance,
        "border": coat.border,
        "nested": None if coat.nested is None else "dots" if coat.nested.is_round else "lines",
        "kernel": brush_set.kind,
        "brushes": [collected.brush(brush_set.textures[row]) for row in used] if is_image else [],
        "numSigmas": _of_rows(options.num_sigmas, used),
        "lock": _lock(coat),
        "lowPass": options.low_pass,
        "fade": options.fade,
        "antialiased": strokes.antialiased,
        "streaks": options.streaks,
        **_thickness_facts(options, used, is_image=is_image),
        "shDegree": used_sh_degree(strokes),
        **_plain_facts(brush_set, used, has_plain=len(strokes) > len(coat.strokes)),
        **effect,
        "arrays": arrays,
    }


def _lock(coat: "Coat") -> str:
    """How a page gives strokes their directions: it knows no path, so none is tracked."""
    if coat.fields:
        return "canonical"
    return "off" if coat.options.lock == "off" else "anchor"


def _thickness_facts(options: "RenderOptions", used: Rows, *, is_image: bool) -> dict[str, Any]:
    """Underpaint, of brush images only, and relief."""
    underpaint, relief = options.underpaint, options.relief
    below = None
    if underpaint is not None and is_image:
        below = {"opacity": underpaint.opacity, "reach": _of_rows(underpaint.reach, used)}
    return {
        "underpaint": below,
        "relief": None if relief is None else {"thickness": relief.thickness, "gain": relief.gain},
    }


def _plain_facts(brush_set: BrushSet, used: Rows, *, has_plain: bool) -> dict[str, Any]:
    """Which of the used brushes paints plain Gaussians: the last one of the set."""
    last = len(brush_set) - 1
    if brush_set.kind != "image" or not has_plain or last not in used:
        return {}
    return {"plainBrush": int(np.searchsorted(used, last))}


def _of_rows(values: Sigmas, rows: Rows) -> list[float]:
    """The value of each used brush, from one number for all or one per brush."""
    return [float(values[row] if isinstance(values, tuple) else values) for row in rows]


def _note_omitted(coat: "Coat", brush_set: BrushSet, collected: _Collected) -> None:
    options = coat.options
    for sentence in plain_left_out(coat):
        collected.omit(sentence)
    if options.order == "soft":
        collected.omit(
            "strokes of nearly equal depth do not blend in the page: the nearer one covers the other"
        )
    if coat.fields is None and options.lock not in ("off", "anchor"):
        collected.omit(
            "strokes are not tracked in the page, which knows no path: each view has its directions"
        )
    if brush_set.is_directed and options.filter != "mip":
        collected.omit(f"the page samples brushes by the filter 'mip', not {options.filter!r}")


def _surface(surface: Surface, collected: _Collected) -> dict[str, Any]:
    recipe = surface.recipe
    if recipe is None:
        collected.omit("the height and the grain of this surface are not in the page, only its color")
        recipe = Recipe("flat", surface.rgb, 0.0, 0)
    return _board(recipe, collected)


def _board(recipe: Recipe, collected: _Collected) -> dict[str, Any]:
    """The header of a surface of one color [3], or of a picture [H, W, 3], which is stored as an array."""
    color: Any = {"color": recipe.color.astype(np.float64).tolist()}
    if recipe.color.ndim == 3:
        image = reduced(recipe.color, MOST_GROUND)
        if image.shape != recipe.color.shape:
            sizes = " to ".join(f"{shape[1]} x {shape[0]}" for shape in (recipe.color.shape, image.shape))
            collected.omit(f"the picture behind the strokes was scaled from {sizes} pixels")
        color = {"image": collected.add("ground", np.rint(np.clip(image, 0, 1) * 255), np.uint8)}
    return {"kind": recipe.kind, **color, "strength": recipe.strength, "seed": recipe.seed}


def _lamp(lamp: "Lamp") -> dict[str, Any]:
    return {
        "direction": lamp.direction.tolist(),
        "halfWay": lamp.half_way.tolist(),
        "strength": lamp.strength,
        "gloss": lamp.gloss,
        "exponent": lamp.exponent,
        "towards": lamp.towards,
        "leastRise": LEAST_RISE,
        "blur": BLUR,
    }
