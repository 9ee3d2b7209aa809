"""The stream between this process and a worker: a socket, or two pipes if sockets are not inherited
(Windows).

Pipes are the worker's standard input and output: its work prints to stderr. Messages are eight bytes of
length, then that many bytes: `multiprocessing.connection` does the same, but takes 0.25 s for a frame of 30
MB instead of 0.05 s.
"""

import os
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import IO, Any, Protocol

from brushgs.core.signals import STOP_SIGNALS

INHERITS_SOCKETS = os.name == "posix"
_PIPES = "-1"  # in place of the descriptor of a socket
_LENGTH = struct.Struct("!Q")


class Stream(Protocol):
    """The methods of a socket that messages need."""

    def sendall(self, data: bytes, /) -> None:
        """Send all of the data. Raises OSError if the other end is closed."""

    def recv_into(self, buffer: memoryview, /) -> int:
        """Receive some bytes, and return how many; 0 if the other end is closed."""

    def shutdown(self, how: int, /) -> None:
        """With `socket.SHUT_WR`: end sending; receiving continues."""

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

    def shutdown(self, how: int, /) -> None:
        self._writer.close()

    def close(self) -> None:
        for end in (self._writer, self._reader):
            with suppress(OSError):  # unwritten data is lost
                end.close()


def send(stream: Stream, message: bytes) -> None:
    """Send one message. Raises OSError if the other end is closed."""
    stream.sendall(_LENGTH.pack(len(message)))
    stream.sendall(message)


def receive(stream: Stream) -> bytearray:
    """The next message. Raises EOFError or OSError if the other end closes before it is complete."""
    (length,) = _LENGTH.unpack(_receive_exactly(stream, _LENGTH.size))
    return _receive_exactly(stream, length)


def _receive_exactly(stream: Stream, length: int) -> bytearray:
    message = bytearray(length)
    rest = memoryview(message)
    while rest:
        count = stream.recv_into(rest)
        if count == 0:
            raise EOFError("the other end is closed")
        rest = rest[count:]
    return message


def block_stops() -> None:
    """Block `STOP_SIGNALS` for processes started by this thread, from their first instruction on.

    Terminals send Ctrl-C, and `timeout` SIGTERM, to all processes of a group: only this process should react.
    Without signal masks (Windows) `start_worker` handles it.
    """
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)


def start_worker(
    boot: str, words: Sequence[str], environment: Mapping[str, str] | None, output: Any, is_apart: bool
) -> tuple["subprocess.Popen[bytes]", Stream]:
    """Start Python with the program `boot`; returns the process and this end of its stream.

    Args:
        boot: a one-line program.
        words: its arguments, after one for `open_stream`.
        environment: variables that replace those of this process; None keeps these.
        output: target of its output, as for `subprocess`.
        is_apart: keep it outside of this process's group, whose signals it then does not get.

    Raises:
        OSError: if there is no memory for another process.
    """
    start: Any = partial(subprocess.Popen, stderr=output, env=environment)
    command, pipe, nothing = [sys.executable, "-c", boot], subprocess.PIPE, subprocess.DEVNULL
    if not INHERITS_SOCKETS:
        apart = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # not reached by Ctrl-C
        process: subprocess.Popen[bytes] = start(
            [*command, _PIPES, *words], stdin=pipe, stdout=pipe, creationflags=apart
        )
        assert process.stdin is not None
        assert process.stdout is not None
        return process, _Pipes(process.stdout, process.stdin)
    ours, theirs = socket.socketpair()
    with theirs:
        given = theirs.fileno()
        more = {"stdin": nothing, "stdout": output, "pass_fds": [given], "start_new_session": is_apart}
        try:
            return start([*command, str(given), *words], **more), ours
        except BaseException:
            ours.close()
            raise


def open_stream(descriptor: str) -> Stream:
    """The stream to the parent process, from the argument that it passed."""
    if descriptor != _PIPES:
        return socket.socket(fileno=int(descriptor))
    pipes = _Pipes(os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb"))
    nowhere = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nowhere, 0)
    os.close(nowhere)
    os.dup2(2, 1)  # prints must not mix with messages
    return pipes
