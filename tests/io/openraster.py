"""Reads OpenRaster by the text of the specification, and knows nothing of how it was written."""

import io
import zipfile
from xml.etree import ElementTree

import numpy as np
from PIL import Image


def layers_of(path):
    """Name, operation and pixels [H, W, 4] (straight, 0 to 1) of each layer, the lowest first."""
    with zipfile.ZipFile(path) as archive:
        first = archive.infolist()[0]
        assert (first.filename, first.compress_type, first.extra) == ("mimetype", zipfile.ZIP_STORED, b"")
        assert archive.read("mimetype") == b"image/openraster"
        image = ElementTree.fromstring(archive.read("stack.xml"))
        (stack,) = image
        found = []
        for layer in reversed(stack):
            assert (layer.tag, layer.get("x"), layer.get("y")) == ("layer", "0", "0")
            assert (layer.get("opacity"), layer.get("visibility")) == ("1.0", "visible")
            pixels = picture_in(archive, layer.get("src"))
            assert pixels.shape[:2] == (int(image.get("h")), int(image.get("w")))
            found.append((layer.get("name"), layer.get("composite-op"), pixels))
        return found


def picture_in(archive, name):
    with Image.open(io.BytesIO(archive.read(name))) as picture:
        return np.asarray(picture.convert("RGBA"), np.float64) / 255


def composite(layers):
    """[H, W, 4] premultiplied. Source: W3C, Compositing and Blending Level 1."""
    below = np.zeros_like(layers[0][2])
    for _, operation, pixels in layers:
        source, alpha = pixels[..., :3], pixels[..., 3:]
        back, back_alpha = below[..., :3], below[..., 3:]
        if operation == "svg:plus":
            below = np.minimum(np.append(source * alpha, alpha, axis=2) + below, 1)
            continue
        straight = np.divide(back, back_alpha, out=np.zeros_like(back), where=back_alpha > 0)
        mixed = _mixed(operation, straight, source)
        color = (1 - back_alpha) * source + back_alpha * mixed
        below = np.append(alpha * color, alpha, axis=2) + (1 - alpha) * below
    return below


def _mixed(operation, back, source):
    if operation == "svg:multiply":
        return back * source
    if operation == "svg:color-dodge":
        bright = np.minimum(1, back / np.maximum(1 - source, 1e-12))
        return np.where(back == 0, 0, bright)
    assert operation == "svg:src-over", operation
    return source
