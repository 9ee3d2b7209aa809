"""Read a `Style` from a style file, JSON that people can read and edit; save one with `save_style`.

    {
      "brushgs": "style", "version": 1, "name": "monet",
      "palette": [{"name": "deep blue", "color": "#1f3a6b", "share": 0.31, "offsets": ARRAY [m, 3]}, ...],
      "marks": {"length": 0.04, "aspect": 4.1, "broken_lightness": 0.02, "broken_chroma": 0.01,
                "ground": "#8a5420", "relief": 0.4, "directions": ARRAY [h, w, 2], "brushes": [PNG, ...],
                "coherent": {"share": 0.6, "lengths": [0.02, 0.03, 0.05], "widths": [...]}, "incoherent": ...,
                "dictionary": {"size": [64, 24], "colors": ARRAY [n, 3], "shares": ARRAY [n], "atlas": PNG}},
      "stage": {"colors": ARRAY [h, w, 3], "directions": ARRAY [h, w, 2]},
      "lines": {"share": 0.2, "width": 0.008, "color": "#141a24"},
      "edit": {"affine": [[1, 0, 0, 0], ...], "log_size": 0, "residual": {...}}
    }

At least one of palette, marks and edit is required; stage and lines are optional. The fields are those of
`Style`. Colors are "#rrggbb" and numbers are plain; only arrays are base64. The offsets of a color are
relative to it, so editing the color moves all colors around it. An array is a nested list of numbers, or
packed: {"type": "float16", "shape": [128, 3], "data": base64}, little-endian; int8 encodes -1 to 1 in steps
of 1/127, uint8 encodes 0 to 1 in steps of 1/255. A picture is {"type": "png", "data": base64} with 8 bits of
grey; the atlas of a dictionary has red, green, blue and alpha, with its n marks row by row, see
`MarkDictionary`. When edited by hand, shares need not add up to 1 (they are normalized), and a color may
have no offsets (then it stands for itself alone).
"""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.packed import CORRECT, JsonFile, PackedArray, Picture, array_of, pack, picture_of, png_of
from brushgs.formats.schema import refused
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.values import style as values
from brushgs.values.arrays import F32, F64, U8
from brushgs.values.colors import code_of, rgb_of
from brushgs.values.style import Style, StyleMarks

MAX_BYTES = 3_000_000
MAX_ATLAS = 4_000_000  # pixels of the atlas of a dictionary
MAX_MARKS, MOST_MARK_TEXELS = 512, 128  # marks of a dictionary, and texels a side of a mark
ATLAS_COLUMNS = 16
MAX_NAME = 80  # characters
MAX_COLORS, MAX_BRUSHES, MAX_FEATURES = 64, 64, 64
MAX_TEXELS = 256  # a side of a brush, and of the field of directions
MAX_CELLS = 512  # a side of the maps of a stage
FARTHEST = 2.0  # largest channel of an offset: colors lie in 0 to 1, and offsets within 1
MOST_FACTOR = 1e3  # largest magnitude in the affine map
MOST = 1e9  # largest magnitude in the residual
CURE = "give a file that `brushgs style learn` wrote"
_LEARN = "learn the style again"

_NAME = f"text of 1 to {MAX_NAME} printable characters"
_Name = Annotated[str, Meta(min_length=1, max_length=MAX_NAME, description=_NAME)]
_Color = Annotated[str, Meta(pattern=r"^#[0-9a-fA-F]{6}\Z", description="a color such as '#3a5f0b'")]
_MarkSide = Annotated[int, Meta(ge=1, le=MOST_MARK_TEXELS)]
_Sizes = Annotated[list[Annotated[float, Meta(gt=0, le=1)]], Meta(min_length=3, max_length=3)]
_Broken = Annotated[float, Meta(ge=0, le=0.5)]  # as `brushgs.passes.color.broken_color` allows


class _Spectrum(Struct, forbid_unknown_fields=True):
    share: Annotated[float, Meta(ge=0, le=1)]
    lengths: _Sizes
    widths: _Sizes


class _Dictionary(Struct, forbid_unknown_fields=True):
    size: Annotated[list[_MarkSide], Meta(min_length=2, max_length=2)]
    colors: PackedArray
    shares: PackedArray
    atlas: Picture


class _Named(Struct, forbid_unknown_fields=True):
    name: _Name
    color: _Color
    share: Annotated[float, Meta(ge=0, le=1e6)]
    offsets: PackedArray | None = None

    def __post_init__(self) -> None:
        _check_names(".name", self.name)


class _Marks(Struct, forbid_unknown_fields=True):
    length: Annotated[float, Meta(gt=0, le=1)]
    aspect: Annotated[float, Meta(ge=1, le=20)]
    directions: PackedArray
    broken_lightness: _Broken | None = None
    broken_chroma: _Broken | None = None
    ground: _Color | None = None
    relief: Annotated[float, Meta(ge=0, le=1)] | None = None
    brushes: Annotated[list[Picture], Meta(max_length=MAX_BRUSHES)] | None = None
    coherent: _Spectrum | None = None
    incoherent: _Spectrum | None = None
    dictionary: _Dictionary | None = None


class _Stage(Struct, forbid_unknown_fields=True):
    colors: PackedArray
    directions: PackedArray


class _Lines(Struct, forbid_unknown_fields=True):
    share: Annotated[float, Meta(ge=0, le=1)]
    width: Annotated[float, Meta(gt=0, le=0.2)]
    color: _Color


class _Residual(Struct, forbid_unknown_fields=True):
    features: Annotated[list[_Name], Meta(min_length=1, max_length=MAX_FEATURES)]
    width: Annotated[float, Meta(gt=0, le=MOST)]
    offset: PackedArray
    scale: PackedArray
    centers: PackedArray
    weights: PackedArray
    slopes: PackedArray | None = None

    def __post_init__(self) -> None:
        _check_names(".features", *self.features)


class _Edit(Struct, forbid_unknown_fields=True):
    affine: PackedArray
    log_size: Annotated[float, Meta(ge=-10, le=10)] | None = None
    residual: _Residual | None = None


class _File(Struct, forbid_unknown_fields=True):
    brushgs: Any
    version: Any
    name: _Name
    palette: Annotated[list[_Named], Meta(min_length=1, max_length=MAX_COLORS)] | None = None
    marks: _Marks | None = None
    edit: _Edit | None = None
    stage: _Stage | None = None
    lines: _Lines | None = None

    def __post_init__(self) -> None:
        _check_names(".name", self.name)


def _check_names(place: str, *names: str) -> None:
    for name in names:
        if not name.isprintable() or name.isspace() or names.count(name) > 1:
            rule = f"{'different, each ' if len(names) > 1 else ''}{_NAME}"
            raise ValueError(f"{place} must be {rule}, got {name!r}")


_LATER = "update brushgs, or learn the style again"
_OTHER = "where it is a painting, `brushgs style learn` makes one"
_FORMAT = JsonFile("style", _File, "style file", STYLE_SUFFIX, MAX_BYTES, CURE, later=_LATER, other=_OTHER)


def load_style(path: str | Path) -> Style:
    """Read a style from a file that `save_style` or `brushgs style learn` wrote, edited by hand or not.

    Args:
        path: the file, of any name.

    Raises:
        SceneError: if there is no such regular file, it is larger than 3 MB, is no style, has a later
            version, or a field is missing, unknown or wrong; the message names the field.

    Example:
        >>> from brushgs.values.style import StyleEdit
        >>> darker = StyleEdit(0.6 * np.eye(3, 4))
        >>> bg.save_style(bg.Style("dusk", edit=darker), "dusk.style")
        >>> bg.load_style("dusk.style")
        Style('dusk', an edit)
    """
    return _style(Path(path), _FORMAT.read(Path(path)))


read_style = load_style  # the name used within the package


def _style(path: Path, file: _File) -> Style:
    if file.palette is None and file.marks is None and file.edit is None:
        raise SceneError(path, f"holds neither 'palette' nor 'marks' nor 'edit'; {CURE}")
    lines = file.lines
    return Style(
        file.name,
        None if file.palette is None else _palette(path, file.palette),
        None if file.marks is None else _marks(path, file.marks),
        None if file.edit is None else _edit(path, file.edit),
        None if file.stage is None else _stage(path, file.stage),
        None if lines is None else values.StyleLines(lines.share, lines.width, np.array(rgb_of(lines.color))),
    )


def _palette(path: Path, colors: list[_Named]) -> values.StylePalette:
    total = sum(color.share for color in colors)
    if not total > 0:
        raise SceneError(path, "'palette' must have a color with a share above 0, got none; raise one")
    named = []
    for index, color in enumerate(colors):
        place, offsets = f"palette[{index}].offsets", np.zeros((1, 3))
        if color.offsets is not None:
            offsets = array_of(path, place, color.offsets, (None, 3), FARTHEST)
        rgb = np.array(rgb_of(color.color))
        named.append(values.NamedColor(color.name, rgb, color.share / total, offsets.astype(np.float32)))
    return values.StylePalette(tuple(named))


def _marks(path: Path, marks: _Marks) -> StyleMarks:
    directions = _directions(path, "marks.directions", marks.directions, (None, None))
    if max(directions.shape) > MAX_TEXELS:
        rule = f"at most {MAX_TEXELS} a side"
        raise refused(path, "marks.directions", rule, list(directions.shape), CORRECT)
    return StyleMarks(
        length=marks.length,
        aspect=marks.aspect,
        directions=directions,
        broken_lightness=marks.broken_lightness or 0.0,
        broken_chroma=marks.broken_chroma or 0.0,
        ground=None if marks.ground is None else np.array(rgb_of(marks.ground)),
        relief=marks.relief or 0.0,
        brushes=tuple(_texels(path, i, brush.data) for i, brush in enumerate(marks.brushes or [])),
        coherent=_spectrum(path, "marks.coherent", marks.coherent),
        incoherent=_spectrum(path, "marks.incoherent", marks.incoherent),
        dictionary=None if marks.dictionary is None else _dictionary(path, marks.dictionary),
    )


def _stage(path: Path, stage: _Stage) -> values.StyleStage:
    colors = array_of(path, "stage.colors", stage.colors, (None, None, 3), 1.0)
    if max(colors.shape) > MAX_CELLS or min(colors.shape[:2]) < 2:
        rule = f"2 to {MAX_CELLS} a side"
        raise refused(path, "stage.colors", rule, list(colors.shape), CORRECT)
    if colors.min() < 0:
        raise refused(path, "stage.colors", "0 to 1", float(colors.min()), CORRECT)
    directions = _directions(path, "stage.directions", stage.directions, colors.shape[:2])
    return values.StyleStage(colors.astype(np.float32), directions)


def _directions(path: Path, place: str, stored: Any, size: tuple[int | None, ...]) -> F32:
    """[h, w, 2] vectors clamped to length 1, since rounding to int8 may lengthen a unit vector."""
    directions = array_of(path, place, stored, (*size, 2), 1.01)
    lengths = np.linalg.norm(directions, axis=2, keepdims=True)
    return np.asarray(directions / np.maximum(lengths, 1), np.float32)


def _spectrum(path: Path, place: str, stored: _Spectrum | None) -> values.MarkSpectrum | None:
    if stored is None:
        return None
    for name in ("lengths", "widths"):
        if (sizes := getattr(stored, name)) != sorted(sizes):
            raise refused(path, f"{place}.{name}", "ascending", sizes, CORRECT)
    return values.MarkSpectrum(stored.share, tuple(stored.lengths), tuple(stored.widths))


def _dictionary(path: Path, stored: _Dictionary) -> values.MarkDictionary:
    place = "marks.dictionary"
    colors = array_of(path, f"{place}.colors", stored.colors, (None, 3), FARTHEST)
    shares = array_of(path, f"{place}.shares", stored.shares, (len(colors),), 1.0)
    if len(colors) > MAX_MARKS:
        raise refused(path, f"{place}.colors", f"of at most {MAX_MARKS} marks", len(colors), _LEARN)
    (width, height), rows = stored.size, -(-len(colors) // ATLAS_COLUMNS)
    wanted = rows * height, ATLAS_COLUMNS * width
    rule = f"a PNG of 8 bits of red, green, blue and alpha in {wanted[1]}x{wanted[0]} pixels"
    if wanted[0] * wanted[1] > MAX_ATLAS:
        raise refused(path, f"{place}.size", f"of at most {MAX_ATLAS} pixels in all", stored.size, _LEARN)
    pixels = png_of(path, f"{place}.atlas.data", stored.atlas.data, rule, MAX_ATLAS, cure=_LEARN)
    if pixels.shape != (*wanted, 4):
        found = "{1}x{0} in {2} channels".format(*pixels.shape)
        raise SceneError(path, f"{place}.atlas.data must be {rule}, got {found}; {_LEARN}")
    texels = pixels.reshape(rows, height, ATLAS_COLUMNS, width, 4).swapaxes(1, 2)
    own = np.ascontiguousarray(texels.reshape(-1, height, width, 4)[: len(colors)])
    return values.MarkDictionary(colors.astype(np.float32), shares.astype(np.float32), own)


def _edit(path: Path, edit: _Edit) -> values.StyleEdit:
    affine = array_of(path, "edit.affine", edit.affine, (3, 4), MOST_FACTOR)
    if (stored := edit.residual) is None:
        return values.StyleEdit(affine, edit.log_size or 0.0, None)

    def part(name: str, *shape: int | None) -> F64:
        return array_of(path, f"edit.residual.{name}", getattr(stored, name), shape, MOST)

    count = len(stored.features)
    offset, scale, centers = part("offset", count), part("scale", count), part("centers", None, count)
    weights = part("weights", len(centers), None)
    if not (scale > 0).all():
        raise refused(path, "edit.residual.scale", "numbers above 0", float(scale.min()), CORRECT)
    if weights.shape[1] < 3:
        raise refused(path, "edit.residual.weights", "of 3 outputs or more", list(weights.shape), CORRECT)
    slopes = None if stored.slopes is None else part("slopes", len(centers), 3, 3).astype(np.float32)
    at, by, minus, per = (one.astype(np.float32) for one in (centers, weights, offset, scale))
    residual = values.Residual(tuple(stored.features), at, stored.width, by, minus, per, slopes)
    return values.StyleEdit(affine, edit.log_size or 0.0, residual)


def _texels(path: Path, index: int, data: bytes) -> U8:
    """The grey picture of a brush, [h, w]."""
    place = f"marks.brushes[{index}].data"
    rule = f"a PNG of 8 bits of grey and at most {MAX_TEXELS} texels a side"
    texels = png_of(path, place, data, rule, MAX_TEXELS**2, cure=_LEARN)
    height, width, channels = texels.shape
    if channels != 1 or max(height, width) > MAX_TEXELS:
        found = f"{channels} channels in {width}x{height}"
        raise SceneError(path, f"{place} must be {rule}, got {found}; {_LEARN}")
    return np.ascontiguousarray(texels[..., 0])


__all__ = ["load_style", "save_style"]


def save_style(style: Style, path: str | Path) -> None:
    """Write a style to a file *.style, which appears when it is complete; equal styles give equal bytes.

    Args:
        style: must have a palette, marks or an edit.
        path: must end in .style.

    Raises:
        ValueError: if the suffix is wrong, the style would take more than 3 MB, or a value is out of the
            range that `brushgs.values.style` states; then nothing is written.
        SceneError: if the file cannot be written.

    Example:
        >>> from brushgs.values.style import StyleEdit
        >>> darker = StyleEdit(0.6 * np.eye(3, 4))
        >>> bg.save_style(bg.Style("dusk", edit=darker), "dusk.style")
    """
    value: dict[str, Any] = {"name": style.name}
    if style.palette is not None:
        value["palette"] = [_color_json(color) for color in style.palette.colors]
    if style.marks is not None:
        value["marks"] = _marks_json(style.marks)
    if (stage := style.stage) is not None:
        value["stage"] = {"colors": pack(stage.colors, "uint8"), "directions": pack(stage.directions, "int8")}
    if (lines := style.lines) is not None:
        color = code_of(lines.rgb)
        value["lines"] = {"share": float(lines.share), "width": float(lines.width), "color": color}
    if style.edit is not None:
        value["edit"] = _edit_json(style.edit)
    cure = "learn a smaller residual" if style.edit is not None else "keep fewer or smaller brushes"
    _FORMAT.write(path, value, _style, cure)


write_style = save_style  # the name used within the package


def _color_json(color: values.NamedColor) -> dict[str, Any]:
    """A palette color; offsets are float16, relative to the color as rounded for the file."""
    code = code_of(color.rgb)
    offsets = color.offsets + (color.rgb - np.array(rgb_of(code)))
    share = round(float(color.share), 6)
    return {"name": color.name, "color": code, "share": share, "offsets": pack(offsets, "float16")}


def _marks_json(marks: StyleMarks) -> dict[str, Any]:
    """Marks as JSON; directions are in steps of 1/127."""
    value = {
        "length": float(marks.length),
        "aspect": float(marks.aspect),
        "broken_lightness": float(marks.broken_lightness),
        "broken_chroma": float(marks.broken_chroma),
        "ground": None if marks.ground is None else code_of(marks.ground),
        "relief": float(marks.relief),
        "directions": pack(marks.directions, "int8"),
        "brushes": [picture_of(brush[..., None]) for brush in marks.brushes],
    }
    spectra = {"coherent": marks.coherent, "incoherent": marks.incoherent}
    value |= {name: asdict(spectrum) for name, spectrum in spectra.items() if spectrum is not None}
    if marks.dictionary is not None:
        value["dictionary"] = _dictionary_json(marks.dictionary)
    return value


def _dictionary_json(marks: values.MarkDictionary) -> dict[str, Any]:
    """A dictionary as JSON: colors and shares in float16, the marks row by row in one picture."""
    num, height, width = marks.texels.shape[:3]
    rows = -(-num // ATLAS_COLUMNS)
    atlas = np.zeros((rows * ATLAS_COLUMNS, height, width, 4), np.uint8)
    atlas[:num] = marks.texels
    picture = atlas.reshape(rows, ATLAS_COLUMNS, height, width, 4).swapaxes(1, 2)
    return {
        "size": [width, height],
        "colors": pack(marks.colors, "float16"),
        "shares": pack(marks.shares, "float16"),
        "atlas": picture_of(picture.reshape(rows * height, ATLAS_COLUMNS * width, 4)),
    }


def _edit_json(edit: values.StyleEdit) -> dict[str, Any]:
    """An edit as JSON; arrays of the residual are float32."""
    value: dict[str, Any] = {"affine": edit.affine.astype(float).tolist(), "log_size": float(edit.log_size)}
    if (residual := edit.residual) is None:
        return value | {"residual": None}
    value["residual"] = {"features": list(residual.features), "width": float(residual.width)}
    for name in ("offset", "scale", "centers", "weights", "slopes"):
        array = getattr(residual, name)
        value["residual"][name] = None if array is None else pack(array, "float32")
    return value
