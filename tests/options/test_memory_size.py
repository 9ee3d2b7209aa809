"""Amounts of memory in words."""

import pytest

from brushgs.options.memory_size import memory_words, parse_memory
from tests.kit.for_each import for_each


@for_each(
    ("text", "size", "told"),
    [
        ("8GB", 8 * 10**9, "8 GB"),
        ("30.2 GB", 30_200_000_000, "30.2 GB"),
        ("1.5gib", 3 << 29, "1.61 GB"),
        ("0.5mb", 500_000, "0.5 MB"),
    ],
)
def test_a_size_is_read_and_told(text: str, size: int, told: str) -> None:
    assert parse_memory(text) == size
    assert memory_words(size) == told


@for_each("text", ["", "8", "8 G", "GB", "-1GB", "0GB", "1e3MB", "1,5GB", "8GB ", "nan GB"])
def test_what_is_no_size_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^memory must be a size above 0 such as 8GB or 500MB"):
        parse_memory(text)
