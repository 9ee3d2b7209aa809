"""Words that fit a painting, as a table for people."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

HEAD = "in words                 by thresholds on colors and shapes, best first; no language model"


def table_of_words(words: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines: a heading, then each word with its fit and its figure; nothing without words.

    Args:
        words: as `brushgs.doctor.in_words.facts_of` returns them.
    """
    if not words:
        return
    yield HEAD
    width = max(len(word["word"]) for word in words)
    for word in words:
        yield f"  {word['word']:{width}}  {word['fit']:4.2f}  {word['figure']} {word['value']:.3g}"
