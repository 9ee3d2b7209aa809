"""Results of costly steps on disk, so that a second command on a scene does not repeat them.

A result is named by a digest of all that it depends on: version of the program, name of the step, and its
inputs. Options count by value, and files that they name by path, size, time and content; large arrays by the
step that made them and the digest of its inputs. So a result is found without making anything, and a changed
file, option or program finds none. A result is one file: a JSON header, and plain arrays that are mapped into
memory. Its checksum is verified; what cannot be read is removed and made again.
"""

import hashlib
import os
import platform
import time
import warnings
import weakref
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, fields, is_dataclass
from functools import cache
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from msgspec import Struct

import brushgs
from brushgs.errors import SceneWarning
from brushgs.options.scene_source import SceneSource
from brushgs.options.where import clip_folder
from brushgs.pipeline.kept_file import read_arrays, write_arrays
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.runner import KEPT, Memory, NoMemory, Step

T = TypeVar("T")

MOST_BYTES = 2 << 30  # of all results; the least recently used are removed first
MOST_EACH = MOST_BYTES // 4
# Steps that are faster than writing their result are not kept.
LEAST_SECONDS = 0.002
BYTES_A_SECOND = 500e6
MOST_HASHED = 1 << 22  # bytes of an array that counts by its content: columns of strokes
NOTHING: Mapping[str, Any] = {}
MOST_FILES = 10_000  # of a folder that counts
_ENDS = 1 << 16  # bytes at the head and tail of a file that count
SUFFIX = ".kept"
FOLDER = "BRUSHGS_CACHE"  # environment variable: a folder, or "off"
# Classes of results. Others are not kept.
_CLASSES = {
    name: module
    for module, names in {
        "brushgs.values.camera": ("Camera", "FirstView", "Photograph"),
        "brushgs.values.frame": ("Frame",),
        "brushgs.values.gaussians": ("Gaussians",),
        "brushgs.rendering.plain": ("PlainViews",),
        "brushgs.values.notes": ("LoadNotes",),
        "brushgs.passes.color.key_normals": ("Around", "Facing"),
        "brushgs.values.lines": ("Lines",),
        "brushgs.passes.color.recolor": ("Palette",),
        "brushgs.passes.reduce.cluster": ("Grouping",),
        "brushgs.passes.seen": ("Seen",),
        "brushgs.rendering.canonical": ("Canonical",),
        "brushgs.brushes.brush_set": ("BrushSet",),
        "brushgs.brushes.texture": ("StrokeTexture", "Tint"),
    }.items()
    for name in names
}


class Unnamed(Exception):  # noqa: N818  no error: such a value is only not kept
    """A value without a digest, or of a class that is not kept."""


class Origins:
    """Digests of large values by object: the step that made them, and its inputs."""

    def __init__(self) -> None:
        """Nothing is known yet."""
        self._known: dict[int, tuple[weakref.ref[Any], str]] = {}

    def of(self, value: object) -> str | None:
        """The digest of an object, if it was added."""
        known = self._known.get(id(value))
        return known[1] if known is not None and known[0]() is value else None

    def add(self, value: object, digest: str) -> None:
        """Remember the origin of an object, or of each item of a tuple; the first origin counts."""
        if isinstance(value, tuple):
            for index, one in enumerate(value):
                self.add(one, f"{digest}.{index}")
        elif self.of(value) is None:
            key = id(value)
            with suppress(TypeError):  # numbers and text, which count by content
                self._known[key] = weakref.ref(value, lambda _: self._known.pop(key, None)), digest


ORIGINS = Origins()


def digest(*values: object) -> str:
    """A digest of values.

    Raises:
        Unnamed: if one is neither an option, small, nor of known origin.
    """
    hashed = hashlib.blake2b(digest_size=16)
    for value in values:
        for part in _parts(value):
            hashed.update(part)
    return hashed.hexdigest()


def _parts(value: object) -> Iterator[bytes]:
    """The bytes that stand for a value."""
    yield f"<{type(value).__name__}>".encode()
    if (known := ORIGINS.of(value)) is not None:
        yield known.encode()
    elif isinstance(value, np.ndarray):
        if value.nbytes > MOST_HASHED or value.dtype.hasobject:
            raise Unnamed
        yield f"{value.dtype}{value.shape}".encode()
        yield value.tobytes()
    elif value is None or isinstance(value, (bool, int, float, np.number)):
        yield repr(value).encode()
    elif isinstance(value, (str, Path)):
        yield _of_name(value)
    else:
        items = _items_of(value)
        yield str(len(items)).encode()
        for one in items:
            yield from _parts(one)


def _items_of(value: object) -> Sequence[object]:
    """The values that a value consists of."""
    if isinstance(value, (tuple, list)):
        return value
    if isinstance(value, Mapping):
        return [*value.items()]
    if isinstance(value, Struct):
        own = [getattr(value, name) for name in value.__struct_fields__]
        return [*_files_of(value), *own] if isinstance(value, SceneSource) else own
    if is_dataclass(value) and not isinstance(value, type):
        return [getattr(value, one.name) for one in fields(value)]
    raise Unnamed


def _files_of(source: SceneSource) -> list[Path]:
    """The files of a scene, and those of cameras beside it.

    Raises:
        Unnamed: if it may be read by another package, whose version is unknown.
    """
    from brushgs.formats.cameras.read import find_beside
    from brushgs.formats.registry import by_suffix, formats_of

    files, ours = source.files(), formats_of("scene", is_read=True)
    if not all(path.is_dir() or by_suffix(ours, path) for path in files):
        raise Unnamed
    return [*files, *find_beside(source.camera_folders())]


def _of_name(value: str | Path) -> bytes:
    """A text or path, with the state of the file or folder that it names."""
    is_folder = isinstance(value, Path) and value.is_dir()
    return str(value).encode() + (_of_folder(Path(value)) if is_folder else _of_file(Path(value)))


def _of_file(path: Path) -> bytes:
    """Size, time, head and tail of a file; its absolute name too. Empty for text that names none."""
    try:
        if not path.is_file():
            return b""
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            ends = file.read(_ENDS)
            file.seek(max(found.st_size - _ENDS, 0))
            ends += file.read(_ENDS)
    except (OSError, ValueError):  # text with a null byte
        return b""
    return f"{path.absolute()}{found.st_size}{found.st_mtime_ns}".encode() + ends


def _of_folder(folder: Path) -> bytes:
    """Names, sizes and times of all files in a folder, such as masks or cameras.

    Raises:
        Unnamed: if they are too many, or vanish while they are counted.
    """
    found = list(islice((str(path) for path in folder.rglob("*") if path.is_file()), MOST_FILES + 1))
    if len(found) > MOST_FILES:
        raise Unnamed
    try:
        return _stated(found).encode()
    except OSError:
        raise Unnamed from None


def _stated(files: Iterable[str]) -> str:
    """Names, sizes and times of files."""
    stated = ((path, Path(path).stat()) for path in sorted(files))
    return "\n".join(f"{path} {at.st_size} {at.st_mtime_ns}" for path, at in stated)


@cache
def program() -> str:
    """A digest of the program: versions, processor type, the text model that the environment names, and (for
    developers) the sizes and times of its files.
    """
    from brushgs.brushes.texture import strokes_folder
    from brushgs.core.native import core

    found = [core.__file__]
    for folder in (Path(brushgs.__file__).parent, strokes_folder()):
        for inner, _, names in os.walk(folder):
            found += [f"{inner}/{name}" for name in names if name.endswith((".py", ".toml", ".png"))]
    return digest(brushgs.__version__, np.__version__, platform.machine(), _stated(found), clip_folder(None))


class Store:
    """Results as files in a folder.

    Attributes:
        folder: created if missing.
        most: maximum total bytes of all results.
    """

    def __init__(self, folder: Path, most: int = MOST_BYTES) -> None:
        """Nothing is read or written yet."""
        self.folder, self.most, self._is_changed = folder, most, False

    def files(self) -> list[tuple[Path, os.stat_result]]:
        """All results, the most recently used first."""
        found = []
        with suppress(FileNotFoundError), os.scandir(self.folder) as entries:
            for entry in entries:
                if entry.name.endswith(SUFFIX):
                    with suppress(OSError):  # another command removed it
                        found.append((Path(entry.path), entry.stat()))
        return sorted(found, key=lambda one: -one[1].st_mtime_ns)

    def load(self, name: str, given: Mapping[str, Any] = NOTHING) -> Any:
        """A result.

        Args:
            name: as for `save`.
            given: the inputs, see `_given`.

        Raises:
            KeyError: if there is none that can be read.
        """
        path = self.folder / f"{name}{SUFFIX}"
        try:
            header, arrays = read_arrays(path)
            value = _decoded(header, {**arrays, **given})
            os.utime(path)
        except FileNotFoundError:
            raise KeyError(name) from None
        except Exception:  # damaged or written by another program: made again, whatever it holds
            with suppress(OSError):
                path.unlink()
            raise KeyError(name) from None
        return value

    def save(self, name: str, value: Any, seconds: float, given: Collection[str] = ()) -> None:
        """Keep a result, unless it is too large, of a class that is not kept, or cannot be written.

        Args:
            name: a digest of all that it depends on.
            value: the result.
            seconds: time to make it; a result made faster than it is written is not kept.
            given: origins of the inputs: those that the result returns unchanged are not written.
        """
        arrays: dict[str, np.ndarray[Any, Any]] = {}
        try:
            encoded = _encoded(value, arrays, given)
        except Unnamed:
            return
        size = sum(array.nbytes for array in arrays.values())
        if size > min(MOST_EACH, self.most) or seconds < LEAST_SECONDS + size / BYTES_A_SECOND:
            return
        temporary = self.folder / f".{name}-{os.urandom(4).hex()}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            write_arrays(temporary, encoded, arrays)
            temporary.replace(self.folder / f"{name}{SUFFIX}")
            self._is_changed = True
        except OSError:  # a full disk, a folder that cannot be written
            pass
        finally:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)

    def trim(self) -> None:
        """Remove the least recently used results where those of this command made the folder too large."""
        if not self._is_changed:
            return
        self._is_changed, total = False, 0
        for path, found in self.files():
            total += found.st_size
            if total > self.most:
                with suppress(OSError):
                    path.unlink()

    def clear(self) -> None:
        """Remove all results, and leftovers of killed commands."""
        for path in (*self.folder.glob(f"*{SUFFIX}"), *self.folder.glob(".*-*")):
            with suppress(OSError):
                path.unlink()


def _given(inputs: Iterable[object]) -> dict[str, object]:
    """The inputs of known origin, by it."""
    return {origin: one for one in inputs if (origin := ORIGINS.of(one)) is not None}


def _encoded(value: Any, arrays: dict[str, Any], given: Collection[str]) -> Any:
    """Encode a value as JSON; arrays are added to `arrays` by name, and inputs are referred to by name."""
    if (origin := ORIGINS.of(value)) in given:
        return {"given": origin}
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufcSU":
        arrays[name := f"a{len(arrays)}"] = value
        return {"array": name, "is_fixed": not value.flags.writeable}
    if isinstance(value, Path):
        return {"path": str(value)}
    return _encoded_items(value, lambda one: _encoded(one, arrays, given))


def _encoded_items(value: Any, encode: Callable[[Any], Any]) -> Any:
    """Encode a list, a tuple, a dictionary or an object of a kept class, item by item."""
    if type(value) in (tuple, list):
        items = [encode(one) for one in value]
        return {"tuple": items} if isinstance(value, tuple) else items
    if isinstance(value, dict) and all(isinstance(key, str) for key in value):
        return {"dict": {key: encode(one) for key, one in value.items()}}
    known = {one.name: encode(getattr(value, one.name)) for one in fields(_kept(value))}
    return {"class": type(value).__name__, "fields": known}


def _kept(value: T) -> T:
    """The value itself. Raises Unnamed if results of its class are not kept."""
    kind = type(value)
    if _CLASSES.get(kind.__name__) != kind.__module__:
        raise Unnamed
    return value


def _decoded(found: Any, known: Mapping[str, Any]) -> Any:
    """The inverse of `_encoded`; `known` are arrays and inputs."""
    if isinstance(found, list):
        return [_decoded(one, known) for one in found]
    if not isinstance(found, dict):
        return found
    if "given" in found:
        return known[found["given"]]
    if "array" in found:
        array = known[found["array"]]
        array.flags.writeable = not found["is_fixed"]
        return array
    if "path" in found:
        return Path(found["path"])
    if "tuple" in found:
        return tuple(_decoded(one, known) for one in found["tuple"])
    if "dict" in found:
        return {key: _decoded(one, known) for key, one in found["dict"].items()}
    made = getattr(import_module(_CLASSES[found["class"]]), found["class"])
    return made(**{key: _decoded(one, known) for key, one in found["fields"].items()})


class KeptMemory(Memory):
    """A memory that searches the disk for results missing from another memory.

    Attributes:
        inner: remembers within this process.
        store: the results on disk.
    """

    def __init__(self, store: Store, inner: Memory | None = None) -> None:
        """Without `inner` nothing is remembered in this process."""
        super().__init__()
        self.store, self.inner = store, inner or NoMemory()
        self.made = self.inner.made
        self._waiting: dict[str, tuple[str, Any, float, frozenset[str]]] = {}

    def known(self, step: str) -> tuple[tuple[object, ...], Any] | None:
        """That of the inner memory."""
        return self.inner.known(step)

    def forget(self, step: str) -> None:
        """Of the inner memory."""
        self.inner.forget(step)

    def keep(self, step: str, inputs: tuple[object, ...], result: object) -> None:
        """In the inner memory."""
        self.inner.keep(step, inputs, result)

    def of(self, step: str, inputs: Sequence[object], make: Callable[[], T], *, is_only: bool = False) -> T:
        """The result from a memory or the disk, else made; a search keeps its last one when the job ends."""
        return super().of(step, inputs, lambda: self._of_disk(step, inputs, make, is_only=is_only))

    def _of_disk(self, step: str, inputs: Sequence[object], make: Callable[[], T], *, is_only: bool) -> T:
        try:
            name = digest(program(), step, *inputs)
        except Unnamed:
            return make()
        result: T
        try:
            result = self.store.load(name, _given(inputs))
            self.found.add(step)
        except KeyError:
            start = time.perf_counter()
            result = make()
            to_keep = name, result, time.perf_counter() - start, frozenset(_given(inputs))
            if is_only:
                self.store.save(*to_keep)
            else:
                self._waiting[step] = to_keep
            self.found.discard(step)
        ORIGINS.add(result, name)
        return result

    def run(
        self,
        step: Step,
        inputs: Mapping[str, Any],
        used: Mapping[str, Any],
        report: Any,
        make: Callable[[], T],
    ) -> T:
        """The result of a costly step from disk, with its stages and warnings, else made.

        Results are kept if the step requested no value beside those that it always takes. Whether it does
        depends on these alone, so a result that is found holds.
        """
        try:
            name = digest(program(), step.name, *(part for one in inputs.items() for part in one))
        except Unnamed:
            return make()
        given = _given(inputs.values())
        result = self._with_stages(name, given, used, report, make) if step.is_costly else make()
        with suppress(Unnamed):
            ORIGINS.add(result, digest(name, used) if used else name)
        return result

    def _with_stages(
        self,
        name: str,
        given: Mapping[str, Any],
        used: Mapping[str, Any],
        report: Report,
        make: Callable[[], T],
    ) -> T:
        start = time.perf_counter()
        try:
            result: T
            result, stages, notes, texts = self.store.load(name, given)
        except KeyError:
            with _hearing(report) as heard:
                result = make()
            if not used:
                self.store.save(name, (result, *heard), time.perf_counter() - start, given)
            return result
        for stage in stages:
            report.stages.append(Stage(**{**stage, "seconds": time.perf_counter() - start}))
            report.stages[-1].details.append(KEPT)
            start = time.perf_counter()
        report.notes += notes
        for text in texts:
            warnings.warn(SceneWarning(text), stacklevel=2)
        return result

    def close(self) -> None:
        """Write the kept results of searches."""
        for one in self._waiting.values():
            self.store.save(*one)
        self._waiting.clear()
        self.store.trim()


@contextmanager
def _hearing(report: Report) -> Iterator[tuple[list[dict[str, Any]], list[str], list[str]]]:
    """Collect the stages, notes and warnings of the block, and pass them on as usual."""
    num_stages, num_notes = len(report.stages), len(report.notes)
    stages: list[dict[str, Any]] = []
    notes: list[str] = []
    texts: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SceneWarning)
        yield stages, notes, texts
    stages += [asdict(stage) for stage in report.stages[num_stages:]]
    notes += report.notes[num_notes:]
    texts += [str(one.message) for one in caught if issubclass(one.category, SceneWarning)]
    for one in caught:
        warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)


def default_store() -> Store | None:
    """The results in the user's cache folder, or in that of `BRUSHGS_CACHE`; None if that is "off"."""
    asked = os.environ.get(FOLDER, "")
    if asked == "off":
        return None
    if asked:
        return Store(Path(asked))
    from platformdirs import user_cache_path

    return Store(user_cache_path("brushgs", appauthor=False) / "steps")


def lasting_memory() -> Memory:
    """A memory for many jobs of one process that also keeps results on disk; call `close` after each job."""
    store = default_store()
    return Memory() if store is None else KeptMemory(store, Memory())


@contextmanager
def keeping(inner: Memory | None) -> Iterator[Memory | None]:
    """A memory on disk beside another one; results are written when the block ends without an error."""
    store = default_store()
    if store is None:
        yield inner
        return
    from brushgs.pipeline.kept_levels import KeptLevels
    from brushgs.rendering.texture_levels import found_by

    memory, levels = KeptMemory(store, inner), KeptLevels(store)
    with found_by(levels.find):
        yield memory
    levels.close()
    memory.close()
