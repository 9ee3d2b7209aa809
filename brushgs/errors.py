"""The error and the warning that brushgs defines; every other error is a ValueError or a TypeError."""

from pathlib import Path

_MAX_LENGTH = 1000  # characters of a message


class SceneError(ValueError):
    """A file that cannot be read or written as requested: one sentence with the file, the fault and the cure.

    Attributes:
        path: of the file.
    """

    def __init__(self, path: str | Path, message: str) -> None:
        self.path = Path(path)
        # Messages quote text of files, which must neither send control codes to the terminal nor flood it.
        message = "".join(c if c.isprintable() else "?" for c in message[: _MAX_LENGTH + 1])
        self._message = message if len(message) <= _MAX_LENGTH else f"{message[:_MAX_LENGTH]}..."
        super().__init__(f"{self.path}: {self._message}")

    def __reduce__(self) -> tuple[object, ...]:
        """For pickle, since errors cross processes: it would call the class with the finished sentence."""
        return type(self), (self.path, self._message), self.__dict__


class NoGaussiansError(SceneError):
    """A sound file of a scene without Gaussians, as a moment of a moving scene may be."""


class SceneWarning(UserWarning):
    """A file that is usable although a part of it was dropped; the sentence says what and how much."""
