"""A connection to an existing Dask cluster: one clear sentence for each way in which there can be none."""

import logging
import socket
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any
from urllib.parse import urlsplit

import brushgs

CONNECT = 10.0  # seconds for the scheduler to answer
NO_WORKERS = 60.0  # seconds without a single worker until that is an error: batch systems take their time
MUST_AGREE = "python", "distributed"  # but for the last number: 3.11.7 and 3.11.9, 2026.8.0 and 2026.8.1

LOGGERS = "distributed.client", "tornado.application"


def _is_wanted(record: logging.LogRecord) -> bool:
    """Drop what Dask says on stderr where it arrives here as an error, or is only that Ctrl-C came early."""
    return record.name == "tornado.application" and "sync.<locals>.cancel" not in record.getMessage()


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client` within the block, after the versions everywhere have been compared.

    Raises:
        ValueError: if Dask is not installed, or the cluster runs other versions.
        ConnectionError: if the scheduler cannot be reached, is lost within the block, or has no workers.
    """
    client = None
    for name in LOGGERS:
        logging.getLogger(name).addFilter(_is_wanted)
    try:
        client = _connect(address)
        wait_for_workers(client)  # there must be somebody to ask
        check_versions(client)
        yield client
    except (OSError, RuntimeError, CancelledError) as error:
        if client is None or client.status == "running":
            raise
        raise ConnectionError(f"spread: the scheduler {address} is gone") from error
    finally:
        if client is not None:
            client.close()
        for name in LOGGERS:
            logging.getLogger(name).removeFilter(_is_wanted)


def check_address(address: str) -> tuple[str, int]:
    """Host and port of a scheduler.

    Raises:
        ValueError: if the text is no address of one.
    """
    try:
        parts = urlsplit(address)
        if parts.scheme in ("tcp", "tls") and parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:  # a port that is no number
        pass
    raise ValueError(f"spread: scheduler must be an address like tcp://host:8786, got {address!r}")


def check_scheduler(address: str) -> None:
    """See that Dask is installed and somebody answers, at no cost: for a look before long work.

    Raises:
        ValueError: if the text is no address, or Dask is not installed.
        ConnectionError: if nobody answers there.
    """
    check_address(address)
    if find_spec("distributed") is None:
        raise ValueError("a scheduler needs Dask, which is not installed; pip install 'dask[distributed]'")
    with _answering(address):
        _knock(address)


def _connect(address: str) -> Any:
    check_scheduler(address)
    from distributed import Client

    with _answering(address), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of versions: `check_versions` decides
        return Client(address, timeout=CONNECT, set_as_default=False, name="brushgs")


@contextmanager
def _answering(address: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise ConnectionError(
            f"spread: no Dask scheduler answers at {address} ({reason}); "
            "check the address, or start one: dask scheduler"
        ) from error


def _knock(address: str) -> None:
    """Tell a wrong address by a look: Dask tries again and again, and waits for a silent one without end.

    Raises:
        OSError: if nobody is there, or somebody who does not speak first as a Dask scheduler does.
    """
    with socket.create_connection(check_address(address), CONNECT) as stream:
        if address.startswith("tcp:") and not stream.recv(1):
            raise ConnectionError("it hangs up")


def wait_for_workers(client: Any) -> None:
    """Return as soon as there is a worker.

    Raises:
        ConnectionError: if there is none for too long.
    """
    try:
        client.wait_for_workers(1, timeout=NO_WORKERS)
    except TimeoutError:
        address = client.scheduler.address
        raise ConnectionError(
            f"spread: the scheduler {address} has had no workers for {NO_WORKERS:.0f} s; "
            f"start some: dask worker {address}"
        ) from None


def check_versions(client: Any) -> None:
    """See that the scheduler and all workers run what runs here.

    Raises:
        ValueError: if brushgs is missing or another version, or Python or Dask are too far apart to
            understand each other.
    """

    def version() -> str:  # a function in a function travels by value: it works where brushgs is missing
        import brushgs

        return brushgs.__version__

    versions = client.get_versions()
    everywhere = {f"worker {address}": facts["packages"] for address, facts in versions["workers"].items()}
    for where, there in {"scheduler": versions["scheduler"]["packages"], **everywhere}.items():
        check_packages(where, versions["client"]["packages"], there)
    found = {f"worker {address}": there for address, there in client.run(version, on_error="return").items()}
    try:
        found["scheduler"] = client.run_on_scheduler(version)
    except ImportError as error:
        found["scheduler"] = error
    for where, there in found.items():
        check_brushgs(where, there, brushgs.__version__)


def check_packages(where: str, here: Mapping[str, str | None], there: Mapping[str, str | None]) -> None:
    """See that Python and Dask are alike enough here and there."""
    for package in MUST_AGREE:
        mine, theirs = (str(packages.get(package)) for packages in (here, there))
        if mine.split(".")[:2] != theirs.split(".")[:2]:
            raise ValueError(
                f"spread: the {where} must have {package} {mine} as this process, got {theirs}; "
                "Dask needs like versions everywhere"
            )


def check_brushgs(where: str, there: object, here: str) -> None:
    """See that brushgs is the same there: a version, or the error that asking for it gave."""
    if isinstance(there, ImportError):
        raise ValueError(f"spread: the {where} must have brushgs {here}, got none; install it there")
    if isinstance(there, str) and there != here:  # any other error: a worker that just ends
        raise ValueError(
            f"spread: the {where} must have brushgs {here} as this process, got {there}; "
            "another version may paint other pixels"
        )
