"""Options of `brushgs view`: where its page is served, and what is painted from there."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from brushgs.options.choices import MAX_FILE_PIXELS, size_rule
from brushgs.options.sequence import DEFAULT_FPS, check_fps

LOOPBACK = "127.0.0.1"
MAX_SECONDS = 600.0  # of a video: more is a typing error
MAX_KEYS = 500  # views of a path that were marked in the page

FilmKind = Literal["turn", "path"]


@dataclass(frozen=True)
class ServerConfig:
    """Where a page is served.

    Attributes:
        host: address of this machine; any but 127.0.0.1 is reached by others.
        port: 0 to 65535; 0 takes a free one.
        certificate: of https, a file in PEM; None for http.
        key: of the certificate, a file in PEM. Both or neither.
    """

    host: str = LOOPBACK
    port: int = 0
    certificate: Path | None = None
    key: Path | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.port <= 65535:
            raise ValueError(f"port must be 0 to 65535, got {self.port}; 0 takes a free one")
        if (self.certificate is None) != (self.key is None):
            missing = "certificate" if self.certificate is None else "key"
            raise ValueError(f"{missing} is missing: https needs --certificate and --private-key")
        if not self.host.strip():
            raise ValueError(f"host must be an address of this machine, got {self.host!r}")

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches it."""
        return self.host == LOOPBACK or self.host == "localhost"


def check_picture(width: int, height: int) -> None:
    """Raise ValueError where a picture that is asked for from the page is too large."""
    if broken := size_rule(width, height):
        raise ValueError(f"size {broken}")
    if width * height > MAX_FILE_PIXELS:
        most = f"{MAX_FILE_PIXELS / 1e6:.0f} million pixels"
        raise ValueError(f"size must be at most {most}, got {width}x{height}; `brushgs render` paints larger")


@dataclass(frozen=True)
class FilmConfig:
    """A video that is asked for from the page.

    Attributes:
        kind: "turn" for one turn around what the page looks at, from its view; "path" through marked views.
        seconds: duration, above 0, at most 600.
        width: pixels.
        height: pixels.
        fps: frames per second, in (0, 1000].
        loop: whether a path continues from the last view to the first.
    """

    kind: FilmKind
    seconds: float
    width: int
    height: int
    fps: float = DEFAULT_FPS
    loop: bool = False

    def __post_init__(self) -> None:
        if self.kind not in ("turn", "path"):
            raise ValueError(f"kind must be turn or path, got {self.kind!r}")
        if not 0 < self.seconds <= MAX_SECONDS:
            raise ValueError(f"seconds must be above 0 and at most {MAX_SECONDS:g}, got {self.seconds:g}")
        check_fps(self.fps)
        check_picture(self.width, self.height)
