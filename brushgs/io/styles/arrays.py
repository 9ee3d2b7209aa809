"""Arrays and small pictures in JSON: base64 of little-endian numbers, or of a PNG."""

import base64
import binascii
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.files import scratch_folder
from brushgs.io.json_file import as_count
from brushgs.io.styles.fields import Fields
from brushgs.io.styles.format import MAX_BYTES, MAX_TEXELS
from brushgs.values.arrays import F64, U8

ArrayType = Literal["uint8", "int8", "float16", "float32"]
_DTYPES = {"uint8": "|u1", "int8": "|i1", "float16": "<f2", "float32": "<f4"}
_ONE = {"uint8": 255, "int8": 127}  # the integer that stands for 1
_MAX_DIMENSIONS = 3
_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_ATTRIBUTES = {"png:compressionLevel": 9}


def pack(values: NDArray[Any], type: ArrayType) -> dict[str, Any]:
    """An array as JSON, of a type of `format`. Values beyond the range of an integer type are clipped."""
    if type in _ONE:
        limits = np.iinfo(_DTYPES[type])
        values = np.clip(np.rint(values.astype(np.float64) * _ONE[type]), limits.min, limits.max)
    data = np.ascontiguousarray(values).astype(_DTYPES[type]).tobytes()
    return {"type": type, "shape": list(values.shape), "data": base64.b64encode(data).decode()}


def take_array(fields: Fields, name: str, shape: tuple[int | None, ...], largest: float) -> F64:
    """A field as an array of finite numbers.

    Args:
        fields: of the object.
        name: of the field.
        shape: its sizes; None for any above 0.
        largest: magnitude allowed.

    Raises:
        SceneError: if it is something else.
    """
    wanted = f"an array of shape [{', '.join('any' if side is None else str(side) for side in shape)}]"
    value = fields.take(name, wanted)
    array = _unpacked(fields, name, value) if isinstance(value, dict) else _listed(value)
    if array is None or array.ndim != len(shape):
        fields.refuse(name, f"{wanted}, a list or packed", value)
    if not all(n == side or (side is None and n > 0) for n, side in zip(array.shape, shape, strict=True)):
        fields.refuse(name, wanted, [float(side) for side in array.shape])
    if not (np.abs(array) <= largest).all():
        fields.refuse(
            name, f"finite numbers of at most {largest:g}", float(array[~(np.abs(array) <= largest)][0])
        )
    return array


def _unpacked(fields: Fields, name: str, value: object) -> F64:
    parts = Fields(fields.path, value, f"of {name} {fields.where}".rstrip())
    type = parts.take("type", "one of " + ", ".join(_DTYPES))
    if not isinstance(type, str) or type not in _DTYPES:
        parts.refuse("type", f"one of {', '.join(_DTYPES)}", type)
    sides = [as_count(side, MAX_BYTES) for side in parts.entries("shape", "sizes", 1, _MAX_DIMENSIONS)]
    data = take_bytes(parts)
    parts.end()
    dtype = np.dtype(_DTYPES[type])
    count = int(np.prod([MAX_BYTES if side is None else side for side in sides], dtype=object))
    if None in sides or len(data) != count * dtype.itemsize:
        raise SceneError(
            fields.path,
            f"'data' {parts.where} must be {count} numbers of {dtype.itemsize} bytes, as 'shape' and 'type' "
            f"say, got {len(data)} bytes; learn the style again",
        )
    numbers = np.frombuffer(data, dtype).astype(np.float64) / _ONE.get(type, 1)
    return numbers.reshape([side for side in sides if side is not None])


def _listed(value: object) -> F64 | None:
    """A list, of lists, of numbers; None for anything else."""
    shape: list[int] = []
    first = value
    while isinstance(first, list) and first and len(shape) < _MAX_DIMENSIONS:
        shape.append(len(first))
        first = first[0]
    level = [value]
    for side in shape:
        if not all(isinstance(part, list) and len(part) == side for part in level):
            return None
        level = [inner for part in level if isinstance(part, list) for inner in part]
    if not shape or not all(isinstance(number, float) for number in level):
        return None
    return np.array(level, np.float64).reshape(shape)


def take_bytes(fields: Fields) -> bytes:
    """The field "data", base64."""
    rule = "base64"
    value = fields.take("data", rule)
    try:
        return base64.b64decode(value if isinstance(value, str) else "?", validate=True)
    except (binascii.Error, ValueError):
        fields.refuse("data", rule, value, "learn the style again")


def pack_picture(texels: U8) -> dict[str, Any]:
    """A grey picture [h, w] as JSON."""
    from brushgs.io.pictures.oiio import write_pixels

    with scratch_folder() as folder:
        path = folder / "brush.png"
        write_pixels(path, "png", texels[..., None], ("Y",), _PNG_ATTRIBUTES)
        return {"type": "png", "data": base64.b64encode(path.read_bytes()).decode()}


def take_picture(fields: Fields) -> U8:
    """The grey picture [h, w] that `fields` are.

    Raises:
        SceneError: if it is something else, or has more than 256 texels a side.
    """
    from brushgs.io.pictures.images import read_bytes

    if (type := fields.take("type", "'png'")) != "png":
        fields.refuse("type", "'png'", type)
    data = take_bytes(fields)
    fields.end()
    rule = f"'data' {fields.where} must be a PNG of 8 bits of grey and at most {MAX_TEXELS} texels a side"
    if not data.startswith(_PNG):
        raise SceneError(fields.path, f"{rule}, got another file; learn the style again")
    with scratch_folder() as folder:
        path = folder / "brush.png"
        path.write_bytes(data)
        try:
            texels = read_bytes(path, MAX_TEXELS**2)
        except SceneError as error:
            reason = str(error).removeprefix(f"{path}: ").partition(";")[0]
            raise SceneError(fields.path, f"{rule}, got one that {reason}; learn the style again") from None
    height, width, channels = texels.shape
    if channels != 1 or max(height, width) > MAX_TEXELS:
        got = f"{channels} channels in {width}x{height}"
        raise SceneError(fields.path, f"{rule}, got {got}; learn the style again")
    return np.ascontiguousarray(texels[..., 0])
