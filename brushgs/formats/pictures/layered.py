"""Layered files of painting programs: OpenRaster and, with psd-tools, Photoshop.

OpenRaster is a zip of PNG files, one per layer and the merged picture; Krita, MyPaint and GIMP read it.
Layers have 8 bits per channel. The merged picture of a Photoshop file is composited by psd-tools.
Sources: freedesktop.org, OpenRaster 0.0.5; Adobe, Photoshop File Formats Specification.
"""

import io
import zipfile
from itertools import islice
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import on_disk, replacing
from brushgs.formats.pictures.images import MAX_PIXELS, check_pixels, encode_frame, read_image, resize
from brushgs.formats.pictures.oiio import Background
from brushgs.formats.zip_file import open_zip, read_member
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.frame import LEAST, Frame, Sheet
from brushgs.values.shot import Shot

MIME = "image/openraster"
LAYERED_READ = (".ora", ".psd")
_MERGED, _STACK = "mergedimage.png", "stack.xml"
_MAX_STACK, _MAX_LAYER = 1 << 20, 1 << 28  # bytes
_MOST_LAYERS = 1000
_THUMBNAIL_SIDE = 256  # pixels, the longest side that the format allows
_MODES = {"src-over": "NORMAL", "multiply": "MULTIPLY", "color-dodge": "COLOR_DODGE", "plus": "LINEAR_DODGE"}


def write_ora(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> int:
    """Write the layers of a frame; equal frames give equal bytes.

    Args:
        frame: with its `sheets`.
        path: the name of the file; it appears when it is complete.
        background: see `write_frame`; becomes the lowest layer of a transparent picture.
        shot: metadata, stored in the merged picture.

    Returns:
        The number of layers. Raises SceneError if the file cannot be written.
    """
    sheets = _on_background(frame, background)
    files = {"mimetype": MIME.encode()}
    files |= {f"data/{row:02d}.png": _png(sheet.rgb, sheet.alpha) for row, sheet in enumerate(sheets)}
    files |= {_MERGED: encode_frame(frame, ".png", background, shot=shot)}
    files |= {"Thumbnails/thumbnail.png": _thumbnail(frame, background), _STACK: _stack_of(sheets, frame)}
    with replacing(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
        for name, content in files.items():  # "mimetype" must come first; PNG is already compressed
            archive.writestr(zipfile.ZipInfo(name), content)  # dated 1980: equal frames give equal files
    return len(sheets)


def write_psd(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> int:
    """Write the layers of a frame; as `write_ora`, but `shot` is not stored.

    Raises ImportError if psd-tools is not installed, see `encoding.check_encoder`.
    """
    from PIL import Image
    from psd_tools import PSDImage
    from psd_tools.constants import BlendMode

    height, width = frame.alpha.shape
    image = PSDImage.new("RGBA", (width, height), color=(255, 255, 255, 255))
    sheets = _on_background(frame, background)
    for sheet in sheets:
        layer = Image.open(io.BytesIO(_png(sheet.rgb, sheet.alpha))).convert("RGBA")
        image.create_pixel_layer(layer, name=sheet.name, blend_mode=BlendMode[_MODES[sheet.mix]])
    with replacing(path) as temporary:
        image.save(temporary)
    return len(sheets)


def _on_background(frame: Frame, background: Background) -> tuple[Sheet, ...]:
    """The layers over a background. A layer "light" adds what the layers, clipped to 1, lack."""
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


def _png(rgb: Array, alpha: Array) -> bytes:
    return encode_frame(Frame(rgb, alpha), ".png")


def _thumbnail(frame: Frame, background: Background) -> bytes:
    alpha = frame.alpha if background is None else np.ones_like(frame.alpha)
    rgb = frame.rgb if background is None else frame.over(background)
    pixels: Array = np.concatenate([rgb, alpha[..., None]], axis=2).clip(0, 1)
    height, width = alpha.shape
    scale = min(1.0, _THUMBNAIL_SIDE / max(height, width))
    pixels = resize(pixels, max(1, round(scale * width)), max(1, round(scale * height)))
    return _png(pixels[..., :3], pixels[..., 3])


def _stack_of(sheets: tuple[Sheet, ...], frame: Frame) -> bytes:
    """The XML list of layers, the topmost first."""
    height, width = frame.alpha.shape
    image = ElementTree.Element("image", version="0.0.5", w=str(width), h=str(height))
    stack = ElementTree.SubElement(image, "stack")
    for row, sheet in reversed(list(enumerate(sheets))):
        place = {"x": "0", "y": "0", "opacity": "1.0", "visibility": "visible"}
        source = {"name": sheet.name, "src": f"data/{row:02d}.png", "composite-op": f"svg:{sheet.mix}"}
        ElementTree.SubElement(stack, "layer", {**source, **place})
    text: bytes = ElementTree.tostring(image, encoding="UTF-8", xml_declaration=True)
    return text


def merged_picture(path: Path) -> bytes:
    """The merged picture of an OpenRaster file as PNG. Raises SceneError for another or a damaged file."""
    with open_zip(path) as archive:
        return _member(path, archive, _MERGED, _MAX_LAYER)


def read_layer(path: Path, name: str) -> F32 | None:
    """Read a layer by name (ignoring case), placed on the whole canvas; None if there is no such layer.

    Of several layers with that name, the topmost: [H, W, 4] display-encoded, 0 to 1, straight alpha times the
    opacity of the layer. Its blend mode is not read.

    Raises SceneError if the file, .ora or .psd, cannot be read, or psd-tools is missing for .psd.
    """
    return _of_psd(path, name) if path.suffix.lower() == ".psd" else _of_ora(path, name)


def _of_ora(path: Path, name: str) -> F32 | None:
    with open_zip(path) as archive:
        try:
            image = ElementTree.fromstring(_member(path, archive, _STACK, _MAX_STACK))
            width, height = int(image.get("w", "0")), int(image.get("h", "0"))
            layers = islice(image.iter("layer"), _MOST_LAYERS)  # the topmost first
            found = next((one for one in layers if _is(one.get("name"), name)), None)
            if found is None:
                return None
            source, place = found.get("src", ""), (int(found.get("x", "0")), int(found.get("y", "0")))
            opacity = float(found.get("opacity", "1"))
        except (ElementTree.ParseError, ValueError) as error:
            raise SceneError(path, f"is a damaged OpenRaster file ({error}); save it again") from None
        content = _member(path, archive, source, _MAX_LAYER)
    check_pixels(path, width, height, MAX_PIXELS)
    with on_disk(path, content, "layer.png", f"its layer {name!r}") as layer:
        pixels = read_image(layer)
    return _on_canvas(pixels, place, (width, height), opacity)


def _member(path: Path, archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """Read a member of an archive. Raises SceneError if missing, damaged or larger than `most` bytes."""
    lacks, cure = "is no OpenRaster file, or damaged; get it again", "save it again, smaller if that is why"
    return read_member(path, archive, name, most, lacks=lacks, cure=cure)


def _is(found: object, name: str) -> bool:
    return str(found).strip().casefold() == name.strip().casefold()


def _of_psd(path: Path, name: str) -> F32 | None:
    try:
        from psd_tools import PSDImage
    except ImportError:
        fact = "is a Photoshop file, which the package psd-tools reads"
        raise SceneError(path, f"{fact}; pip install 'brushgs[psd]', or save .ora") from None
    try:
        image = PSDImage.open(path)
        check_pixels(path, image.width, image.height, MAX_PIXELS)
        layers = [one for one in image.descendants() if not one.is_group() and _is(one.name, name)]
        if not layers:
            return None
        layer = layers[-1]  # listed from the bottom
        pixels = np.asarray(layer.numpy(), np.float32)
    except SceneError:
        raise
    except Exception as error:  # psd-tools raises many kinds
        why = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise SceneError(path, f"cannot be read as a Photoshop file ({why}); save it again") from None
    return _on_canvas(pixels, (layer.left, layer.top), (image.width, image.height), layer.opacity / 255)


def _on_canvas(pixels: F32, place: tuple[int, int], size: tuple[int, int], opacity: float) -> F32:
    """Place a layer [h, w, C] on a canvas [height, width, 4], multiplying alpha by `opacity`."""
    (left, top), (width, height) = place, size
    rgba = with_alpha(pixels)
    canvas = np.zeros((height, width, 4), np.float32)
    x, y = max(left, 0), max(top, 0)
    part = rgba[y - top : max(height - top, 0), x - left : max(width - left, 0)]
    canvas[y : y + part.shape[0], x : x + part.shape[1]] = part
    canvas[..., 3] *= min(max(opacity, 0.0), 1.0)
    return canvas


def with_alpha(pixels: F32 | F64) -> F32:
    """RGBA [H, W, 4] of pixels with 1 to 4 channels; opaque if there is no alpha."""
    has_alpha = pixels.shape[2] in (2, 4)
    colors = pixels[..., : pixels.shape[2] - has_alpha]
    rgb = np.broadcast_to(colors, (*pixels.shape[:2], 3))
    alpha = pixels[..., -1:] if has_alpha else np.ones((*pixels.shape[:2], 1))
    return np.concatenate([rgb, alpha], axis=2).astype(np.float32)
