"""Read and write an `Overpaint` as a file of marks:

    {
      "brushgs": "marks", "version": 1, "time": 0.5,
      "marks": {"means": ARRAY [n, 3], "directions": ARRAY [n, 3], "normals": ARRAY [n, 3],
                "lengths": ARRAY [n], "widths": ARRAY [n], "colors": ARRAY [n, 3], "opacities": ARRAY [n],
                "tiles": ARRAY [n], "layers": ARRAY [n]},
      "atlas": {"places": ARRAY [t, 4], "picture": PNG},
      "erased": {"means": ARRAY [e, 3], "normals": ARRAY [e, 3], "radii": ARRAY [e]},
      "combs": {"means": ..., "radii": ..., "directions": ARRAY [c, 3], "strengths": ARRAY [c]},
      "density": {"means": ..., "radii": ..., "factors": ARRAY [d]}
    }

Each part may be missing; the atlas if no mark has a tile, and layers if all marks are in one layer. The
columns are those of `values.marks`, in the coordinates of the scene file. Tile i is the rectangle
`places[i]` = left, top, width, height of the picture, with 8 bits of red, green, blue and straight alpha.
Arrays and pictures are encoded as in style files, see `formats.styles`.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.packed import CORRECT, JsonFile, PackedArray, Picture, array_of, pack, picture_of, png_of
from brushgs.formats.schema import refused
from brushgs.values.arrays import U8
from brushgs.values.marks import MOST, MOST_ROWS, MOST_TILE, Combs, Density, Erased, Marks, Overpaint, Patches

MARKS_SUFFIX = ".marks"
MAX_BYTES = 1 << 25
MAX_ATLAS = 1 << 24  # pixels: 64 MiB in memory
ATLAS_WIDTH = 1024
CURE = "give a file that `brushgs adopt` wrote"
_SMALLER = "paint over a smaller picture, or keep less in one file"
_KINDS: dict[str, type[Patches]] = {"marks": Marks, "erased": Erased, "combs": Combs, "density": Density}


class _Atlas(Struct, forbid_unknown_fields=True):
    places: PackedArray
    picture: Picture


_Columns = dict[str, PackedArray]


class _File(Struct, forbid_unknown_fields=True):
    brushgs: Any
    version: Any
    time: Annotated[float, Meta(ge=0, le=1e9)] | None = None
    marks: _Columns | None = None
    atlas: _Atlas | None = None
    erased: _Columns | None = None
    combs: _Columns | None = None
    density: _Columns | None = None


_FORMAT = JsonFile("marks", _File, "file of marks", MARKS_SUFFIX, MAX_BYTES, CURE)


def read_marks(path: str | Path) -> Overpaint:
    """Read a file of marks, whatever its name.

    Raises SceneError if there is no such regular file, it is larger than 32 MiB, is no file of marks, has a
    later version, or a field is missing, unknown or wrong; the message names the field.
    """
    return _overpaint(Path(path), _FORMAT.read(Path(path)))


def _overpaint(path: Path, file: _File) -> Overpaint:
    found: dict[str, Any] = {}
    for name, kind in _KINDS.items():
        columns = getattr(file, name)
        if columns is not None:
            more = {"images": _images(path, file.atlas)} if kind is Marks else {}
            found[name] = _patches(path, name, kind, columns, more)
    if not found:
        raise SceneError(path, f"holds none of {', '.join(_KINDS)}; {CURE}")
    return Overpaint(**found, time=file.time)


def _patches(path: Path, place: str, kind: type[Patches], columns: _Columns, more: dict[str, Any]) -> Patches:
    """Patches of one kind from their columns, with extra fields `more`."""
    if set(columns) | set(kind.OPTIONAL) != set(kind.COLUMNS):
        rule = f"have the fields {', '.join(kind.COLUMNS)}"
        raise SceneError(path, f"{place} must {rule}, got {', '.join(sorted(columns))[:80]}; {CORRECT}")
    found: dict[str, Any] = {}
    count: int | None = None
    for name, (shape, _) in kind.COLUMNS.items():
        if name not in columns:
            continue
        found[name] = array_of(path, f"{place}.{name}", columns[name], (count, *shape), MOST)
        count = len(found[name])
        if count > MOST_ROWS:
            raise refused(path, f"{place}.{name}", f"at most {MOST_ROWS} rows", count, CORRECT)
    try:
        return kind(**found, **more)
    except ValueError as error:
        raise SceneError(path, f"{place}.{error}; {CORRECT}") from None


def _images(path: Path, atlas: _Atlas | None) -> tuple[U8, ...]:
    """The tiles of an atlas; empty if it is None."""
    if atlas is None:
        return ()
    rule = f"a PNG of 8 bits of red, green, blue and alpha with at most {MAX_ATLAS} pixels"
    place = "atlas.picture.data"
    pixels = png_of(path, place, atlas.picture.data, rule, MAX_ATLAS, cure=CORRECT)
    height, width, channels = pixels.shape
    if channels != 4:
        raise SceneError(path, f"{place} must be {rule}, got {channels} channels; {CORRECT}")
    places = array_of(path, "atlas.places", atlas.places, (None, 4), MAX_ATLAS)
    if len(places) > MOST_ROWS:
        raise refused(path, "atlas.places", f"at most {MOST_ROWS} rows", len(places), CORRECT)
    left, top, wide, high = places.T
    fits = (places == np.rint(places)).all(axis=1) & (left >= 0) & (top >= 0) & (wide >= 1) & (high >= 1)
    fits &= (left + wide <= width) & (top + high <= height) & (np.maximum(wide, high) <= MOST_TILE)
    if not fits.all():
        rule = f"rectangles in the picture of {width}x{height} of at most {MOST_TILE} texels a side"
        raise refused(path, "atlas.places", rule, places[~fits][0].tolist(), CORRECT)
    return tuple(np.ascontiguousarray(pixels[y : y + h, x : x + w]) for x, y, w, h in places.astype(int))


def write_marks(overpaint: Overpaint, path: str | Path) -> None:
    """Write a file of marks; it appears when it is complete, and equal values give equal bytes.

    Args:
        overpaint: must not be empty.
        path: must end in .marks.

    Raises:
        ValueError: if the suffix is wrong, the overpaint is empty, or it is too large; then nothing is
            written.
        SceneError: if the file cannot be written.
    """
    value: dict[str, Any] = {}
    if overpaint.time is not None:
        value["time"] = float(overpaint.time)
    for name, kind in _KINDS.items():
        patches = getattr(overpaint, name)
        if patches is None or not len(patches):
            continue
        value[name] = {column: pack(getattr(patches, column), "float32") for column in kind.COLUMNS}
        if isinstance(patches, Marks) and patches.images:
            value["atlas"] = _atlas(patches.images, path)
    _FORMAT.write(path, value, _overpaint, _SMALLER)


def _atlas(images: tuple[U8, ...], path: str | Path) -> dict[str, Any]:
    """JSON of an atlas with the tiles packed in shelves, the highest first."""
    places = np.zeros((len(images), 4), int)
    left = top = shelf = 0
    for row in sorted(range(len(images)), key=lambda row: -images[row].shape[0]):
        height, width = images[row].shape[:2]
        if left + width > ATLAS_WIDTH:
            left, top, shelf = 0, top + shelf, 0
        places[row] = left, top, width, height
        left, shelf = left + width, max(shelf, height)
    size = top + shelf, int((places[:, 0] + places[:, 2]).max())
    if size[0] * size[1] > MAX_ATLAS:
        rule = f"tiles must take at most {MAX_ATLAS} pixels, got {size[0] * size[1]}"
        raise ValueError(f"{path}: {rule}; {_SMALLER}")
    picture = np.zeros((*size, 4), np.uint8)
    for (x, y, w, h), image in zip(places, images, strict=True):
        picture[y : y + h, x : x + w] = image
    return {"places": pack(places, "float32"), "picture": picture_of(picture)}
