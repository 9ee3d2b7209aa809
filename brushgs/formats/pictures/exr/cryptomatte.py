"""Mattes as Cryptomatte: channels of pairs (id, coverage), largest first, and a manifest of names.

An id is the hash of a name, stored as the bits of a float32; bit 23 is flipped if the exponent is 0 or 255.
Source: Psyop, Cryptomatte Specification 1.2.
"""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing
from brushgs.formats.pictures.exr.planes import Attribute, Plane, Rows
from brushgs.values.arrays import F32, U32, Array
from brushgs.values.frame import Frame
from brushgs.values.layers import Matte
from brushgs.values.shot import Shot

Rank = tuple[NDArray[np.int32], F32]  # [H, W] index into the names, and [H, W] coverage of the pixel
MAX_INLINE = 1 << 16  # bytes of names stored in each picture of a film: some 2000 strokes
SHARED_MATTE = "stroke"  # the matte whose names may be in a manifest file
# Most ranks in a file. Nuke's decoder reads 24; a pixel of a painting may show 80 strokes.
RANKS, OTHER_RANKS = {"stroke": 24}, 8
OTHER = "other"  # item for the coverage beyond the last rank, so that mattes sum to alpha


def cryptomattes_of(frame: Frame, shot: Shot) -> Iterator[tuple[list[Plane], dict[str, Attribute]]]:
    """The channels and header attributes of each matte among the layers of a frame."""
    for name, layer in frame.layers.items():
        if isinstance(layer, Matte):
            title, most = f"Crypto{name.capitalize()}", RANKS.get(name, OTHER_RANKS)
            num_ranks = layer.rows.shape[2]
            names = layer.names if num_ranks <= most else (*layer.names, OTHER)
            # All pictures of a film have the same channels, as the specification requires.
            count = most if shot.number is not None else max(2, min(num_ranks + num_ranks % 2, most))
            yield _planes(title, names, _ranks(layer, most), count), _attributes(title, name, names, shot)


def manifest_of(names: Sequence[str]) -> str:
    """The Cryptomatte manifest: a JSON object of names and ids, on one line."""
    ids = (f"{number:08x}" for number in ids_of(names).tolist())
    # Non-ASCII names are not escaped, as some decoders do not support "\\u".
    return json.dumps(
        dict(zip(map(_readable, names), ids, strict=True)), ensure_ascii=False, separators=(",", ":")
    )


def is_long(names: Sequence[str]) -> bool:
    """Whether a film should store these names once, in a file beside its pictures."""
    return sum(len(name) + len('"":"12345678",') for name in names) > MAX_INLINE


def write_manifest(path: str | Path, names: Sequence[str]) -> None:
    """Write the manifest file named by `Shot.manifest`: the stroke names of all pictures of a film.

    Written once, before the first picture; pictures only refer to it. Equal names give equal bytes, and the
    file appears when it is complete.

    Raises SceneError if the file cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(manifest_of([*names, OTHER]) + "\n", encoding="utf-8", newline="\n")


def ids_of(names: Sequence[str]) -> U32:
    """[N] ids of names, as uint32 bits."""
    ids = murmur3([_readable(name).encode() for name in names])
    exponent = ids >> 23 & 0xFF
    return np.where((exponent == 0) | (exponent == 0xFF), ids ^ 1 << 23, ids).astype(np.uint32)


def murmur3(keys: Sequence[bytes]) -> U32:
    """[N] MurmurHash3_x86_32 of each key, with seed 0; vectorised, as there are thousands.

    Source: Austin Appleby, MurmurHash3.cpp (public domain).
    """
    lengths = np.fromiter(map(len, keys), np.uint32, len(keys))
    num_words = int(lengths.max(initial=0)) // 4 + 1
    words = np.frombuffer(b"".join(key.ljust(4 * num_words, b"\0") for key in keys), "<u4")
    hashes = np.zeros(len(keys), np.uint32)
    for at, word in enumerate(words.reshape(len(keys), num_words).T):
        mixed = hashes ^ _rotated(word * np.uint32(0xCC9E2D51), 15) * np.uint32(0x1B873593)
        whole = _rotated(mixed, 13) * np.uint32(5) + np.uint32(0xE6546B64)
        # The bytes after the last whole word form one word, padded with zeros, which is only mixed in.
        hashes = np.where(at < lengths // 4, whole, np.where(at == lengths // 4, mixed, hashes))
    hashes ^= lengths
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        hashes = (hashes ^ hashes >> np.uint32(shift)) * np.uint32(factor)
    return np.asarray(hashes ^ hashes >> np.uint32(16))


def _rotated(values: U32, count: int) -> U32:
    return np.asarray(values << np.uint32(count) | values >> np.uint32(32 - count))


def _readable(name: str) -> str:
    """A name with "?" for characters that UTF-8 cannot encode, from file names that are not valid text."""
    return name.encode("utf-8", "replace").decode()


def _attributes(title: str, name: str, names: Sequence[str], shot: Shot) -> dict[str, Attribute]:
    key = f"cryptomatte/{ids_of([title])[0]:08x}"[:-1]
    values = {"name": title, "hash": "MurmurHash3_32", "conversion": "uint32_to_float32"}
    if shot.manifest is not None and name == SHARED_MATTE:
        values["manif_file"] = shot.manifest.as_posix()
    else:
        values["manifest"] = manifest_of(names)
    return {f"{key}/{part}": Attribute("string", value) for part, value in values.items()}


def _ranks(matte: Matte, most: int) -> list[Rank]:
    """At most `most` ranks, largest first; the rest is merged into an item with index `len(names)`."""
    rows, coverage = matte.rows, matte.coverage
    if rows.shape[2] > most:
        last = np.where(rows[..., most] >= 0, np.int32(len(matte.names)), rows[..., most - 1])
        rest = coverage[..., most - 1 :].sum(axis=-1)
        rows = np.concatenate([rows[..., : most - 1], last[..., None]], axis=-1)
        coverage = np.concatenate([coverage[..., : most - 1], rest[..., None]], axis=-1)
        order = np.argsort(-coverage, axis=-1, kind="stable")
        rows = np.take_along_axis(rows, order, axis=-1)
        coverage = np.take_along_axis(coverage, order, axis=-1)
    return [(rows[..., k], coverage[..., k]) for k in range(rows.shape[2])]


def _planes(title: str, names: Sequence[str], ranks: Sequence[Rank], count: int) -> list[Plane]:
    """Channels of `count` ranks (an even number), two per layer of four channels; missing ranks are empty."""
    ids = np.append(ids_of(names), np.uint32(0)).view(np.float32)  # index -1 is no item, id 0
    planes = []
    for k in range(count):
        layer, letters = f"{title}{k // 2:02}", "BA" if k % 2 else "RG"
        pair = _rows_of(ids, *ranks[k]) if k < len(ranks) else (_nothing, _nothing)
        planes += [
            Plane(f"{layer}.{letter}", "float", rows) for letter, rows in zip(letters, pair, strict=True)
        ]
    return planes


def _rows_of(ids: F32, things: NDArray[np.int32], coverage: F32) -> tuple[Rows, Rows]:
    """The ids and the coverage of a rank, computed while they are written."""
    return lambda rows: ids[things[rows]], lambda rows: coverage[rows]


def _nothing(rows: slice) -> Array:
    return np.zeros((1, 1), np.float32)  # broadcast to all pixels
