"""Header comments of PLY files that record what `Stored` holds: JSON in lines that every reader takes."""

from brushgs.formats.scenes.stored import Stored, content_of, parse_text, text_of

PREFIX = "comment brushgs "
_LINE = 180  # characters of JSON a line: some readers take 255 a word and 1024 a line


def comment_lines(stored: Stored) -> list[str]:
    """The comments, in ASCII and without newlines; none where there is nothing to say.

    Raises:
        ValueError: if the names of the brushes are too long.
    """
    content = content_of(stored)
    text = text_of(content) if content else ""
    return [PREFIX + text[start : start + _LINE] for start in range(0, len(text), _LINE)]


def read_comments(text: str) -> Stored:
    """The content of the comments, their text joined without `PREFIX`.

    Raises:
        ValueError: if it is damaged.
    """
    return parse_text(text)
