"""The `meta.json` of a SOG scene, and access to its untrusted files, in a folder or in a zip archive.

Members of an archive are found by name. A picture is copied to a temporary folder, under a name of our own,
while it is decoded, since the decoder reads named files only; nothing else is written to the disk.

The meta defines the value of each byte of the pictures; here it becomes lookup tables. Version 2 stores
scales and colors by codebooks, version 1 (without `version`) as fractions between a smallest and a largest
value. The format is defined by the PlayCanvas engine and splat-transform.
"""

import zipfile
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path, PurePosixPath
from typing import IO, Annotated, Any, Generic, NamedTuple, TypeVar

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike

from brushgs.errors import SceneError
from brushgs.formats.files import find_within, is_dir, is_plain, on_disk, open_plain, read_whole
from brushgs.formats.pictures.images import MAX_PIXELS
from brushgs.formats.pictures.still import NUM_HEADER_BYTES
from brushgs.formats.scenes.stored import Stored, parse_content, read_stored
from brushgs.formats.schema import as_count, convert, decode, refused, shown
from brushgs.formats.zip_file import open_member, open_zip
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.notes import Training

META = "meta.json"
_SHOWN_MEMBERS = 3


class SceneFiles:
    """The files beside a `meta.json`, by the names in it.

    All methods raise SceneError if a file is missing, too large or cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def meta(self, most: int) -> bytes:
        """The content of the `meta.json`, at most `most` bytes; the file may have another name."""
        return read_whole(self.path, most)

    def head(self, name: str) -> bytes:
        """The first bytes of a file, enough for the size of a WebP picture."""
        with open_plain(self._find(name)) as file:
            return file.read(NUM_HEADER_BYTES)

    def size(self, name: str) -> int:
        """The stored size of a file in bytes; for an archive the compressed size."""
        return self._find(name).stat().st_size

    @contextmanager
    def on_disk(self, name: str, most: int) -> Iterator[Path]:
        """Yield a path to a file of at most `most` bytes, valid within the block."""
        path = self._find(name)
        if path.stat().st_size > most:
            raise SceneError(path, _too_large(most))
        yield path

    def _find(self, name: str) -> Path:
        path = find_within(self.path.parent, name, self.path)
        if not is_plain(path):
            fact = f"names the file {name[:100]!r}, which is not there"
            raise SceneError(self.path, f"{fact}; copy the whole folder of the scene")
        return path


class _Archive(SceneFiles):
    """The members of a zip archive in the folder of its `meta.json`."""

    def __init__(self, path: Path, archive: zipfile.ZipFile) -> None:
        super().__init__(path)
        self._archive, self._folder = archive, _find_folder(path, archive.namelist())

    def meta(self, most: int) -> bytes:
        return self._read(META, most)

    def head(self, name: str) -> bytes:
        with self._open(name) as file:
            return file.read(NUM_HEADER_BYTES)

    def size(self, name: str) -> int:
        return self._member(name).compress_size

    @contextmanager
    def on_disk(self, name: str, most: int) -> Iterator[Path]:
        with on_disk(self.path, self._read(name, most), "picture.webp", f"its member {name[:100]!r}") as path:
            yield path

    def _member(self, name: str) -> zipfile.ZipInfo:
        try:
            return self._archive.getinfo(self._folder + name)
        except KeyError:
            fact = f"names the file {name[:100]!r}, which is not in the archive"
            raise SceneError(self.path, f"its {META} {fact}; download or export it again") from None

    def _open(self, name: str) -> AbstractContextManager[IO[bytes]]:
        what, cure = f"member {name[:100]!r}", "unpack it and name the folder"
        return open_member(self.path, self._archive, self._member(name), what, cure)

    def _read(self, name: str, most: int) -> bytes:
        with self._open(name) as file:
            content = file.read(most + 1)
        if len(content) > most:
            raise SceneError(self.path, f"its member {name[:100]!r} {_too_large(most)}")
        return content


@contextmanager
def open_files(path: Path) -> Iterator[SceneFiles]:
    """Open the files of a SOG scene, given as a folder, the `meta.json` in one, or a zip archive.

    Raises:
        SceneError: if an archive is damaged, has a too large directory, or holds no `meta.json` or several;
            the message says what it holds.
    """
    if is_dir(path):
        yield SceneFiles(path / META)
        return
    with open_plain(path, "scene file") as file:
        is_archive = file.read(2) == b"PK"
    if not is_archive:
        yield SceneFiles(path)
        return
    with open_zip(path) as opened:
        yield _Archive(path, opened)


def _find_folder(path: Path, names: list[str]) -> str:
    """The folder of the scene inside an archive, with a final "/"; "" for the top."""
    metas = [name for name in names if PurePosixPath(name).name == META]
    if META in metas:
        return ""
    if len(metas) == 1:
        return metas[0][: -len(META)]
    files = [name for name in names if not name.endswith("/")]
    few = ", ".join(repr(name[:60]) for name in files[:_SHOWN_MEMBERS])
    more = f" and {len(files) - _SHOWN_MEMBERS} more" if len(files) > _SHOWN_MEMBERS else ""
    fault = f"without a SOG scene: it holds {few}{more}; unpack it and name the scene inside"
    if any(PurePosixPath(name).name == "lod-meta.json" for name in names):
        fault = "of a streamed SOG scene; unpack it and name its lod-meta.json"
    elif metas:
        fault = f"of {len(metas)} SOG scenes in folders of their own; unpack it and name the {META} of one"
    elif not files:
        fault = "without files; download or export it again"
    raise SceneError(path, f"is a zip archive {fault}")


def _too_large(most: int) -> str:
    """The end of a message."""
    return f"must have at most {most / 2**20:.1f} MiB, got more; download or export it again"


NOTES = "brushgs"  # key of `Stored` in our files
_CURE = "export it as SOG again"
_LEVELS = np.arange(256) / 255  # fraction that each byte stands for between a smallest and a largest value
PALETTE_ROW = 64  # entries in a row of the picture of centroids
MAX_PALETTE = 1 << 16  # labels have 16 bits

E = TypeVar("E")
_Codebook = Annotated[list[float | None], msgspec.Meta(min_length=1, max_length=256)]
_Pictures = Annotated[list[str], msgspec.Meta(min_length=1)]  # only the first is used
_TwoPictures = Annotated[list[str], msgspec.Meta(min_length=2)]


class _Quats(Struct):
    files: _Pictures
    encoding: Any = "quaternion_packed"


class _Ends(Struct, Generic[E]):
    """Smallest and largest values."""

    mins: E
    maxs: E
    files: _Pictures


class _Means(_Ends[tuple[float, float, float]], kw_only=True):
    files: _TwoPictures
    shape: list[Any] | None = None


class _Palette1(_Ends[float | tuple[float]], kw_only=True):
    files: _TwoPictures


class _Coded(Struct):
    codebook: _Codebook
    files: _Pictures


class _Palette2(Struct):
    count: Annotated[int, msgspec.Meta(ge=1, le=MAX_PALETTE)]
    bands: Annotated[int, msgspec.Meta(ge=1, le=3)]
    codebook: _Codebook
    files: _TwoPictures


class _Scene(Struct, kw_only=True):
    """Fields of both versions."""

    means: _Means
    quats: _Quats
    sh_n: Any = msgspec.field(name="shN", default=None)  # for degree 0 it may have only "bands"
    model: Any = None
    antialias: Any = None  # in older files
    stored: Any = msgspec.field(name=NOTES, default_factory=dict)


class _Scene1(_Scene, kw_only=True):
    scales: _Ends[tuple[float, float, float]]
    sh0: _Ends[tuple[float, float, float, float]]


class _Scene2(_Scene, kw_only=True):
    count: Annotated[int, msgspec.Meta(ge=1, le=MAX_PIXELS, description=f"1 to {MAX_PIXELS} Gaussians")]
    scales: _Coded
    sh0: _Coded


class _Version(Struct):
    version: Any = 1


class Palette(NamedTuple):
    """A palette of spherical harmonics of degree 1 and more, shared by Gaussians."""

    num_entries: int | None  # number of entries, above all labels; None if the file does not state it
    bands: int | None  # 1 to 3; None if it follows from the width of the picture
    values: F32  # [256] coefficient of each byte
    centroids: str  # name of the picture of entries, 64 in a row, each (bands + 1)^2 - 1 pixels wide
    labels: str  # name of the picture of 16-bit labels, low byte first

    def counts(self, width: int, height: int) -> tuple[int, int] | None:
        """Number of entries and bands in a picture of centroids of this size; None if it does not fit."""
        num_rest, remainder = divmod(width, PALETTE_ROW)
        bands, room = {3: 1, 8: 2, 15: 3}.get(num_rest), PALETTE_ROW * height
        num_entries = self.num_entries or room
        if remainder or bands is None or self.bands not in (None, bands) or room > MAX_PALETTE:
            return None
        return (num_entries, bands) if num_entries <= room else None


class Meta(NamedTuple):
    """A `meta.json` of either version."""

    version: int  # 1 or 2
    num_rows: int  # number of Gaussians
    training: Training
    means: F32  # [3, 65536] coordinate of each 16-bit number, by axis
    log_scales: F32  # [3, 256] by axis
    colors: F32  # [3, 256] coefficient of degree 0, by channel
    opacities: F32  # [256] logits in version 1, 0 to 1 in version 2
    # Names: means (low and high bytes), quats, scales, colors, any labels and palette.
    pictures: tuple[str, ...]
    palette: Palette | None  # None without spherical harmonics above degree 0
    stored: Stored  # notes of our files


def parse_meta(path: Path, content: bytes) -> Meta:
    """Parse the text of a `meta.json`; `path` is this file, or its archive, for messages.

    Raises SceneError if it is no JSON, or a field is missing or unusable; the message names the field.
    """
    version = decode(path, content, _Version, _CURE, has_names=True).version
    if version not in (1, 2):
        raise SceneError(path, f"must be SOG of version 1 or 2, got version {shown(version)}; {_CURE}")
    scene: _Scene1 | _Scene2
    if version == 2:
        scene = decode(path, content, _Scene2, _CURE, has_names=True)
        num_rows = scene.count
        log_scales = np.tile(_table(path, "scales", scene.scales.codebook), (3, 1))
        colors = np.tile(_table(path, "sh0", scene.sh0.codebook), (3, 1))
        opacities = _LEVELS.astype(np.float32)
    else:
        scene = decode(path, content, _Scene1, _CURE, has_names=True)
        shape = scene.means.shape or [None]
        num_rows = as_count(shape[0], MAX_PIXELS) or 0
        if not num_rows:
            raise refused(path, "means.shape", f"1 to {MAX_PIXELS} Gaussians", scene.means.shape, _CURE)
        if scene.quats.encoding != "quaternion_packed":
            raise SceneError(path, f"quats.encoding {shown(scene.quats.encoding)} is not read; {_CURE}")
        log_scales = _between(scene.scales.mins, scene.scales.maxs)
        *color_rows, opacities = _between(scene.sh0.mins, scene.sh0.maxs)
        colors = np.array(color_rows)
    low, high = scene.means.files[:2]
    palette = _palette(path, scene.sh_n, int(version))
    more = () if palette is None else (palette.labels, palette.centroids)
    return Meta(
        version=int(version),
        num_rows=num_rows,
        training=_training(scene),
        means=_mean_tables(scene.means),
        log_scales=log_scales,
        colors=colors,
        opacities=opacities,
        pictures=(low, high, scene.quats.files[0], scene.scales.files[0], scene.sh0.files[0], *more),
        palette=palette,
        stored=read_stored(path, lambda: parse_content(scene.stored)),
    )


def _palette(path: Path, value: Any, version: int) -> Palette | None:
    if value is None or (isinstance(value, dict) and value.get("bands") == 0):
        return None
    if version == 2:
        of_2 = convert(path, value, _Palette2, _CURE, "shN")
        return Palette(of_2.count, of_2.bands, _table(path, "shN", of_2.codebook), *of_2.files[:2])
    of_1 = convert(path, value, _Palette1, _CURE, "shN")
    table = _between(np.ravel(of_1.mins), np.ravel(of_1.maxs))[0]
    return Palette(None, None, table, *of_1.files[:2])


def _training(scene: _Scene) -> Training:
    """How a scene was trained, from `model` or, in older files, `antialias`."""
    if scene.model == "antialiased" or (scene.model is None and scene.antialias is True):
        return "antialiased"
    return "2dgs" if scene.model == "2dgs" else "default"


def mean_logs(means: Array) -> F64:
    """sign(x) log(1 + |x|) of coordinates, the inverse of the tables `Meta.means`."""
    wide = means.astype(np.float64)
    return np.asarray(np.sign(wide) * np.log1p(np.abs(wide)))


def _mean_tables(means: _Means) -> F32:
    """[3, 65536] coordinates, evenly spaced in sign(x) log(1 + |x|) between its ends."""
    low, high = np.array(means.mins), np.array(means.maxs)
    logs = low[:, None] + (high - low)[:, None] * (np.arange(65536) / 65535)
    with np.errstate(over="ignore"):  # infinite means are detected when rows are checked
        return np.asarray(np.sign(logs) * np.expm1(np.abs(logs)), np.float32)


def _between(lows: ArrayLike, highs: ArrayLike) -> F32:
    """[n, 256] values evenly spaced between n pairs of ends."""
    low, high = np.array(lows), np.array(highs)
    with np.errstate(over="ignore"):
        return np.asarray(low[:, None] + (high - low)[:, None] * _LEVELS, np.float32)


def _table(path: Path, place: str, values: list[float | None]) -> F32:
    """[256] values of a codebook; a shorter list is padded with NaN.

    Some versions of splat-transform wrote null for the first value, which the engine then extrapolates.
    """
    known = [value for value in values if value is not None]
    if values[0] is None and len(values) == 256 and len(known) == 255:
        known = [known[0] + (known[0] - known[-1]) / 255, *known]
    if len(known) < len(values):
        raise refused(path, f"{place}.codebook", "a list of numbers", values, _CURE)
    table = np.full(256, np.nan, np.float32)
    with np.errstate(over="ignore"):
        table[: len(known)] = known
    return table
