"""Standard streams that are closed or that break: what cannot be written is dropped, and the work goes on.

`brushgs ... | head -0`, `>&-`, `2>&-`, a terminal that is gone: a picture is worth more than its table.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO, cast


class ForgivingStream:
    """A text stream that drops what cannot be written, from the first error on.

    Attributes:
        error: the first one; None if there was none.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.error: OSError | None = None

    def write(self, text: str) -> int:
        """Write text, or drop it."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._drop(error)
        return len(text)

    def flush(self) -> None:
        """Write what waits, or drop it."""
        try:
            self._stream.flush()
        except OSError as error:
            self._drop(error)

    def _drop(self, error: OSError) -> None:
        """Let the rest vanish: Python writes once more when it ends, and would complain."""
        self.error = self.error or error
        with suppress(OSError, ValueError):
            number = self._stream.fileno()
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, number)
            os.close(nowhere)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def forgiving_streams() -> Iterator[ForgivingStream]:
    """Within the block nothing fails because stdout or stderr is closed; yields stdout."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # A file of ours would get this free number, and with it whatever a library prints there.
            os.open(os.devnull, os.O_RDWR)
    before = sys.stdout, sys.stderr
    # A name of a file may have letters that the encoding of a terminal lacks, above all on Windows.
    strict = [one for one in before if isinstance(one, TextIOWrapper) and one.errors == "strict"]
    for stream in strict:
        stream.reconfigure(errors="backslashreplace")
    with Path(os.devnull).open("w", encoding="utf-8") as nowhere:  # a closed stream is None
        out, err = (ForgivingStream(stream or nowhere) for stream in before)
        sys.stdout, sys.stderr = cast(TextIO, out), cast(TextIO, err)
        try:
            yield out
        finally:
            out.flush()
            err.flush()
            sys.stdout, sys.stderr = before
            for stream in strict:
                stream.reconfigure(errors="strict")
