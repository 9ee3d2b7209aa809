"""A flag that there is not: what is wrong with the words of a command, with the nearest flags that there are.

Flags are written in full. A shortened one would mean something else as soon as there is a new flag: `--look`
of a command without a look stood for `--look-at`.
"""

import re
from collections.abc import Sequence
from difflib import get_close_matches
from itertools import takewhile

from brushgs.options.table import listed

MOST_NAMED = 3  # flags that begin with what was written for one


def with_nearest_flag(sentence: str, words: Sequence[str], known: Sequence[str]) -> str:
    """What is wrong with words, and of the first flag among them that there is not the nearest ones.

    Args:
        sentence: what the parser says; kept where all flags are known.
        words: the name of a command and what follows it.
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
