"""The program of a worker process: it receives items and replies to each with its result.

Started as `python -c BOOT stream num_threads folder is_asked *sys.path`: a fresh interpreter. It copies no
threads or state of the parent (forking with threads may hang), and does not import the running script
(`multiprocessing` would run it again).
"""

import _thread
import shutil
import signal
import tempfile
import threading
from contextlib import closing, suppress
from queue import SimpleQueue

from brushgs.core.messages import PickledWork, run_item
from brushgs.core.streams import Stream, open_stream, receive, send
from brushgs.core.threads import at_most

BOOT = (
    "import sys; stream, num_threads, folder, is_asked, *sys.path = sys.argv[1:]; "
    "from brushgs.core.worker import serve; serve(stream, int(num_threads), folder, is_asked == 'True')"
)


def serve(stream_word: str, num_threads: int, folder: str, is_asked: bool) -> None:
    """Receive pickled work, then items, and reply to each until the other end of the stream is closed.

    Args:
        stream_word: see `open_stream`.
        num_threads: for the work.
        folder: of temporary files; removed at the end.
        is_asked: stop running work at the end, as by SIGTERM; else finish it first, which matters only if the
            parent was killed.
    """
    tempfile.tempdir = folder
    if is_asked:
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGTERM])
    messages: SimpleQueue[bytearray | None] = SimpleQueue()
    with (
        suppress(OSError, KeyboardInterrupt),
        at_most(num_threads),
        closing(open_stream(stream_word)) as stream,
    ):
        threading.Thread(target=_receive, args=(stream, messages, is_asked), daemon=True).start()
        if (work := messages.get()) is not None:
            do = PickledWork(work)
            while (message := messages.get()) is not None:
                send(stream, run_item(do, message))
    shutil.rmtree(folder, ignore_errors=True)


def _receive(stream: Stream, messages: "SimpleQueue[bytearray | None]", is_asked: bool) -> None:
    """Queue incoming messages until the parent has finished or was killed."""
    with suppress(EOFError, OSError):
        while True:
            messages.put(receive(stream))
    if is_asked and hasattr(signal, "pthread_kill"):
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGTERM)
    elif is_asked:
        _thread.interrupt_main(signal.SIGTERM)
    messages.put(None)
