"""The connection to an existing Dask cluster, with a clear message for each kind of failure."""

import logging
import socket
import struct
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any
from urllib.parse import urlsplit

import brushgs
from brushgs.options.sequence import WORKERS_TIMEOUT

CONNECT_TIMEOUT = 10.0  # seconds for the scheduler to answer
_LENGTH = struct.Struct("<Q")  # a scheduler first sends the length of its greeting, some hundred bytes
MAX_GREETING = 1 << 20  # Dask asks for the memory of any length: that of an SSH server is 2.8 EiB
# Packages whose versions must agree up to the last number: 3.11.7 and 3.11.9 do, 2026.8.0 and 2026.8.1 do.
MATCHED_PACKAGES = "python", "distributed"

LOGGERS = "distributed.client", "tornado.application"


def _is_unexpected(record: logging.LogRecord) -> bool:
    """Log filter: drop records of errors that are raised here anyway, or of an early Ctrl-C."""
    return record.name == "tornado.application" and "sync.<locals>.cancel" not in record.getMessage()


@dataclass(frozen=True)
class Waiting:
    """How long to wait for a worker if a scheduler has none.

    Attributes:
        seconds: > 0, timeout. Batch systems are slow to start.
        tell: called with a sentence when a long wait begins.
    """

    seconds: float = WORKERS_TIMEOUT
    tell: Callable[[str], None] = lambda sentence: None


@contextmanager
def connect(address: str, waiting: Waiting | None = None) -> Iterator[Any]:
    """A `distributed.Client` within the block, after comparing the versions of all machines.

    Args:
        address: of the scheduler.
        waiting: for the first worker.

    Raises:
        ValueError: if Dask is not installed, or the cluster has other versions.
        ConnectionError: if the scheduler cannot be reached, is lost within the block, or has no workers.
    """
    client = None
    for name in LOGGERS:
        logging.getLogger(name).addFilter(_is_unexpected)
    try:
        client = _open_client(address)
        wait_for_workers(client, waiting or Waiting())  # their versions are compared too
        check_versions(client)
        yield client
    except (OSError, RuntimeError, CancelledError) as error:
        if client is None or (client.status == "running" and not _is_closed_connection(error)):
            raise
        raise ConnectionError(f"{address}: the connection to the Dask scheduler was lost") from error
    finally:
        if client is not None:
            client.close()
        for name in LOGGERS:
            logging.getLogger(name).removeFilter(_is_unexpected)


def _is_closed_connection(error: BaseException) -> bool:
    """Whether Dask raised this because the other end is gone: it may, before the client has noticed."""
    from distributed.comm import CommClosedError

    return isinstance(error, CommClosedError)


def check_address(address: str) -> tuple[str, int]:
    """Host and port of a scheduler.

    Raises:
        ValueError: if the text is not the address of one.
    """
    try:
        parts = urlsplit(address)
        if parts.scheme in ("tcp", "tls") and parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:  # the port is not a number
        pass
    raise ValueError(f"scheduler must be an address such as tcp://host:8786, got {address!r}")


def check_scheduler(address: str, waiting: Waiting | None = None) -> None:
    """Check that a scheduler answers and has a worker, and their versions: in a second, before long work.

    Raises:
        ValueError: if the text is not an address, or Dask is not installed, or versions differ.
        ConnectionError: if no scheduler answers, or no worker connects in time.
    """
    with connect(address, waiting):
        pass


def _check_listens(address: str) -> None:
    """Check that Dask is installed and something listens at the address. Raises as `check_scheduler`."""
    check_address(address)
    if find_spec("distributed") is None:
        raise ValueError("a scheduler needs Dask, which is not installed; pip install 'dask[distributed]'")
    with _connection_errors(address):
        _probe(address)


def _open_client(address: str) -> Any:
    _check_listens(address)
    from distributed import Client

    with _connection_errors(address), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about versions: `check_versions` decides
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False, name="brushgs")


@contextmanager
def _connection_errors(address: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise ConnectionError(
            f"{address}: no Dask scheduler answers ({reason}); "
            "check the address, or start a scheduler: dask scheduler"
        ) from error


def _probe(address: str) -> None:
    """Recognize a wrong address quickly: Dask retries many times, and blocks forever on a silent server.

    Raises:
        OSError: if nothing listens there, or the server does not speak first as a Dask scheduler does.
    """
    with socket.create_connection(check_address(address), CONNECT_TIMEOUT) as stream:
        if not address.startswith("tcp:"):
            return
        head = b""
        while len(head) < _LENGTH.size:
            part = stream.recv(_LENGTH.size - len(head))
            if not part:
                raise ConnectionError("it closes the connection")
            head += part
        if _LENGTH.unpack(head)[0] > MAX_GREETING:
            raise ConnectionError("something else does")


def wait_for_workers(client: Any, waiting: Waiting) -> None:
    """Return as soon as there is a worker.

    Raises:
        ConnectionError: if none connects in time.
    """
    if client.nthreads():
        return
    address = client.scheduler.address
    cure = f"start some: dask worker {address}"
    what = f"{address}: the Dask scheduler has no workers"
    waiting.tell(f"{what}; waiting {waiting.seconds:g} s for one ({cure})")
    try:
        client.wait_for_workers(1, timeout=waiting.seconds)
    except TimeoutError:
        raise ConnectionError(
            f"{address}: the Dask scheduler has had no workers for {waiting.seconds:g} s; {cure}"
        ) from None


def check_versions(client: Any) -> None:
    """Check that the scheduler and all workers have the versions of this process.

    Raises:
        ValueError: if brushgs is missing or another version, or Python or Dask are too far apart to
            communicate.
    """

    def version() -> str:  # a nested function is pickled by value: it runs even if brushgs is missing
        import brushgs

        return brushgs.__version__

    versions = client.get_versions()
    workers = {f"worker {address}": facts["packages"] for address, facts in versions["workers"].items()}
    for where, there in {"scheduler": versions["scheduler"]["packages"], **workers}.items():
        check_packages(where, versions["client"]["packages"], there)
    found = {f"worker {address}": there for address, there in client.run(version, on_error="return").items()}
    try:
        found["scheduler"] = client.run_on_scheduler(version)
    except ImportError as error:
        found["scheduler"] = error
    for where, there in found.items():
        check_brushgs(where, there, brushgs.__version__)


def check_packages(where: str, here: Mapping[str, str | None], there: Mapping[str, str | None]) -> None:
    """Check that the versions of Python and Dask agree here and there, up to the last number."""
    for package in MATCHED_PACKAGES:
        mine, theirs = (str(packages.get(package)) for packages in (here, there))
        if mine.split(".")[:2] != theirs.split(".")[:2]:
            raise ValueError(
                f"the {where} must have {package} {mine} as this process, got {theirs}; "
                "Dask needs the same versions everywhere"
            )


def check_brushgs(where: str, there: object, here: str) -> None:
    """Check a remote version of brushgs: `there` is the version, or the error that asking for it raised."""
    if isinstance(there, ImportError):
        raise ValueError(f"the {where} must have brushgs {here}, got none; install it there")
    if isinstance(there, str) and there != here:  # other errors: a worker that is just shutting down
        raise ValueError(
            f"the {where} must have brushgs {here} as this process, got {there}; "
            "another version may paint other pixels"
        )
