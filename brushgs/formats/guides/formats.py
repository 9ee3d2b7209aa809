"""The table of formats of guides. To add one: write a function in `read.py`, and its line here.

Error texts, help texts and the fuzzer read this table.
"""

from typing import NamedTuple

from brushgs.options.table import listed


class GuideFormat(NamedTuple):
    """A format of guides.

    Attributes:
        name: in words, for help and error texts.
        suffixes: of its files, in lower case.
        reader: which function of `read.py` reads it.
        file: a usual name of such a file.
    """

    name: str
    suffixes: tuple[str, ...]
    reader: str
    file: str


GUIDE_FORMATS = (
    GuideFormat("OBJ with lines, as Blender exports them", (".obj",), "obj", "guides.obj"),
    GuideFormat("JSON, a list of lists of points [x, y, z]", (".json",), "lists", "guides.json"),
)
# For help and error texts, in the order of the table.
GUIDES_READ = listed([f"{row.name} ({', '.join(row.suffixes)})" for row in GUIDE_FORMATS])
