"""A `Style` becomes a file, laid out for people: what they may edit stands in lines of its own."""

import json
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.io.styles import edit, marks, palette
from brushgs.io.styles.format import MARK, MAX_BYTES, VERSION
from brushgs.io.styles.read import style_of
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.values.style import Style


def write_style(style: Style, path: str | Path) -> None:
    """Write a style; the file appears when it is complete, and equal styles give equal bytes.

    Args:
        style: has a palette, marks or an edit.
        path: ends in .style.

    Raises:
        ValueError: if the suffix is another one, the style would take more than 200 kB, or a value is out of
            the range that `brushgs.values.style` states; then nothing is written.
        SceneError: if the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != STYLE_SUFFIX:
        raise ValueError(
            f"a style must be written to a file *{STYLE_SUFFIX}, got {str(path)!r}; change the suffix"
        )
    content = content_of(style, path)
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def content_of(style: Style, path: Path) -> bytes:
    """The bytes of a style file, which can be read again. `path` is for messages; raises ValueError."""
    value: dict[str, Any] = {"brushgs": MARK, "version": VERSION, "name": style.name}
    if style.palette is not None:
        value["palette"] = palette.to_json(style.palette)
    if style.marks is not None:
        value["marks"] = marks.to_json(style.marks)
    if style.edit is not None:
        value["edit"] = edit.to_json(style.edit)
    content = (_laid_out(value) + "\n").encode()
    if len(content) > MAX_BYTES:
        cure = "learn a smaller residual" if style.edit is not None else "keep fewer or smaller brushes"
        rule = f"a style must take at most {MAX_BYTES // 1000} kB, got {len(content) / 1000:.0f}"
        raise ValueError(f"{path}: {rule}; {cure}")
    try:
        style_of(path, content)
    except SceneError as error:
        raise ValueError(f"the style cannot be written: {error}") from None
    return content


def _laid_out(value: Any, indent: str = "") -> str:
    """JSON in which only objects that people read, and lists of these, take several lines."""
    inner = indent + "  "
    if isinstance(value, dict) and "data" not in value:
        rows = [f"{json.dumps(name)}: {_laid_out(part, inner)}" for name, part in value.items()]
    elif isinstance(value, list) and any(isinstance(part, dict | list) for part in value):
        rows = [_laid_out(part, inner) for part in value]
    else:
        return json.dumps(value, ensure_ascii=False)
    begin, end = "{}" if isinstance(value, dict) else "[]"
    return begin + ",".join(f"\n{inner}{row}" for row in rows) + f"\n{indent}{end}"
