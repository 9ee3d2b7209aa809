"""The errors and warnings that brushgs raises by name; everything else is ValueError or TypeError."""

from pathlib import Path

_LONGEST = 1000  # characters of a message


class SceneError(ValueError):
    """A file that cannot be used as asked: one sentence with the file, what is wrong and the cure.

    Attributes:
        path: the file at fault.
    """

    def __init__(self, path: str | Path, message: str) -> None:
        self.path = Path(path)
        # What a file says is quoted in messages: it must neither steer the terminal nor flood it.
        message = "".join(c if c.isprintable() else "?" for c in message[: _LONGEST + 1])
        self._message = message if len(message) <= _LONGEST else f"{message[:_LONGEST]}..."
        super().__init__(f"{self.path}: {self._message}")

    def __reduce__(self) -> tuple[object, ...]:
        """For pickle, which would call the class with the finished sentence: an error may cross processes."""
        return type(self), (self.path, self._message), self.__dict__


class SceneWarning(UserWarning):
    """A file that is usable after something in it was left out; the sentence says what and how much."""
