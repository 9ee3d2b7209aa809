"""The program of a worker process: it receives items and replies to each with its result.

Started as `python -c BOOT stream num_threads folder *sys.path`: a fresh interpreter. It copies neither
threads nor state of the first process (a fork of a process with threads may hang), and it does not import the
script that runs there (`multiprocessing` would, and so run it again).
"""

import shutil
import tempfile
from contextlib import closing

from brushgs.core.threads import at_most
from brushgs.pipeline.parallel import wire
from brushgs.pipeline.parallel.messages import PickledWork, run_item
from brushgs.pipeline.parallel.streams import open_stream

BOOT = (
    "import sys; stream, num_threads, folder, *sys.path = sys.argv[1:]; "
    "from brushgs.pipeline.parallel.worker import serve; serve(stream, int(num_threads), folder)"
)


def serve(stream_word: str, num_threads: int, folder: str) -> None:
    """Receive pickled work, then items, and reply to each until the other end of the stream is closed.

    Args:
        stream_word: see `open_stream`.
        num_threads: that the work may use.
        folder: of temporary files. The first process removes it; this one does where that one was killed.
    """
    tempfile.tempdir = folder
    with closing(open_stream(stream_word)) as stream, at_most(num_threads):
        try:
            work = PickledWork(wire.receive(stream))
            while True:
                wire.send(stream, run_item(work, wire.receive(stream)))
        except (EOFError, OSError):  # the first process has finished, or was killed
            shutil.rmtree(folder, ignore_errors=True)
