"""Which format a scene file has: its content decides, and what is no scene is refused by name."""

from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.files import check_plain, is_dir, open_plain
from brushgs.formats.format import BYTE_ORDER_MARK, NUM_FIRST_BYTES, ZIP_BEGINNINGS, Format
from brushgs.formats.registry import SCENES_READ, find_read, formats_of

# First bytes of files that are no scenes -> what they are, and the cure.
_NO_SCENES = {
    b"version https://git-lfs": "is a git-LFS pointer, not the scene itself; run 'git lfs pull'",
    b"{": "is JSON, but of no SOG scene (meta.json, lod-meta.json) and no glTF model; name the scene itself",
    b"[": "is JSON, as lists of cameras are, not a scene; name the scene itself",
    b"<": "is a web page or XML, not a scene: the download went wrong; download the file itself",
}


def find_format(path: Path) -> Format:
    """The format of a scene file or of a folder that holds a scene.

    Raises:
        SceneError: if there is no such file, it may not be read, or it is of no format that is read; says
            what it is and the cure.
    """
    begin = _first_bytes(path)
    scene_format = _match(path, begin)
    if scene_format is None:
        check_plain(path, "scene file")  # refuses folders
        raise SceneError(path, _what_it_is(path, begin))
    return scene_format


def match_format(path: Path) -> Format | None:
    """`find_format`, but None for what is of no format that is read, such as a folder of scene files.

    Raises:
        SceneError: if there is no such file or it may not be read.
    """
    return _match(path, _first_bytes(path))


def _first_bytes(path: Path) -> bytes:
    if is_dir(path):
        return b""
    with open_plain(path, "scene file", buffering=0) as file:
        return file.read(NUM_FIRST_BYTES)


def _match(path: Path, begin: bytes) -> Format | None:
    if not begin and not is_dir(path):
        return None
    return find_read("scene", path, begin)


def _what_it_is(path: Path, begin: bytes) -> str:
    """One clause: what a file is that is not read, and the cure."""
    if not begin:
        return "is empty; copy or download it again"
    text = begin.removeprefix(BYTE_ORDER_MARK).lstrip()
    for first_bytes, message in _NO_SCENES.items():
        if text.startswith(first_bytes):
            return message
    if begin.startswith(ZIP_BEGINNINGS):
        from brushgs.formats.scenes.sog_files import open_files

        with open_files(path):  # raises: it says what the archive holds
            pass
    for known in formats_of("scene"):
        if known.matches(path, begin):
            return f"is a {known.name}, which is not read; {known.cure}"
    return f"is of no scene format that is read: it begins with {begin[:8]!r}; export it as {SCENES_READ}"
