"""Options of `brushgs view`: its server, and videos requested from its page."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal

from brushgs.options.choices import MAX_FILE_PIXELS, size_rule
from brushgs.options.sequence import DEFAULT_FPS, MAX_FPS
from brushgs.options.table import Options, in_files, option

LOOPBACK = "127.0.0.1"
MAX_SECONDS = 600.0  # length of a video: more is a typing error
MAX_KEYS = 500  # marked views of a path

FilmKind = Literal["turn", "path", "clip"]


class ServerConfig(Options, frozen=True):
    """Address and port of the page's server."""

    GROUP: ClassVar = "server"
    ABOUT: ClassVar = "on this machine, for its own browser by default"
    # fmt: off
    host: Annotated[str, option("address to serve on: 127.0.0.1 for this machine only; another of its "
        "addresses, or 0.0.0.0 for all, for other machines too", metavar="ADDRESS")] = LOOPBACK
    port: Annotated[int, option("port of the page; 0 takes a free one", ge=0, le=65535)] = 0
    certificate: Annotated[Path | None, option("certificate for https, PEM", default="none: http")] = None
    key: Annotated[Path | None, option("private key of the certificate, PEM", flag="--private-key")] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.certificate is None) != (self.key is None):
            missing = "certificate" if self.certificate is None else "key"
            raise ValueError(f"{missing} is missing: https needs --certificate and --private-key")
        if not self.host.strip():
            raise ValueError(f"host must be an address of this machine, got {self.host!r}")

    @property
    def is_local(self) -> bool:
        """Whether only this machine can reach it."""
        return self.host == LOOPBACK or self.host == "localhost"


def check_picture(width: int, height: int) -> None:
    """Raise ValueError if a picture requested from the page is too large."""
    if broken := size_rule(width, height):
        raise ValueError(f"size {broken}")
    if width * height > MAX_FILE_PIXELS:
        most = f"{MAX_FILE_PIXELS / 1e6:.0f} million pixels"
        raise ValueError(f"size must be at most {most}, got {width}x{height}; `brushgs render` paints larger")


class FilmConfig(Options, frozen=True):
    """A video requested from the page.

    "turn" is one orbit around the target of the page's view; "path" goes through marked views; "clip" is a
    moving scene before a camera that rests.
    """

    kind: FilmKind
    seconds: Annotated[float, in_files("duration", gt=0, le=MAX_SECONDS)]
    width: int
    height: int
    fps: Annotated[float, in_files("frames per second", gt=0, le=MAX_FPS)] = DEFAULT_FPS
    loop: Annotated[bool, in_files("whether a path continues from the last view to the first")] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        check_picture(self.width, self.height)
