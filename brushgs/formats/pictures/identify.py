"""Which format a picture has: its content decides, and costly ones are refused before they are decoded.

OpenImageIO has decoders for some twenty-five formats and chooses by the suffix; brushgs lets it use those of
the table, chosen by content.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, scratch_folder
from brushgs.formats.format import NUM_FIRST_BYTES, Format
from brushgs.formats.registry import PICTURES_READ, find_read, function_of


def find_format(path: Path, max_pixels: int) -> Format:
    """The format of a picture, checked as far as is needed before a decoder opens it.

    Raises:
        SceneError: if there is no such plain file, it is of no known format, or would take too much memory
            or time.
    """
    with open_plain(path, "picture") as file:
        begin = file.read(NUM_FIRST_BYTES)
        picture_format = find_read("picture", path, begin)
        if picture_format is None:
            fact = f"cannot be read as a picture (it is not {PICTURES_READ})"
            raise SceneError(path, f"{fact}; convert it to PNG")
        if picture_format.read:
            function_of(picture_format.read)(path, file, max_pixels)
    return picture_format


@contextmanager
def suffixed(path: Path, picture_format: Format) -> Iterator[Path]:
    """A path to the file with a suffix of its format, so that no other decoder is tried first."""
    if path.suffix.lower() in picture_format.suffixes:
        yield path
        return
    with scratch_folder() as folder:
        link = folder / f"picture{picture_format.suffixes[0]}"
        try:
            link.symlink_to(path.resolve())
        except OSError:  # Windows makes links only for whom it trusts
            shutil.copyfile(path, link)
        yield link
