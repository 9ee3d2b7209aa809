"""Write styles as JSON that people can edit; `formats.styles` describes and reads it."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing
from brushgs.formats.packed import pack, picture_of, written_json
from brushgs.formats.styles import ATLAS_COLUMNS, MARK, MAX_BYTES, VERSION, style_of
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.values.style import MarkDictionary, NamedColor, Residual, Style, StyleEdit, StyleMarks


def write_style(style: Style, path: str | Path) -> None:
    """See `save_style`."""
    path = Path(path)
    if path.suffix.lower() != STYLE_SUFFIX:
        rule = f"a style must be written to a file *{STYLE_SUFFIX}"
        raise ValueError(f"{rule}, got {str(path)!r}; change the suffix")
    content = content_of(style, path)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def content_of(style: Style, path: Path) -> bytes:
    """The bytes of a style file. Raises ValueError if they could not be read back; `path` is for messages."""
    value: dict[str, Any] = {"brushgs": MARK, "version": VERSION, "name": style.name}
    if style.palette is not None:
        value["palette"] = [_color(color) for color in style.palette.colors]
    if style.marks is not None:
        value["marks"] = _marks(style.marks)
    if (stage := style.stage) is not None:
        value["stage"] = {"colors": pack(stage.colors, "uint8"), "directions": pack(stage.directions, "int8")}
    if (lines := style.lines) is not None:
        color = _hex(lines.rgb)[0]
        value["lines"] = {"share": float(lines.share), "width": float(lines.width), "color": color}
    if style.edit is not None:
        value["edit"] = _edit(style.edit)
    cure = "learn a smaller residual" if style.edit is not None else "keep fewer or smaller brushes"
    return written_json(path, value, "a style", MAX_BYTES, style_of, cure=cure)


def _hex(rgb: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    """A color as "#rrggbb", and as integers 0 to 255."""
    code = np.rint(255 * np.clip(rgb, 0, 1)).astype(int)
    return "#{:02x}{:02x}{:02x}".format(*code), code


def _color(color: NamedColor) -> dict[str, Any]:
    """A palette color; offsets are float16, relative to the color as rounded for the file."""
    text, code = _hex(color.rgb)
    offsets = color.offsets + (color.rgb - code / 255)
    share = round(float(color.share), 6)
    return {"name": color.name, "color": text, "share": share, "offsets": pack(offsets, "float16")}


def _marks(marks: StyleMarks) -> dict[str, Any]:
    """Marks as JSON; directions are in steps of 1/127."""
    value = {
        "length": float(marks.length),
        "aspect": float(marks.aspect),
        "broken_lightness": float(marks.broken_lightness),
        "broken_chroma": float(marks.broken_chroma),
        "ground": None if marks.ground is None else _hex(marks.ground)[0],
        "relief": float(marks.relief),
        "directions": pack(marks.directions, "int8"),
        "brushes": [picture_of(brush[..., None], "Y") for brush in marks.brushes],
    }
    for name, spectrum in (("coherent", marks.coherent), ("incoherent", marks.incoherent)):
        if spectrum is not None:
            sizes = {"lengths": list(spectrum.lengths), "widths": list(spectrum.widths)}
            value[name] = {"share": spectrum.share, **sizes}
    if marks.dictionary is not None:
        value["dictionary"] = _dictionary(marks.dictionary)
    return value


def _dictionary(marks: MarkDictionary) -> dict[str, Any]:
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
        "atlas": picture_of(picture.reshape(rows * height, ATLAS_COLUMNS * width, 4), "RGBA"),
    }


def _edit(edit: StyleEdit) -> dict[str, Any]:
    """An edit as JSON; arrays of the residual are float32."""
    return {
        "affine": [[float(number) for number in row] for row in edit.affine],
        "log_size": float(edit.log_size),
        "residual": None if edit.residual is None else _residual(edit.residual),
    }


def _residual(residual: Residual) -> dict[str, Any]:
    arrays = {name: getattr(residual, name) for name in ("offset", "scale", "centers", "weights", "slopes")}
    return {"features": list(residual.features), "width": float(residual.width)} | {
        name: None if array is None else pack(array, "float32") for name, array in arrays.items()
    }
