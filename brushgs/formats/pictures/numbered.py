"""Numbered picture files, and a manifest beside them that records which painting they belong to.

The manifest of `FOLDER/%05d.png` is `FOLDER/.%05d.png.json`, see `read_record`: its heading describes the
painting, each entry is a finished frame with its file size. A frame is done if the manifest lists it and its
file has that size, so files of an earlier painting are never mistaken for frames of this one.
"""

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from brushgs.core.signals import defer_stop
from brushgs.formats.files import add_to_record, begin_record, note_written, read_record, replacing

_NUMBER = re.compile(r"%(?:0[1-9][0-9]?)?d")  # %d or %05d
DEFAULT_NAME = "%05d.png"


class NumberedFiles(NamedTuple):
    """The files of a sequence: a folder, and a name with a placeholder for the frame number."""

    folder: Path  # of the files
    name: str  # such as "%05d.png"

    @classmethod
    def of(cls, path: Path, suffixes: tuple[str, ...]) -> "NumberedFiles":
        """Parse a pattern such as frames/%05d.png.

        Raises ValueError if the name does not have exactly one placeholder, the folder has one, or the suffix
        is not in `suffixes`.
        """
        if "%" in str(path.parent):
            raise ValueError(f"the number must be in the name of the file, not of its folder, got '{path}'")
        if path.suffix.lower() not in suffixes:
            rule = f"numbered frames must end in {', '.join(suffixes)}, got '{path}'"
            raise ValueError(f"{rule}; the suffix decides the format")
        if len(_NUMBER.findall(path.name)) != 1 or path.name.count("%") != 1:
            rule = f"a name of numbered frames must hold one number such as %05d, got '{path}'"
            raise ValueError(f"{rule}; write {path.parent / DEFAULT_NAME}")
        return cls(path.parent, path.name)

    @property
    def pattern(self) -> Path:
        """Folder and name."""
        return self.folder / self.name

    @property
    def manifest(self) -> Path:
        """The path of the manifest."""
        return self.folder / f".{self.name}.json"

    def named(self, name: str) -> Path:
        """Path of a file shared by all frames: `shot.strokes.json` beside shot.%04d.exr."""
        stem = _NUMBER.sub("", self.name.rpartition(".")[0]).strip(" ._-")
        return self.folder / (f"{stem}.{name}" if stem else name)

    def path(self, index: int) -> Path:
        """The file of a frame; numbers start at 0."""
        return self.folder / (self.name % index)

    def number(self, path: Path) -> int | None:
        """The frame number in a file name; None if it does not match the pattern."""
        before, after = _NUMBER.split(self.name)
        match = re.fullmatch(f"{re.escape(before)}([0-9]+){re.escape(after)}", path.name)
        return int(match[1]) if match and self.path(int(match[1])).name == path.name else None

    def numbers(self) -> list[int]:
        """The numbers of the existing frames, ascending."""
        found = (self.number(path) for path in self.folder.glob("*"))
        return sorted(number for number in found if number is not None)


@dataclass
class Manifest:
    """Record of the finished frames of a sequence."""

    files: NumberedFiles  # the frames
    painting: Mapping[str, Any]  # everything they depend on: name -> number, text or None, ready for JSON
    sizes: dict[int, int] = field(default_factory=dict)  # bytes of each finished frame, by number

    @classmethod
    def read(cls, files: NumberedFiles) -> "Manifest | None":
        """Read the manifest beside the frames; None if there is none.

        Raises SceneError if it cannot be read, or is no manifest.
        """
        fault = "is no manifest of frames; remove it, or omit --resume to paint all frames again"
        found = read_record(files.manifest, "painting", fault)
        return None if found is None else cls(files, found[0], dict(_sizes(found[1])))

    def is_done(self, index: int) -> bool:
        """Whether a frame of this painting is complete."""
        try:
            return index in self.sizes and self.files.path(index).stat().st_size == self.sizes[index]
        except OSError:
            return False

    def begin(self) -> None:
        """Start or resume the frames: rewrite the manifest. Raises SceneError if it cannot be written."""
        entries = [_entry(index, size) for index, size in sorted(self.sizes.items())]
        begin_record(self.files.manifest, {"painting": self.painting}, entries)
        note_written(*(self.files.path(index) for index in self.sizes))

    def add(self, index: int, content: bytes) -> None:
        """Write a frame, completely or not at all, then add its entry to the manifest.

        Raises SceneError if either cannot be written.
        """
        with defer_stop():
            with replacing(self.files.path(index)) as temporary:
                temporary.write_bytes(content)
            self.sizes[index] = len(content)
            add_to_record(self.files.manifest, _entry(index, len(content)))


def _entry(index: int, size: int) -> dict[str, int]:
    return {"frame": index, "bytes": size}


def _sizes(entries: list[dict[str, Any]]) -> Iterator[tuple[int, int]]:
    """Frame and size of each entry that has both."""
    for entry in entries:
        with suppress(ValueError, KeyError, TypeError, OverflowError):
            yield int(entry["frame"]), int(entry["bytes"])
