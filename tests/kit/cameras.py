"""Camera files of tests."""

import json
from collections.abc import Sequence
from pathlib import Path

from brushgs import Camera


def write_cameras(path: str | Path, cameras: Sequence[Camera], names: Sequence[str] = ()) -> Path:
    """Write the `cameras.json` of a 3DGS training, with names of their pictures where they have any."""
    entries = []
    for number, camera in enumerate(cameras):
        entry = {"id": number, "width": camera.width, "height": camera.height}
        entry |= {"fx": camera.K[0, 0], "fy": camera.K[1, 1], "position": camera.position.tolist()}
        entry |= {"rotation": camera.viewmat[:3, :3].T.tolist()}
        entries.append(entry | ({"img_name": names[number]} if names else {}))
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(entries))
    return path
