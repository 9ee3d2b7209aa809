"""A style file becomes a `Style`."""

from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.files import open_plain
from brushgs.io.json_file import as_count, decode_json, shown
from brushgs.io.styles import edit, marks, palette
from brushgs.io.styles.fields import Fields
from brushgs.io.styles.format import CURE, MARK, MAX_BYTES, VERSION
from brushgs.values.style import Style


def read_style(path: str | Path) -> Style:
    """Read a style that `write_style` wrote, or that an artist edited.

    Args:
        path: the file; its content decides, not its name.

    Raises:
        SceneError: if there is no such regular file, it is larger than 200 kB, no style, of a later version,
            or a field is missing, unknown or wrong; names the field.
    """
    path = Path(path)
    with open_plain(path, "style file") as file:
        try:
            content = file.read(MAX_BYTES + 1)
        except OSError as error:
            raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None
    if content and not content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        raise SceneError(
            path, f"is no style file; where it is a painting, `brushgs style learn {path}` makes one"
        )
    if len(content) > MAX_BYTES:
        raise SceneError(path, f"a style file must have at most {MAX_BYTES // 1000} kB, got more; {CURE}")
    return style_of(path, content)


def style_of(path: Path, content: bytes) -> Style:
    """The style of the content of a file. Raises as `read_style` does."""
    value = decode_json(path, content, CURE, has_names=True)
    if not isinstance(value, dict) or value.get("brushgs") != MARK:
        raise SceneError(path, f'is no style file (it does not begin with "brushgs": "{MARK}"); {CURE}')
    version = as_count(value.get("version"), 1_000_000)
    if version is None or version < 1:
        got = shown(value.get("version"))
        raise SceneError(path, f"'version' must be {VERSION}, got {got}; {CURE}")
    if version > VERSION:
        fact = f"is a style of version {version}, and this brushgs reads up to version {VERSION}"
        raise SceneError(path, f"{fact}; update brushgs, or learn the style again")
    fields = Fields(path, value)
    for name in ("brushgs", "version"):
        fields.take(name, "")
    if not any(name in fields for name in ("palette", "marks", "edit")):
        raise SceneError(path, f"holds neither 'palette' nor 'marks' nor 'edit'; {CURE}")
    style = Style(
        fields.text("name"),
        palette.of_json(fields) if "palette" in fields else None,
        marks.of_json(fields) if "marks" in fields else None,
        edit.of_json(fields) if "edit" in fields else None,
    )
    fields.end()
    return style
