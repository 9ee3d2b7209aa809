"""Write a painting as OpenRaster: a zip of PNG files, one for each layer, and what they are together.

Source: freedesktop.org, OpenRaster 0.0.5. Krita, MyPaint and GIMP read it. Layers have 8 bits a channel.
"""

import io
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, replacing
from brushgs.formats.pictures.images import encode_frame, resize
from brushgs.formats.pictures.oiio import Background
from brushgs.formats.pictures.shot import Shot
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame
from brushgs.values.sheets import LEAST, Sheet

MIME = "image/openraster"
MERGED = "mergedimage.png"
_THUMBNAIL_SIDE = 256  # pixels, the longest that the format takes


def write_ora(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> int:
    """Write the layers of a frame; equal frames give equal bytes.

    Args:
        frame: with its `sheets`.
        path: the name of the file; it appears when it is complete.
        background: as `write_frame` takes it; of transparent pictures the lowest layer.
        shot: for the metadata, which the merged picture holds.

    Returns:
        The number of layers.

    Raises:
        SceneError: if the file cannot be written.
    """
    sheets = on_background(frame, background)
    merged = encode_frame(frame, ".png", background, shot=shot)
    files = {f"data/{row:02d}.png": _png(sheet) for row, sheet in enumerate(sheets)}
    files |= {MERGED: merged, "Thumbnails/thumbnail.png": _thumbnail(frame, background)}
    files["stack.xml"] = _stack_of(sheets, frame)
    with replacing(path) as temporary:
        try:
            temporary.write_bytes(_zipped(files))
        except OSError as error:
            raise SceneError(path, f"cannot be written ({error.strerror})") from None
    return len(sheets)


def merged_picture(path: Path) -> bytes:
    """The merged picture of a file, as PNG.

    Raises:
        SceneError: if there is no such file, or it is not OpenRaster.
    """
    with open_plain(path, "picture") as file:
        try:
            with zipfile.ZipFile(file) as archive:
                return archive.read(MERGED)
        except (zipfile.BadZipFile, KeyError, NotImplementedError, RuntimeError):
            raise SceneError(path, "is no OpenRaster file, or damaged; get it again") from None


def on_background(frame: Frame, background: Background) -> tuple[Sheet, ...]:
    """The layers over a background; light that their colours, of at most 1, cannot hold there is added."""
    if background is None or (frame.alpha == 1).all():
        return frame.sheets
    color = np.broadcast_to(np.asarray(background, frame.rgb.dtype), frame.rgb.shape)
    solid = np.ones_like(frame.alpha)
    found, shown = [Sheet("background", color, solid)], color
    for sheet in frame.sheets:
        assert sheet.mix == "src-over", "the only kind without a ground"
        found.append(sheet)
        shown = sheet.rgb + (1 - sheet.alpha[..., None]) * shown
    light = np.clip(np.clip(frame.over(color), 0, 1) - shown, 0, 1)
    if light.max(initial=0) > LEAST:
        found.append(Sheet("light", light, solid, "plus"))
    return tuple(found)


def _png(sheet: Sheet) -> bytes:
    return encode_frame(Frame(sheet.rgb, sheet.alpha), ".png")


def _thumbnail(frame: Frame, background: Background) -> bytes:
    alpha = frame.alpha if background is None else np.ones_like(frame.alpha)
    rgb = frame.rgb if background is None else frame.over(background)
    pixels: Array = np.concatenate([rgb, alpha[..., None]], axis=2).clip(0, 1)
    height, width = alpha.shape
    scale = min(1.0, _THUMBNAIL_SIDE / max(height, width))
    pixels = resize(pixels, max(1, round(scale * width)), max(1, round(scale * height)))
    return encode_frame(Frame(pixels[..., :3], pixels[..., 3]), ".png")


def _stack_of(sheets: tuple[Sheet, ...], frame: Frame) -> bytes:
    """The layers as XML, the uppermost first."""
    height, width = frame.alpha.shape
    image = ElementTree.Element("image", version="0.0.5", w=str(width), h=str(height))
    stack = ElementTree.SubElement(image, "stack")
    for row, sheet in reversed(list(enumerate(sheets))):
        place = {"x": "0", "y": "0", "opacity": "1.0", "visibility": "visible"}
        source = {"name": sheet.name, "src": f"data/{row:02d}.png", "composite-op": f"svg:{sheet.mix}"}
        ElementTree.SubElement(stack, "layer", {**source, **place})
    text: bytes = ElementTree.tostring(image, encoding="UTF-8", xml_declaration=True)
    return text


def _zipped(files: dict[str, bytes]) -> bytes:
    """A zip whose first file is the type, as it is; PNG files are not compressed twice."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w", zipfile.ZIP_STORED) as archive:
        for name, content in ({"mimetype": MIME.encode()} | files).items():
            archive.writestr(zipfile.ZipInfo(name), content)  # of 1980: equal pictures are equal files
    return whole.getvalue()
