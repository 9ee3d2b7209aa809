"""Write a painting as a Photoshop file with a layer for each part, by psd-tools.

Source: Adobe, Photoshop File Formats Specification. Layers have 8 bits a channel. Programs without layers
show what psd-tools makes of them all.
"""

import io
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.pictures.images import encode_frame
from brushgs.formats.pictures.oiio import Background
from brushgs.formats.pictures.ora import on_background
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame

_MODES = {"src-over": "NORMAL", "multiply": "MULTIPLY", "color-dodge": "COLOR_DODGE", "plus": "LINEAR_DODGE"}


def write_psd(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> int:
    """Write the layers of a frame; arguments and result as of `write_ora`.

    Args:
        frame: with its `sheets`.
        path: the name of the file; it appears when it is complete.
        background: as `write_frame` takes it; of transparent pictures the lowest layer.
        shot: not stored.

    Returns:
        The number of layers.

    Raises:
        SceneError: if the file cannot be written.
        ImportError: if psd-tools is not installed, see `check_encoding`.
    """
    from PIL import Image
    from psd_tools import PSDImage
    from psd_tools.constants import BlendMode

    def opened(one: Frame) -> Image.Image:
        return Image.open(io.BytesIO(encode_frame(one, ".png"))).convert("RGBA")

    height, width = frame.alpha.shape
    image = PSDImage.new("RGBA", (width, height), color=(255, 255, 255, 255))
    sheets = on_background(frame, background)
    for sheet in sheets:
        mode = BlendMode[_MODES[sheet.mix]]
        image.create_pixel_layer(opened(Frame(sheet.rgb, sheet.alpha)), name=sheet.name, blend_mode=mode)
    with replacing(path) as temporary:
        try:
            image.save(temporary)
        except OSError as error:
            raise SceneError(path, f"cannot be written ({error.strerror})") from None
    return len(sheets)
