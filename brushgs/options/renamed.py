"""Flags and values of earlier versions that still work, with their current names."""

from collections.abc import Mapping

FLAGS: Mapping[str, str] = {
    "clip": "text-model",  # "clip" means a film now
    "vgg-weights": "weights",
}
VALUES: Mapping[str, str] = {"colour": "color"}


def current(value: str) -> str:
    """The current name of a value."""
    return VALUES.get(value, value)


def current_words(words: list[str]) -> tuple[list[str], list[str]]:
    """Command-line words with current flag names, and a note for each renamed flag."""
    found, notes = [], []
    for word in words:
        name, equals, value = word.partition("=")
        new = FLAGS.get(name.removeprefix("--")) if name.startswith("--") else None
        if new is not None:
            notes.append(f"{name} is now --{new}")
        found.append(word if new is None else f"--{new}{equals}{value}")
    return found, notes
