"""Words of earlier versions, which go on working: one table of them, and as what they are read now."""

from collections.abc import Mapping

FLAGS: Mapping[str, str] = {"clip": "text-model"}  # a film is a clip
VALUES: Mapping[str, str] = {"colour": "color"}


def current(value: str) -> str:
    """A value in the words of today."""
    return VALUES.get(value, value)


def current_words(words: list[str]) -> tuple[list[str], list[str]]:
    """The words of a command line with the flags of today, and a note on each that has another name now."""
    found, notes = [], []
    for word in words:
        name, equals, value = word.partition("=")
        new = FLAGS.get(name.removeprefix("--")) if name.startswith("--") else None
        if new is not None:
            notes.append(f"{name} is now --{new}")
        found.append(word if new is None else f"--{new}{equals}{value}")
    return found, notes
