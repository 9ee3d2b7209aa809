"""Style files: JSON that people can read and edit, see `read.py`; `write.py` writes them.

Colours are "#rrggbb", numbers plain; only arrays are base64. The offsets of a colour are relative to it: who
edits one colour moves all that is around it.
"""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from brushgs.values.style import Style

__all__ = ["load_style", "save_style"]


def load_style(path: str | Path) -> "Style":
    """Read a style from a file that `save_style` or `brushgs style learn` wrote, edited by hand or not.

    Raises:
        SceneError: if there is no such regular file, it is larger than 200 kB, no style, of a later version,
            or a field is missing, unknown or wrong; names the field.

    Example:
        >>> from brushgs.values.style import StyleEdit
        >>> darker = StyleEdit(0.6 * np.eye(3, 4))
        >>> bg.save_style(bg.Style("dusk", edit=darker), "dusk.style")
        >>> bg.load_style("dusk.style")
        Style('dusk', an edit)
    """
    from brushgs.formats.styles.read import read_style

    return read_style(path)


def save_style(style: "Style", path: str | Path) -> None:
    """Write a style to a file *.style, which appears when it is complete.

    Raises:
        ValueError: if the suffix is another one, the style would take more than 200 kB, or a value is out of
            its range; then nothing is written.
        SceneError: if the file cannot be written.

    Example:
        >>> from brushgs.values.style import StyleEdit
        >>> darker = StyleEdit(0.6 * np.eye(3, 4))
        >>> bg.save_style(bg.Style("dusk", edit=darker), "dusk.style")
    """
    from brushgs.formats.styles.write import write_style

    write_style(style, path)
