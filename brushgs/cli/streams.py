"""Closed or broken standard streams: text that cannot be written is dropped, and the work continues.

Examples are `brushgs ... | head -0`, `>&-`, `2>&-` and a closed terminal.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO, cast


class ForgivingStream:
    """A text stream that drops all text from the first write error on.

    Attributes:
        error: the first error, or None.
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
        """Write buffered text, or drop it."""
        try:
            self._stream.flush()
        except OSError as error:
            self._drop(error)

    def _drop(self, error: OSError) -> None:
        """Redirect to null: Python flushes once more at exit, and would complain."""
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
    """Within the block closed stdout or stderr cause no error; yields stdout."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # Otherwise a file of ours gets this free descriptor, and with it all that libraries print there.
            os.open(os.devnull, os.O_RDWR)
    before = sys.stdout, sys.stderr
    # File names may have characters that the terminal's encoding lacks, above all on Windows.
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
