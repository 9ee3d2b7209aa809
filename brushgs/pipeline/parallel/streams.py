"""The stream between this process and a worker: a socket, or two pipes where none is inherited (Windows).

Pipes are the worker's standard input and output: what its work prints goes to stderr there.
"""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from typing import IO, Protocol

from brushgs.core.signals import STOP_SIGNALS

INHERITS_SOCKETS = os.name == "posix"
_PIPES = "-1"  # in place of the descriptor of a socket


class Stream(Protocol):
    """As much of a socket as messages need."""

    def sendall(self, data: bytes, /) -> None:
        """Send all of the data. Raises OSError if the other end is closed."""

    def recv_into(self, buffer: memoryview, /) -> int:
        """Receive some bytes, and return how many; 0 if the other end is closed."""

    def close(self) -> None:
        """Close this end."""


class _Pipes:
    def __init__(self, reader: IO[bytes], writer: IO[bytes]) -> None:
        self._reader, self._writer = reader, writer

    def sendall(self, data: bytes, /) -> None:
        self._writer.write(data)
        self._writer.flush()

    def recv_into(self, buffer: memoryview, /) -> int:
        return int(self._reader.readinto(buffer))  # type: ignore[attr-defined]

    def close(self) -> None:
        for end in (self._writer, self._reader):
            with suppress(OSError):  # what it could not write is lost
                end.close()


def block_stops() -> None:
    """Let the processes that this thread starts hear none of `STOP_SIGNALS`, from their first instruction on.

    A terminal sends Ctrl-C, and `timeout` SIGTERM, to all processes of a group: only the main thread of this
    process should receive them. Without signal masks (Windows) `start_worker` sees to it.
    """
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def start_worker(boot: str, words: Sequence[str]) -> tuple["subprocess.Popen[bytes]", Stream]:
    """Start Python, which runs `boot` on a word for `open_stream` and `words`; it, and its stream here.

    Raises:
        OSError: if there is no memory for another process.
    """
    command = [sys.executable, "-c", boot]
    if not INHERITS_SOCKETS:
        apart = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # which Ctrl-C does not reach
        pipe = subprocess.PIPE
        process = subprocess.Popen([*command, _PIPES, *words], stdin=pipe, stdout=pipe, creationflags=apart)
        assert process.stdin is not None
        assert process.stdout is not None
        return process, _Pipes(process.stdout, process.stdin)
    ours, theirs = socket.socketpair()
    with theirs:
        try:
            given = theirs.fileno()
            process = subprocess.Popen(
                [*command, str(given), *words], stdin=subprocess.DEVNULL, pass_fds=[given]
            )
        except BaseException:
            ours.close()
            raise
    return process, ours


def open_stream(descriptor: str) -> Stream:
    """The stream to the process that started this one, from the word that it gave."""
    if descriptor != _PIPES:
        return socket.socket(fileno=int(descriptor))
    pipes = _Pipes(os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb"))
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.close(nowhere)
    os.dup2(2, 1)  # what is printed must not come between messages
    return pipes
