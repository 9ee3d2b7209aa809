"""How large a picture may be that is read."""

from pathlib import Path

from brushgs.errors import SceneError

MAX_PIXELS = 1 << 25  # 7680 x 4320 and a little more: as float RGBA they take half a gigabyte


def check_pixels(path: Path, width: int, height: int, max_pixels: int) -> None:
    """Refuse a picture of more than `max_pixels` pixels. Raises SceneError."""
    if width * height > max_pixels:
        size = f"{width}x{height}"
        raise SceneError(path, f"must have at most {max_pixels} pixels, got {size}; scale it down")
