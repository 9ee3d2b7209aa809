"""Which way strokes run, as text."""

from pathlib import Path

import pytest

from brushgs.options.direction import Direction
from tests.kit.for_each import for_each


@for_each(
    ("text", "direction"),
    [
        ("own", Direction("own")),
        ("form", Direction()),
        ("color", Direction("color")),
        ("painting:a/b.png", Direction("painting", Path("a/b.png"))),
        ("guides:C:/lines.obj", Direction("guides", Path("C:/lines.obj"))),
    ],
)
def test_a_direction_and_its_text(text, direction):
    assert (Direction.of(text), str(direction)) == (direction, text)


@for_each(
    ("text", "cure"),
    [
        ("shape", "got 'shape'"),
        ("", "got ''"),
        ("painting", "got 'painting'; write painting:FILE"),
        ("guides:", "got 'guides:'; write guides:FILE"),
        ("form:a.png", "got 'form:a.png'; write form alone"),
    ],
)
def test_other_texts_are_refused(text, cure):
    with pytest.raises(
        ValueError, match="direction must be own, form, color, style, painting:FILE or guides:FILE"
    ) as e:
        Direction.of(text)
    assert str(e.value).endswith(cure)
