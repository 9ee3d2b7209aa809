"""Amounts of memory as text. Only the standard library is imported."""

import re

UNITS = {"MB": 10**6, "GB": 10**9, "TB": 10**12, "MiB": 1 << 20, "GiB": 1 << 30, "TiB": 1 << 40}


def parse_memory(text: str) -> int:
    """Bytes of a text such as "8GB", "500 MB" or "1.5GiB", in any case.

    Raises:
        ValueError: if it is not a memory size.
    """
    match = re.fullmatch(r"([0-9]{1,9}(?:\.[0-9]{1,9})?) ?([MGT]i?B)", text, re.IGNORECASE)
    units = {unit.lower(): size for unit, size in UNITS.items()}
    size = 0 if match is None else int(float(match[1]) * units[match[2].lower()])
    if size < 1:
        raise ValueError(f"memory must be a size above 0 such as 8GB or 500MB, got {text!r}")
    return size


def memory_words(size: int) -> str:
    """An amount of memory in words, such as "8 GB" or "512 MB"."""
    return f"{size / 1e9:.3g} GB" if size >= 10**9 else f"{size / 1e6:.3g} MB"
