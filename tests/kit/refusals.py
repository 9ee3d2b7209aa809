"""Files that are refused."""

from collections.abc import Callable
from pathlib import Path

import pytest

from brushgs import SceneError
from brushgs.formats import load


def refuse(path: Path, sentence: str, read: Callable[..., object] = load, **options: object) -> str:
    """Reading fails with this sentence: a single short line that begins with a file of the folder."""
    with pytest.raises(SceneError, match=sentence) as caught:
        read(path, **options)
    message, named = str(caught.value), Path(caught.value.path)
    assert named.is_relative_to(path.parent)
    assert message.startswith(f"{named}: ")
    assert "\n" not in message
    assert len(message) < 1200
    return message


def refuse_bytes(path: Path, content: bytes, sentence: str, read: Callable[..., object] = load) -> str:
    """`refuse`, of a file with this content."""
    path.write_bytes(content)
    return refuse(path, sentence, read)
