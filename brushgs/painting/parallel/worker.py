"""What runs in a process that `Processes` has started: it waits for items and answers each with its result.

Started as `python -c BOOT descriptor num_threads *sys.path`: a fresh interpreter, so that neither threads nor
the state of the first process is copied (a fork of a process with threads may hang), and one that knows
nothing of the script that runs there (which `multiprocessing` would import, and so run, once more).
"""

import socket

from brushgs.painting.parallel import wire
from brushgs.painting.parallel.messages import Parcel, answer
from brushgs.threads import at_most

BOOT = (
    "import sys; descriptor, num_threads, *sys.path = sys.argv[1:]; "
    "from brushgs.painting.parallel.worker import serve; serve(int(descriptor), int(num_threads))"
)


def serve(descriptor: int, num_threads: int) -> None:
    """Read pickled `work`, then items until the other end of the socket is closed; answer every item."""
    with socket.socket(fileno=descriptor) as stream, at_most(num_threads):
        try:
            work = Parcel(wire.receive(stream))
            while True:
                wire.send(stream, answer(work, wire.receive(stream)))
        except (EOFError, OSError):  # closed: whoever asked is gone, whether in peace or killed
            return
