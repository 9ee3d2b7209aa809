"""Scene files that are refused."""

from pathlib import Path

import pytest

from brushgs import SceneError
from brushgs.formats import load


def refuse(path: Path, sentence: str, **options: object) -> None:
    """Loading fails with this sentence: a single short line that begins with a file of the folder."""
    with pytest.raises(SceneError, match=sentence) as caught:
        load(path, **options)
    message, named = str(caught.value), Path(caught.value.path)
    assert named.is_relative_to(path.parent)
    assert message.startswith(f"{named}: ")
    assert "\n" not in message
    assert len(message) < 1200
