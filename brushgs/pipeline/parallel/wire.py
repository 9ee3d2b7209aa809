"""Whole messages over a stream: eight bytes of length, then that many bytes.

`multiprocessing.connection` does the same, but takes 0.25 s for a frame of 30 MB instead of 0.05 s.
"""

import struct

from brushgs.pipeline.parallel.streams import Stream

_LENGTH = struct.Struct("!Q")


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
