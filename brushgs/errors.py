"""The error and the warning that brushgs defines; every other error is a ValueError or a TypeError."""

from pathlib import Path

_MAX_LENGTH = 1000  # characters of a message


class SceneError(ValueError):
    """A file cannot be read or written as requested: one sentence names the file, the fault and the cure.

    Attributes:
        path: the file.
        message: the sentence without the file.
    """

    def __init__(self, path: str | Path, message: str) -> None:
        self.path = Path(path)
        # Messages quote file contents: keep control codes and long texts away from the terminal.
        message = "".join(c if c.isprintable() else "?" for c in message[: _MAX_LENGTH + 1])
        self.message = message if len(message) <= _MAX_LENGTH else f"{message[:_MAX_LENGTH]}..."
        super().__init__(f"{self.path}: {self.message}")

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle by path and message: errors cross processes, and the default would pass the finished
        sentence.
        """
        return type(self), (self.path, self.message), self.__dict__


class NoGaussiansError(SceneError):
    """A valid scene file without Gaussians; allowed for one moment of a moving scene."""


class SceneWarning(UserWarning):
    """Part of a usable file was dropped; the sentence says what and how much."""
