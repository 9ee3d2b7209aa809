"""Messages for unknown flags, with the nearest known ones.

Flags cannot be abbreviated: an abbreviation would change its meaning when a flag is added (`--look` once
meant `--look-at`).
"""

import re
from collections.abc import Sequence
from difflib import get_close_matches
from itertools import takewhile

from brushgs.options.table import listed

MOST_NAMED = 3  # suggested flags that start with the given text


def with_nearest_flag(sentence: str, words: Sequence[str], known: Sequence[str]) -> str:
    """The error message, with the nearest flags for the first unknown one.

    Args:
        sentence: message of the parser; returned unchanged if all flags are known.
        words: command name and arguments.
        known: all flags of the command.
    """
    flags = takewhile(lambda word: word != "--", words)
    named = (word.partition("=")[0] for word in flags if re.match("--[A-Za-z]", word))
    unknown = next((flag for flag in named if flag not in known), None)
    if unknown is None:
        return sentence
    what, where = f"unrecognized arguments: {unknown}", f"(see brushgs {words[0]} --help)"
    if words[0] == unknown:
        where = "(see brushgs --help)"
    if sentence.startswith(what):
        what = sentence.partition(" (see ")[0]
    if longer := sorted((flag for flag in known if flag.startswith(unknown)), key=len)[:MOST_NAMED]:
        return f"{what}; flags are written in full: did you mean {listed(longer)}? {where}"
    nearest = get_close_matches(unknown[:100], known, n=1)
    return f"{what}; did you mean {nearest[0]}? {where}" if nearest else f"{what} {where}"
