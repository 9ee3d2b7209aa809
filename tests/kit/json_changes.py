"""JSON content with a change."""

from copy import deepcopy
from functools import reduce
from operator import getitem
from typing import Any


def with_value(content: Any, place: str, value: object = ...) -> Any:
    """A copy with another value at a place such as "keys/0/time", or without it."""
    content = deepcopy(content)
    *steps, last = (int(step) if step.isdecimal() else step for step in place.split("/"))
    owner: Any = reduce(getitem, steps, content)
    if value is ...:
        del owner[last]
    else:
        owner[last] = value
    return content
