"""Damage to a file, by chance but repeatable: what a stranger, a bad disk or a broken exporter might do."""

import random
import re
import struct
import zlib
from collections.abc import Sequence

MAX_LENGTH = 1 << 16  # bytes of an input: enough for every structure, small enough for a thousand a second
PNG_START = b"\x89PNG\r\n\x1a\n"
_NUMBER = re.compile(rb"-?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?")
_NUMBERS = rb"""
    0 -0 1 -1 255 256 65536 2147483647 4294967295 9999999999999999999 9999999999999999999999999999999999999999
    1e400 -1e400 1e-400 1e38 3.5e38 1e308 5e-324 nan NaN inf Infinity -Infinity 1,5 1_0 0x10 null true []
    {} "1"
""".split()
_NUMBERS += [b"\xc2\xb2"]
_INTEGERS = (0, 1, 2, 127, 128, 255, 256, 32767, 65535, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)


def mutate(rng: random.Random, data: bytes, seeds: Sequence[bytes], tokens: Sequence[bytes]) -> bytes:
    """One more input: `data` with one to eight edits, at most MAX_LENGTH long.

    Args:
        rng: where all chance comes from.
        data: the file to damage.
        seeds: whole files of the same kind, of which parts are taken.
        tokens: words of the format.
    """
    changed = bytearray(data)
    for _ in range(1 << rng.randrange(4)):
        choice = rng.randrange(12)
        if choice == 0 and tokens:
            _put(rng, changed, rng.choice(tokens))
        elif choice == 1:
            other = rng.choice(seeds)
            start = rng.randrange(len(other) + 1)
            _put(rng, changed, other[start : start + rng.randrange(1, 256)])
        elif choice == 2 and changed.startswith(PNG_START):
            changed[:] = _edited_png(rng, bytes(changed))
        else:
            rng.choice(_EDITS)(rng, changed)
        del changed[MAX_LENGTH:]
    return bytes(changed)


def _place(rng: random.Random, data: bytearray) -> int:
    """Half of the edits go to the first 256 bytes, where headers are."""
    return rng.randrange(min(len(data), 256) + 1 if rng.random() < 0.5 else len(data) + 1)


def _put(rng: random.Random, data: bytearray, piece: bytes) -> None:
    place = _place(rng, data)
    data[place : place + (len(piece) if rng.random() < 0.5 else 0)] = piece


def _write(rng: random.Random, data: bytearray, packed: bytes) -> None:
    place = _place(rng, data)
    data[place : place + len(packed)] = packed


def _flip(rng: random.Random, data: bytearray) -> None:
    if data:
        data[_place(rng, data) % len(data)] ^= 1 << rng.randrange(8)


def _byte(rng: random.Random, data: bytearray) -> None:
    if data:
        data[_place(rng, data) % len(data)] = rng.randrange(256)


def _integer(rng: random.Random, data: bytearray) -> None:
    value = rng.choice(_INTEGERS) if rng.random() < 0.8 else rng.getrandbits(64)
    width, order = rng.choice("BHIQ"), rng.choice("<>")
    _write(rng, data, struct.pack(order + width, value & ((1 << 8 * struct.calcsize(width)) - 1)))


def _real(rng: random.Random, data: bytearray) -> None:
    value = rng.choice((float("nan"), float("inf"), -float("inf"), 0.0, -0.0, 1e-45, 3e38, -3e38, 88.8, 1e30))
    _write(rng, data, struct.pack(rng.choice("<>") + rng.choice("fd"), value))


def _number(rng: random.Random, data: bytearray) -> None:
    matches = list(_NUMBER.finditer(bytes(data[:8192])))
    if matches:
        match = rng.choice(matches)
        data[match.start() : match.end()] = rng.choice(_NUMBERS)


def _cut(rng: random.Random, data: bytearray) -> None:
    del data[_place(rng, data) :]


def _remove(rng: random.Random, data: bytearray) -> None:
    place = _place(rng, data)
    del data[place : place + rng.randrange(1, 64)]


def _repeat(rng: random.Random, data: bytearray) -> None:
    place = _place(rng, data)
    piece = bytes(data[place : place + rng.choice((1, 2, 4, 16, 64, 256))])
    data[place:place] = piece * rng.choice((1, 2, 8, 64, 1024))


def _lines(rng: random.Random, data: bytearray) -> None:
    """A line twice, gone, or elsewhere."""
    lines = bytes(data).splitlines(keepends=True)
    if not lines:
        return
    line = lines[rng.randrange(min(len(lines), 40))]
    place = rng.randrange(min(len(lines), 40) + 1)
    if rng.random() < 0.5:
        lines.remove(line)
    lines[place:place] = [line] * rng.randrange(3)
    data[:] = b"".join(lines)


_EDITS = _flip, _byte, _integer, _integer, _real, _number, _number, _number, _cut, _remove, _repeat, _lines


def _edited_png(rng: random.Random, data: bytes) -> bytes:
    """A chunk of a PNG edited and its checksum made right: else all damage would end at the checksum."""
    chunks, place = [], len(PNG_START)
    while place + 8 <= len(data):
        (length,), name = struct.unpack(">I", data[place : place + 4]), data[place + 4 : place + 8]
        chunks.append((name, bytearray(data[place + 8 : place + 8 + length])))
        place += 12 + length
    if not chunks:
        return data
    name, content = rng.choice(chunks)
    raw = content
    if name == b"IDAT" and rng.random() < 0.7:
        try:
            raw = bytearray(zlib.decompressobj().decompress(bytes(content), MAX_LENGTH))
        except zlib.error:
            name = b"raw"
    rng.choice(_EDITS)(rng, raw)
    if raw is not content:
        content[:] = zlib.compress(bytes(raw))
    if rng.random() < 0.1:
        chunks.insert(rng.randrange(len(chunks)), rng.choice(chunks))
    out = bytearray(PNG_START)
    for name, content in chunks:
        out += struct.pack(">I", len(content)) + name + content
        out += struct.pack(">I", zlib.crc32(name + bytes(content)))
    return bytes(out)
