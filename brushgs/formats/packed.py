"""Formats of our own in JSON: arrays and pictures are lists of numbers or base64; reading checks bounds."""

import base64
import json
from collections.abc import Callable
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import on_disk, open_plain, replacing
from brushgs.formats.schema import Numbers, as_count, decode, refused, shown
from brushgs.values.arrays import F64, U8

DTYPES = {"uint8": "|u1", "int8": "|i1", "float16": "<f2", "float32": "<f4"}
ONE = {"uint8": 255, "int8": 127}  # the integer that encodes 1
MAX_SIDE = 3_000_000  # of an array
CORRECT = "correct it"  # what to do about a wrong field
_VERSION = 1  # the latest version that is read
_PNG = b"\x89PNG\r\n\x1a\n"
# Straight alpha: colors are kept even where alpha is 0.
_PNG_ATTRIBUTES = {"png:compressionLevel": 9, "oiio:UnassociatedAlpha": 1}

_Side = Annotated[int, Meta(ge=0, le=MAX_SIDE)]


class Packed(Struct, forbid_unknown_fields=True):
    """An array: type, shape, and numbers in little-endian order."""

    type: Literal["uint8", "int8", "float16", "float32"]
    shape: Annotated[list[_Side], Meta(min_length=1, max_length=3)]
    data: bytes

    def __post_init__(self) -> None:
        size = np.dtype(DTYPES[self.type]).itemsize
        if len(self.data) != prod(self.shape) * size:
            rule = f".data must be {prod(self.shape)} numbers of {size} bytes, as 'shape' and 'type' say"
            raise ValueError(f"{rule}, got {len(self.data)} bytes")

    @property
    def array(self) -> F64:
        """The numbers as float64; integer types are divided by `ONE`."""
        numbers = np.frombuffer(self.data, DTYPES[self.type]).astype(np.float64)
        return (numbers / ONE.get(self.type, 1)).reshape(self.shape)


PackedArray = Annotated[Packed | Numbers, Meta(description="an array, a list or packed")]


class Picture(Struct, forbid_unknown_fields=True):
    """A picture as the bytes of a PNG file."""

    type: Literal["png"]
    data: bytes


T = TypeVar("T")


class _Begin(Struct):
    brushgs: Any = None
    version: Any = None


@dataclass(frozen=True)
class JsonFile(Generic[T]):
    """A format of our own: a JSON object that begins with "brushgs": `mark` and "version": 1."""

    mark: str
    schema: type[T]
    what: str  # the file in words, such as "style file"
    suffix: str
    most: int  # bytes
    cure: str  # what to do about another kind of file
    later: str = "update brushgs"  # what to do about a later version
    other: str = ""  # what to do about a file that is no JSON, if not `cure`

    def read(self, path: Path) -> T:
        """The content of a file of any name.

        Raises SceneError if there is no such regular file, it is too large, is another kind of file, has a
        later version, or a field is missing, unknown or wrong; the message names the field.
        """
        with open_plain(path, self.what) as file:
            try:
                return self.parse(path, file.read(self.most + 1))
            except OSError as error:
                raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None

    def parse(self, path: Path, content: bytes) -> T:
        """The content of some bytes; `path` is for messages. Raises as `read` does."""
        if content and not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
            raise SceneError(path, f"is no {self.what}; {self.other or self.cure}")
        if len(content) > self.most:
            most = f"{self.most / 1e6:.3g} MB"
            raise SceneError(path, f"a {self.what} must have at most {most}, got more; {self.cure}")
        begin = decode(path, content, _Begin, self.cure, has_names=True)
        if begin.brushgs != self.mark:
            fact = f'is no {self.what} (it does not begin with "brushgs": "{self.mark}")'
            raise SceneError(path, f"{fact}; {self.cure}")
        number = as_count(begin.version, 1_000_000)
        if not number:
            raise SceneError(path, f"'version' must be {_VERSION}, got {shown(begin.version)}; {self.cure}")
        if number > _VERSION:
            fact = f"is of version {number}, and this brushgs reads up to version {_VERSION}"
            raise SceneError(path, f"{fact}; {self.later}")
        return decode(path, content, self.schema, CORRECT, has_names=True)

    def write(
        self, path: str | Path, value: dict[str, Any], made_of: Callable[[Path, T], object], cure: str
    ) -> None:
        """Write the fields of an object; the file appears when it is complete.

        Raises ValueError if the suffix is wrong, it is too large (`cure` is for that), or it could not be
        read back, by `made_of`; SceneError if it cannot be written.
        """
        path = Path(path)
        if path.suffix.lower() != self.suffix:
            rule = f"a {self.what} must be written to a file *{self.suffix}"
            raise ValueError(f"{rule}, got {str(path)!r}; change the suffix")
        content = (laid_out({"brushgs": self.mark, "version": _VERSION} | value) + "\n").encode()
        if len(content) > self.most:
            rule = f"a {self.what} must take at most {self.most / 1e6:.3g} MB, got {len(content) / 1e6:.3g}"
            raise ValueError(f"{path}: {rule}; {cure}")
        try:
            made_of(path, self.parse(path, content))
        except SceneError as error:
            raise ValueError(f"a {self.what} cannot be written: {error}") from None
        with replacing(path) as temporary:
            temporary.write_bytes(content)


def array_of(path: Path, place: str, value: Any, shape: tuple[int | None, ...], largest: float) -> F64:
    """An array of the given shape with magnitudes up to `largest`; a size of None allows any above 0."""
    wanted = f"an array of shape [{', '.join('any' if side is None else str(side) for side in shape)}]"
    try:
        array = value.array if isinstance(value, Packed) else np.array(value, np.float64)
    except (TypeError, ValueError):
        raise refused(path, place, f"{wanted}, a list or packed", value, CORRECT) from None
    sides = zip(array.shape, shape, strict=False)
    if array.ndim != len(shape) or not all(n == side or (side is None and n > 0) for n, side in sides):
        raise SceneError(path, f"{place} must be {wanted}, got shape {list(array.shape)}; {CORRECT}")
    if not (is_small := np.abs(array) <= largest).all():
        rule, first = f"finite numbers of at most {largest:g}", float(array[~is_small][0])
        raise refused(path, place, rule, first, CORRECT)
    return np.asarray(array)


def png_of(path: Path, place: str, data: bytes, rule: str, max_pixels: int, *, cure: str) -> U8:
    """The pixels of a PNG, [h, w, channels]; one of more than `max_pixels` is refused from its header."""
    from brushgs.formats.pictures.images import read_bytes

    if not data.startswith(_PNG):
        raise SceneError(path, f"{place} must be {rule}, got another file; {cure}")
    width, height = (int.from_bytes(data[at : at + 4], "big") for at in (16, 20))
    if width * height > max_pixels:
        raise SceneError(path, f"{place} must be {rule}, got one of {width}x{height}; {cure}")
    with on_disk(path, data, "picture.png", f"{place} must be {rule}, got one that") as picture:
        return read_bytes(picture, max_pixels)


def pack(values: NDArray[Any], type: str) -> dict[str, Any]:
    """An array as JSON, in a type of `DTYPES`; values beyond the range of an integer type are clipped."""
    if type in ONE:
        limits = np.iinfo(DTYPES[type])
        values = np.clip(np.rint(values.astype(np.float64) * ONE[type]), limits.min, limits.max)
    data = np.ascontiguousarray(values).astype(DTYPES[type]).tobytes()
    return {"type": type, "shape": list(values.shape), "data": base64.b64encode(data).decode()}


def picture_of(texels: U8) -> dict[str, Any]:
    """A picture [h, w, channels] as JSON: a base64 PNG."""
    from brushgs.formats.pictures.oiio import encode_pixels

    data = encode_pixels("png", texels, _PNG_ATTRIBUTES)
    return {"type": "png", "data": base64.b64encode(data).decode()}


def laid_out(value: Any, indent: str = "") -> str:
    """JSON text in which objects and nested lists take several lines; packed data and flat lists take one."""
    inner = indent + "  "
    if isinstance(value, dict) and "data" not in value:
        rows = [f"{json.dumps(name)}: {laid_out(part, inner)}" for name, part in value.items()]
    elif isinstance(value, list) and any(isinstance(part, dict | list) for part in value):
        rows = [laid_out(part, inner) for part in value]
    else:
        return json.dumps(value, ensure_ascii=False)
    begin, end = "{}" if isinstance(value, dict) else "[]"
    return begin + ",".join(f"\n{inner}{row}" for row in rows) + f"\n{indent}{end}"
