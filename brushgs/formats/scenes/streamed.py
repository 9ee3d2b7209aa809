"""Streamed SOG: a scene in several levels of detail, stored in SOG scenes that `lod-meta.json` lists.

The leaves of a tree name rows of these scenes for each level. Each level is the whole scene, so only one is
read; 0 is the finest. The format is defined by splat-transform and the PlayCanvas engine.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.files import find_within, is_dir, read_whole
from brushgs.formats.pictures.images import MAX_PIXELS
from brushgs.formats.scenes.columns import check_decoded_size
from brushgs.formats.scenes.rows import SceneFile
from brushgs.formats.scenes.sog import MAX_GROWTH, Sog, open_sog, rows_of
from brushgs.formats.schema import MAX_BYTES, SMALL_OBJECT, as_count, decode, refused, shown

INDEX = "lod-meta.json"
# Most Gaussians of the default level: 470 MB with harmonics of degree 3, far more than strokes can show.
DEFAULT_MOST = 2_000_000
_MAX_LEVELS = 100
_CURE = "download or export the scene again"


class _Index(Struct, rename="camel"):
    """The index. Its tree may exceed the recursion limit, so its nodes are checked one by one."""

    lod_levels: Annotated[int, Meta(ge=1, le=_MAX_LEVELS)]
    filenames: list[str]
    tree: Any = None
    version: Any = 1
    environment: Any = None


class _Run(NamedTuple):
    """Rows `start` to `stop` of one SOG scene, which belong to a leaf in one level."""

    file: int
    start: int
    stop: int


def open_scene(path: Path, lod: int | None = None) -> SceneFile:
    """Read the index of a streamed SOG scene (or of its folder), and each `meta.json` of one level.

    Level 0 is the finest; None selects the finest of at most `DEFAULT_MOST` Gaussians, or the coarsest if all
    have more. Raises SceneError if a file or field is missing or does not fit, or the level does not exist.
    """
    index = path / INDEX if is_dir(path) else path
    content = read_whole(index, MAX_BYTES)
    value = decode(index, content, _Index, _CURE, object_bytes=SMALL_OBJECT, has_names=True)
    names, levels = value.filenames, _read_levels(index, value)
    totals = [sum(run.stop - run.start for run in runs) for runs in levels]
    level = _choose(index, totals, lod)
    parts = _open_parts(index, names, levels[level])
    num_terms = max(sog.num_terms for sog, _ in parts)
    size = sum(sog.size for sog, _ in parts)
    check_decoded_size(index, totals[level], num_terms, size, max_growth=MAX_GROWTH)
    trainings = {sog.meta.training for sog, _ in parts}
    counts = ", ".join(f"{total:,}" for total in totals)
    environment = ", its environment not read" if value.environment else ""
    name = f"streamed SOG, level {level} of 0 to {len(totals) - 1} ({counts} Gaussians){environment}"
    training = trainings.pop() if len(trainings) == 1 else "default"
    open_rows = partial(rows_of, parts, num_terms)
    return SceneFile(path, name, totals[level], num_terms, open_rows, training=training)


def _choose(index: Path, totals: list[int], lod: int | None) -> int:
    """The level to read. Raises SceneError if it does not exist or is empty."""
    if lod is None:
        filled = [level for level, total in enumerate(totals) if total]
        if not filled:
            raise SceneError(index, f"holds no Gaussians in any of its {len(totals)} levels; {_CURE}")
        return next((level for level in filled if totals[level] <= DEFAULT_MOST), filled[-1])
    if not 0 <= lod < len(totals):
        rule = f"has levels of detail 0 (the finest) to {len(totals) - 1}, got {lod}"
        raise SceneError(index, f"{rule}; choose one of them")
    if not totals[lod]:
        raise SceneError(index, f"holds no Gaussians in level {lod}; choose another level")
    return lod


def _read_levels(index: Path, value: _Index) -> list[list[_Run]]:
    """The runs of rows of each level."""
    if value.version != 1:
        raise SceneError(index, f"must be of version 1, got version {shown(value.version)}; {_CURE}")
    num_levels = value.lod_levels
    levels: list[list[_Run]] = [[] for _ in range(num_levels)]
    for key, entry in _leaf_entries(index, value.tree):
        level = int(key) if key.isascii() and key.isdigit() and len(key) < 4 else num_levels
        run = _read_run(entry, len(value.filenames))
        if level >= num_levels or run is None:
            rule = f"a leaf must name file, offset and count of levels 0 to {num_levels - 1}"
            raise SceneError(index, f"{rule}, got {shown(key)}: {_entry_text(entry)}; {_CURE}")
        if run.stop > run.start:
            levels[level].append(run)
    return levels


def _leaf_entries(index: Path, tree: object) -> Iterator[tuple[str, object]]:
    """Yield the entries of all leaves of a tree, unchecked: a level and its rows."""
    pending: list[Any] = [tree]
    while pending:  # no recursion: a tree may exceed its limit
        node = pending.pop()
        children = node.get("children") or [] if isinstance(node, dict) else None
        lods = node.get("lods") or {} if isinstance(node, dict) else None
        if not isinstance(children, list) or not isinstance(lods, dict):
            raise refused(index, "tree", "made of objects with children or lods", node, _CURE)
        pending.extend(reversed(children))
        yield from lods.items()


def _read_run(entry: object, num_files: int) -> _Run | None:
    """The rows that an entry of a leaf names; None if it is invalid."""
    if not isinstance(entry, dict):
        return None
    file = as_count(entry.get("file"), num_files - 1)
    offset, count = (as_count(entry.get(name), MAX_PIXELS) for name in ("offset", "count"))
    if file is None or offset is None or count is None:
        return None
    return _Run(file, offset, offset + count)


def _entry_text(entry: object) -> str:
    """The fields of an entry of a leaf, for a message."""
    if not isinstance(entry, dict):
        return shown(entry)
    return ", ".join(f"{name} {shown(entry.get(name))}" for name in ("file", "offset", "count"))


def _open_parts(index: Path, names: list[str], runs: list[_Run]) -> list[tuple[Sog, list[tuple[int, int]]]]:
    """The SOG scenes of a level by number, each with its sorted, joined runs of rows."""
    by_file: dict[int, list[tuple[int, int]]] = {}
    for run in runs:
        by_file.setdefault(run.file, []).append((run.start, run.stop))
    paths = {file: find_within(index.parent, names[file], index) for file in sorted(by_file)}
    if len(set(paths.values())) < len(paths):
        raise SceneError(index, f"filenames must be different, got one twice in a level; {_CURE}")
    parts = []
    for file, path in paths.items():
        sog = open_sog(path)
        joined: list[tuple[int, int]] = []
        for start, stop in sorted(by_file[file]):
            if joined and start < joined[-1][1]:
                fact = f"names rows {start} to {min(stop, joined[-1][1])} of {names[file][:100]!r} twice"
                raise SceneError(index, f"{fact} in one level; {_CURE}")
            if joined and start == joined[-1][1]:
                start = joined.pop()[0]
            joined.append((start, stop))
        if joined[-1][1] > sog.meta.num_rows:
            rule = f"names row {joined[-1][1]} of {names[file][:100]!r}, which has {sog.meta.num_rows}"
            raise SceneError(index, f"{rule}; {_CURE}")
        parts.append((sog, joined))
    return parts
