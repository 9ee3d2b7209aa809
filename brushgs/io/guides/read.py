"""A file of guides of any format becomes `Guides`."""

from importlib import import_module
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.files import read_whole
from brushgs.io.guides.formats import GUIDE_FORMATS, GUIDES_READ
from brushgs.io.guides.guide_file import MAX_BYTES, Guides


def read_guides(path: str | Path) -> Guides:
    """Read lines in space that strokes run along.

    Args:
        path: a file in one of the formats of `GUIDES_READ`; its suffix decides.

    Raises:
        SceneError: if there is no such regular file, it is larger than 16 MiB, of no known format or damaged,
            holds no line, or a number that is not finite.
    """
    path = Path(path)
    guide_format = next((row for row in GUIDE_FORMATS if path.suffix.lower() in row.suffixes), None)
    if guide_format is None:
        raise SceneError(path, f"is no file of guides of a known format; give {GUIDES_READ}")
    reader = import_module(f"brushgs.io.guides.{guide_format.reader}")
    guides: Guides = reader.read(path, read_whole(path, MAX_BYTES, "guides file"))
    return guides
