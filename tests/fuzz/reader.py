"""What the fuzzer must know of one reader."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path

SEPARATOR = b"\n---8<---\n"  # between the files of one input


@dataclass(frozen=True)
class Reader:
    """How files of one format are read.

    Attributes:
        name: what the command line calls it.
        seeds: makes whole files of this format in a folder of its own, and returns their bytes.
        tokens: words of the format.
        file: name of the file that an input is written to; of corpora "" where it follows from the table.
        others: names of files beside it, which the parts of an input after the first are written to.
        read: reads the file at a path; what it returns is judged.
    """

    name: str
    seeds: Callable[[Path], list[bytes]]
    tokens: Sequence[bytes] = ()
    file: str = ""
    others: tuple[str, ...] = ()
    read: Callable[[Path], object] = Path.read_bytes

    def joined(self, other: "Reader") -> "Reader":
        """This reader, fed with the seeds of another one too."""

        def seeds(folder: Path) -> list[bytes]:
            return self.seeds(folder) + other.seeds(folder)

        return replace(self, seeds=seeds, tokens=tuple(dict.fromkeys([*self.tokens, *other.tokens])))

    def write(self, data: bytes, folder: Path) -> Path:
        """Write an input to where `read` expects it."""
        path = folder / self.file
        if path.suffix in (".bin", ".txt"):
            cameras, _, images = data.partition(SEPARATOR)
            path.with_stem("cameras").write_bytes(cameras)
            path.with_stem("images").write_bytes(images)
        else:
            first, *parts = data.split(SEPARATOR, len(self.others)) if self.others else [data]
            path.write_bytes(first)
            for name, part in zip_longest(self.others, parts):
                other = folder / name
                other.parent.mkdir(exist_ok=True)
                if part is None:
                    other.unlink(missing_ok=True)
                else:
                    other.write_bytes(part)
        return path
