"""Which kind of file a scene path leads to: a PLY is opened, anything else refused by name."""

from pathlib import Path
from typing import BinaryIO

from brushgs.errors import SceneError
from brushgs.io.files import open_plain

_CONVERT = "convert it to .ply first, for example with SuperSplat or splat-transform"

# First bytes -> what such a file is and what to do about it.
_MAGIC = {
    b"version https://git-lfs": "is a git-LFS pointer, not the scene itself; run 'git lfs pull'",
    b"<": "is a web page or XML, not a scene: the download went wrong; fetch the file itself",
    b"PK\x03\x04": f"is a zip bundle (a .sog scene or an archive), which is not read; {_CONVERT}",
    b"\x1f\x8b": f"is gzip data (a .spz scene or an archive), which is not read; {_CONVERT}",
    b"NGSP": f"is an .spz scene, which is not read; {_CONVERT}",
    b"glTF": "is a glTF model, not a 3D Gaussian scene; export the splats as .ply",
}
# Formats without an unmistakable beginning, by suffix.
_SUFFIXES = (".splat", ".ksplat", ".spz", ".sog", ".lcc")
_LONGEST_MAGIC = 64


def open_ply(path: str | Path) -> BinaryIO:
    """Open a PLY file at its first byte, unbuffered.

    Content decides, not the suffix: a PLY under any name is opened.

    Raises:
        SceneError: if there is no such file, it cannot be read, or it is something else; says what it
            is and what to do.
    """
    path = Path(path)
    file = open_plain(path, ".ply file", buffering=0)
    try:
        begin = file.read(_LONGEST_MAGIC)
        if not (begin.startswith(b"ply") and begin[3:4] in (b"\n", b"\r")):
            raise SceneError(path, _what_it_is(begin, path.suffix.lower()))
        file.seek(0)
    except BaseException:
        file.close()
        raise
    return file


def _what_it_is(begin: bytes, suffix: str) -> str:
    """One clause: what a file is that is no PLY, and the cure."""
    if not begin:
        return "is empty; copy or download it again"
    text = begin.removeprefix(b"\xef\xbb\xbf").lstrip()
    for magic, message in _MAGIC.items():
        if text.startswith(magic):
            return message
    if suffix in _SUFFIXES:
        return f"is a {suffix} scene, which is not read; {_CONVERT}"
    return f"is not a PLY file: it must begin with 'ply', got {begin[:8]!r}; export the scene as .ply"
