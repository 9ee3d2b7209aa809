"""Pictures in and out through OpenImageIO: PNG, TIFF, EXR; JPEG, WebP, BMP and HDR are read, too.

Inside brushgs pictures are display-encoded float32 in 0 to 1. Files that hold linear light (EXR) are
converted at this border. Left to itself OpenImageIO multiplies colour by alpha on reading, in 8 bits,
and divides on writing; here it is told not to, so that straight colours survive to the bit.
"""

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F32, Array
from brushgs.colors import linear_from_srgb, srgb_from_linear
from brushgs.errors import SceneError
from brushgs.io.files import replacing, unstopped
from brushgs.io.pictures.kind import check_pixels, picture_kind, suffixed
from brushgs.scene import Frame

if TYPE_CHECKING:
    import OpenImageIO

Background = Sequence[float] | Array | None

_FORMATS = {".png": "png", ".tif": "tiff", ".tiff": "tiff", ".exr": "openexr"}
_LINEAR_FORMATS = ("openexr", "hdr")
MAX_PIXELS = 1 << 25  # 7680 x 4320; as float RGBA they take half a gigabyte, larger ones are taken for a trap
_MAX_CHANNELS = 4  # at MAX_PIXELS; smaller pictures may have more
_ROWS = 64  # converted at a time
# Without a date of its own OpenImageIO writes the time of day into TIFF and EXR.
_NO_DATE = "0000:00:00 00:00:00"
# Renders of koala at 1280x720: a third to a half of the time of libpng's defaults (level 6, all
# filters), files at most 4 % larger. The filter predicts a pixel as the mean of its left and upper one.
_PNG_LEVEL = 4
_PNG_FILTER = 64
_ZIP_LEVEL = 2
_PNG_END = b"\0\0\0\0IEND\xaeB`\x82"  # the chunk that closes every PNG


def read_image(path: str | Path, *, max_pixels: int | None = None) -> F32:
    """Read a PNG, JPEG, TIFF, OpenEXR, WebP, BMP or Radiance HDR picture; its content decides, not its name.

    It takes some 20 bytes of memory a pixel. Of a file with several pictures the first is read.

    Args:
        path: the file.
        max_pixels: a larger picture is refused, by its header; None for `MAX_PIXELS`, 7680 x 4320 and a
            little more.

    Returns:
        [H, W, C] display-encoded values in 0 to 1 with straight (unassociated) alpha, upright; C is 1
        (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGBA). Depth and other extra channels are left out.

    Raises:
        SceneError: if there is no such plain file, it is no such picture, is damaged, holds values that are
            not finite, or is too large.
    """
    import OpenImageIO

    path = Path(path)
    max_pixels = MAX_PIXELS if max_pixels is None else max_pixels
    kind = picture_kind(path, max_pixels)
    straight = OpenImageIO.ImageSpec()
    straight.attribute("oiio:UnassociatedAlpha", 1)
    source = None
    with suffixed(path, kind) as named:
        try:
            source = OpenImageIO.ImageInput.open(str(named), straight)
            if source is None:
                reason = _reason(OpenImageIO.geterror())
                raise SceneError(path, f"cannot be read as a picture ({reason}); convert it to PNG")
            spec = source.spec()
            _check_spec(path, spec, max_pixels)
            return _upright(_display_encoded(path, source), spec)
        except UnicodeDecodeError:  # a name within the file, or the decoder's complaint about one
            raise SceneError(path, "is damaged (a text in it is not UTF-8); get it again") from None
        except MemoryError:
            raise SceneError(path, "takes more memory than there is; scale it down") from None
        finally:
            if source is not None:
                source.close()


def _check_spec(path: Path, spec: "OpenImageIO.ImageSpec", max_pixels: int) -> None:
    """Refuse by its header what is no flat picture, or too large to be decoded."""
    if spec.deep or spec.depth > 1:
        raise SceneError(path, "holds a volume or deep pixels; save it as a flat picture")
    check_pixels(path, spec.width, spec.height, max_pixels)
    if not all(number > 0 for number in (spec.width, spec.height, spec.nchannels)):
        raise SceneError(path, "holds no pixels; get it again")
    # Tiles are decoded whole, however small the picture is.
    side = max(spec.width * spec.height, spec.tile_width * spec.tile_height * max(spec.tile_depth, 1))
    if side * spec.nchannels > max_pixels * _MAX_CHANNELS:
        fact = f"holds {spec.nchannels} channels in {spec.width}x{spec.height} pixels and tiles of"
        tile = f"{spec.tile_width}x{spec.tile_height}, which is too much"
        raise SceneError(path, f"{fact} {tile}; save it with its colours only")


def _display_encoded(path: Path, source: "OpenImageIO.ImageInput") -> F32:
    """Colour and alpha as `read_image` returns them, some rows at a time: the rest of a file is not kept."""
    spec = source.spec()
    has_alpha = 0 <= spec.alpha_channel < spec.nchannels
    others = [i for i in range(spec.nchannels) if i not in (spec.alpha_channel, spec.z_channel)]
    chosen = others[:3] if len(others) >= 3 else others[:1]
    num_colors = len(chosen)
    if has_alpha:
        chosen.append(spec.alpha_channel)
    if not num_colors:
        raise SceneError(path, "holds no colours, only alpha or depth; save it with a grey channel, at least")
    is_associated = has_alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha")
    whole = np.empty((spec.height, spec.width, len(chosen)), np.float32)
    for start, pixels in _blocks(path, source, spec):
        if not (np.isfinite(pixels.min()) and np.isfinite(pixels.max())):
            raise SceneError(path, "holds NaN or infinity; write it again with finite values")
        rows = whole[start : start + len(pixels)]
        rows[:] = pixels[..., chosen]
        color, alpha = rows[..., :num_colors], rows[..., num_colors:]
        with np.errstate(over="ignore"):  # beyond white, and clipped below
            if is_associated:
                color[:] = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
            if source.format_name() in _LINEAR_FORMATS:
                color[:] = srgb_from_linear(color)
        np.clip(rows, 0, 1, out=rows)
    return whole


def _blocks(
    path: Path, source: "OpenImageIO.ImageInput", spec: "OpenImageIO.ImageSpec"
) -> Iterator[tuple[int, F32]]:
    """First row and pixels [rows, W, channels] of a picture, from the top; all at once where it has tiles."""
    import OpenImageIO

    step = spec.height if spec.tile_width else _ROWS
    for start in range(0, spec.height, step):
        stop = min(start + step, spec.height)
        if spec.tile_width:
            pixels = source.read_image(0, 0, 0, spec.nchannels, OpenImageIO.FLOAT)
        else:  # rows are counted from where the file has its first one
            place = spec.y + start, spec.y + stop, spec.z, 0, spec.nchannels, OpenImageIO.FLOAT
            pixels = source.read_scanlines(0, 0, *place)
        if pixels is None:
            raise SceneError(path, f"is damaged ({_reason(source.geterror())}); get it again")
        yield start, pixels.reshape(stop - start, spec.width, spec.nchannels)


def _upright(pixels: F32, spec: "OpenImageIO.ImageSpec") -> F32:
    """Turn a picture as its camera held it (Exif orientation 1 to 8)."""
    orientation = spec.get_int_attribute("Orientation", 1)
    if orientation in (5, 6, 7, 8):
        pixels = pixels.transpose(1, 0, 2)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def write_frame(frame: Frame, path: str | Path, background: Background = None) -> None:
    """Write a frame; the suffix decides: .png (8 bit), .tif, .tiff (16 bit), .exr (float).

    PNG and TIFF are display-encoded, with straight alpha if there is no background. EXR holds linear
    light, premultiplied as EXR asks for, and the depth as channel Z if the frame has one. Equal frames
    give equal bytes.

    Args:
        frame: the picture.
        path: the name of the file; it appears when it is complete.
        background: None keeps the transparency; one RGB colour or an [H, W, 3] array, display-encoded,
            is put behind the picture, which is then written without alpha.

    Raises:
        ValueError: if the suffix is none of the above or the background does not fit.
        SceneError: if the file cannot be written.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _FORMATS:
        known = ", ".join(_FORMATS)
        raise ValueError(
            f"write_frame: path must end in one of {known}, got {str(path)!r}; change the suffix"
        )
    if suffix == ".png" and background is not None:
        _write(path, _FORMATS[suffix], frame.bytes_over(background), ("R", "G", "B"))
        return
    straight = _straight(frame) if background is None else frame.over(background)
    if suffix == ".exr":
        _write(path, "openexr", *_exr_pixels(straight, frame, is_opaque=background is not None))
        return
    whole = (
        straight if background is not None else np.concatenate([straight, frame.alpha[..., None]], axis=-1)
    )
    dtype = np.uint8 if suffix == ".png" else np.uint16
    names = ("R", "G", "B", "A")[: whole.shape[-1]]
    _write(path, _FORMATS[suffix], quantise(whole, dtype), names)


def encode_frame(frame: Frame, suffix: str, background: Background = None) -> bytes:
    """The bytes of the file that `write_frame` would write, for whoever writes it elsewhere.

    Args:
        frame: the picture.
        suffix: ".png", ".tif", ".tiff" or ".exr".
        background: see `write_frame`.

    Raises:
        ValueError: see `write_frame`.
        SceneError: if the folder for temporary files is full.
    """
    # OpenImageIO writes to names only, so the file passes through the folder for temporary files.
    with tempfile.TemporaryDirectory(prefix="brushgs-") as folder:
        path = Path(folder) / f"frame{suffix}"
        write_frame(frame, path, background=background)
        return path.read_bytes()


def quantise(values: Array, dtype: type[np.unsignedinteger[Any]]) -> NDArray[np.unsignedinteger[Any]]:
    """Values 0 to 1 as whole numbers of the full range of `dtype`, halves rounded up, the rest clipped."""
    return np.asarray(np.clip(values, 0, 1) * np.iinfo(dtype).max + 0.5).astype(dtype)


def _straight(frame: Frame) -> Array:
    """[H, W, 3] colour not multiplied by alpha; 0 where nothing is painted."""
    alpha = frame.alpha[..., None]
    return np.divide(frame.rgb, alpha, out=np.zeros_like(frame.rgb), where=alpha > 0)


def _exr_pixels(straight: Array, frame: Frame, *, is_opaque: bool) -> tuple[F32, tuple[str, ...]]:
    """Linear light and what goes with it, and the names of the channels."""
    linear = linear_from_srgb(straight)
    if is_opaque:
        parts, names = [linear], ["R", "G", "B"]
    else:
        alpha = frame.alpha[..., None]
        parts, names = [linear * alpha, alpha], ["R", "G", "B", "A"]
    if frame.depth is not None:
        parts.append(frame.depth[..., None])
        names.append("Z")
    return np.concatenate(parts, axis=-1).astype(np.float32), tuple(names)


def _write(path: str | Path, format_name: str, pixels: NDArray[Any], names: tuple[str, ...]) -> None:
    """Write pixels as they are."""
    import OpenImageIO

    height, width, num_channels = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, num_channels, pixels.dtype.name.replace("float32", "float"))
    spec.channelnames = names
    spec.alpha_channel = names.index("A") if "A" in names else -1
    spec.z_channel = names.index("Z") if "Z" in names else -1
    if format_name != "openexr":
        spec.attribute("oiio:UnassociatedAlpha", 1)
    if format_name == "png":
        spec.attribute("png:compressionLevel", _PNG_LEVEL)
        spec.attribute("png:filter", _PNG_FILTER)
    else:
        spec.attribute("DateTime", _NO_DATE)
        spec.attribute("tiff:zipquality", _ZIP_LEVEL)
    out = OpenImageIO.ImageOutput.create(format_name)
    assert out is not None, "the formats offered are part of every build of OpenImageIO"
    with (
        unstopped(),
        replacing(path) as temporary,
    ):  # an encoder stopped in the middle complains to the terminal
        is_written = out.open(str(temporary), spec) and out.write_image(np.ascontiguousarray(pixels))
        if not (out.close() and is_written):
            raise SceneError(path, f"cannot be written ({_reason(out.geterror())}); check the disk")
        if format_name == "png" and temporary.read_bytes()[-len(_PNG_END) :] != _PNG_END:
            # On a full disk the PNG writer stops in the middle and reports success.
            raise SceneError(path, "cannot be written whole; check the space on the disk")


def _reason(text: str) -> str:
    """First line of a message of OpenImageIO."""
    return text.strip().splitlines()[0] if text.strip() else "no reason given"
