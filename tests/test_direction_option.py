"""Which way strokes run, as text."""

from pathlib import Path

import pytest

from brushgs.options.direction import Direction
from tests.kit.for_each import for_each


@for_each("text", ["own", "form", "color", "painting:a/b.png", "guides:C:/lines.obj"])
def test_a_direction_and_its_text(text):
    assert str(Direction.of(text)) == text


def test_parts_of_a_direction():
    assert Direction.of("guides:a:b.obj") == Direction("guides", Path("a:b.obj"))
    assert Direction.of("color") == Direction("color")
    assert Direction() == Direction.of("form")


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
