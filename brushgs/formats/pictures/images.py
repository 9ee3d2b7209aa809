"""Read and write pictures with OpenImageIO, in the formats of `table.py`.

OpenImageIO has decoders for some twenty-five formats and chooses by suffix; brushgs allows those of the
table, chosen by content, and refuses costly pictures before they are decoded.

Within brushgs, pictures are display-encoded float32, 0 to 1. Files in linear light (EXR) are converted here.
OpenImageIO's premultiplication on reading (in 8 bits) is turned off, so straight colors are exact.
"""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, scratch_folder
from brushgs.formats.format import NUM_FIRST_BYTES, Format
from brushgs.formats.pictures.encoding import choose_encoding
from brushgs.formats.pictures.oiio import Background, Strips, first_line
from brushgs.formats.registry import PICTURE_SUFFIXES, PICTURES_READ, find_read, find_written, function_of
from brushgs.options.choices import FileSpace
from brushgs.values.arrays import F32, U8, Array, check
from brushgs.values.colors import srgb_from_linear
from brushgs.values.frame import Frame
from brushgs.values.shot import Shot

if TYPE_CHECKING:
    import OpenImageIO


MAX_PIXELS = 1 << 25  # slightly above 7680 x 4320: half a gigabyte as float RGBA


def check_pixels(path: Path, width: int, height: int, max_pixels: int) -> None:
    """Refuse a picture of more than `max_pixels` pixels. Raises SceneError."""
    if width * height > max_pixels:
        raise SceneError(path, f"must have at most {max_pixels} pixels, got {width}x{height}; scale it down")


def find_format(path: Path, max_pixels: int) -> Format:
    """The format of a picture, after the checks that must precede decoding.

    Raises SceneError if the plain file does not exist, has no known format, or would take too much memory or
    time.
    """
    with open_plain(path, "picture") as file:
        begin = file.read(NUM_FIRST_BYTES)
        picture_format = find_read("picture", path, begin)
        if picture_format is None:
            fact = f"cannot be read as a picture (it is not {PICTURES_READ})"
            raise SceneError(path, f"{fact}; convert it to PNG")
        if picture_format.read:
            function_of(picture_format.read)(path, file, max_pixels)
    return picture_format


@contextmanager
def suffixed(path: Path, picture_format: Format) -> Iterator[Path]:
    """A path to the file with the suffix of its format, so that OpenImageIO tries that decoder first."""
    if path.suffix.lower() in picture_format.suffixes:
        yield path
        return
    with scratch_folder() as folder:
        link = folder / f"picture{picture_format.suffixes[0]}"
        try:
            link.symlink_to(path.resolve())
        except OSError:  # Windows allows links only to privileged users
            shutil.copyfile(path, link)
        yield link


_MAX_CHANNELS = 4  # decoded at once for MAX_PIXELS; smaller pictures may have more
_MAX_LAYERED = 64  # total channels for MAX_PIXELS, if the decoder works on a few rows at a time
_NUM_ROWS = 64  # converted at a time


def read_image(path: str | Path, *, max_pixels: int | None = None) -> F32:
    """Read a picture in one of the formats of `PICTURES_READ`, detected by content, not by name.

    Needs some 20 bytes of memory per pixel. Of a file with several pictures the first is read.

    Args:
        path: the file.
        max_pixels: larger pictures are refused before decoding; None for `MAX_PIXELS`.

    Returns:
        [H, W, C] display-encoded values in 0 to 1 with straight (unassociated) alpha, upright; C is 1
        (grey), 2 (grey and alpha), 3 (RGB) or 4 (RGBA). Depth and other extra channels are skipped.

    Raises:
        SceneError: if the plain file does not exist, has no known format, is damaged or too large, or holds
            NaN or infinity.
    """
    path = Path(path)
    with _opened(path, MAX_PIXELS if max_pixels is None else max_pixels) as (source, picture_format):
        pixels = _display_encoded(path, source, is_linear=picture_format.is_linear)
        return _upright(pixels, source.spec())


def read_bytes(path: Path, max_pixels: int) -> U8:
    """The stored bytes [H, W, C] of an 8-bit picture, for pictures that encode numbers other than colors.

    Alpha is straight. Raises SceneError as `read_image` does, or if the picture has more bits per channel.
    """
    import OpenImageIO

    with _opened(path, max_pixels) as (source, _):
        spec = source.spec()
        if spec.format.basetype != OpenImageIO.UINT8:
            raise SceneError(path, f"must have 8 bits a channel, got {spec.format}; export it again")
        pixels = source.read_image(0, 0, 0, spec.nchannels, OpenImageIO.UINT8)
        if pixels is None:
            raise SceneError(path, f"is damaged ({first_line(source.geterror())}); get it again")
        return np.asarray(pixels)


@contextmanager
def _opened(path: Path, max_pixels: int) -> Iterator[tuple["OpenImageIO.ImageInput", Format]]:
    """Open a picture, check its header, yield it and its format. Raises SceneError as `read_image` does."""
    import OpenImageIO

    picture_format = find_format(path, max_pixels)
    straight = OpenImageIO.ImageSpec()
    straight.attribute("oiio:UnassociatedAlpha", 1)
    source = None
    with suffixed(path, picture_format) as named:
        try:
            source = OpenImageIO.ImageInput.open(str(named), straight)
            if source is None:
                reason = first_line(OpenImageIO.geterror())
                raise SceneError(path, f"cannot be read as a picture ({reason}); convert it to PNG")
            _check_spec(path, source.spec(), max_pixels)
            yield source, picture_format
        except UnicodeDecodeError:  # from a name in the file, or the message of the decoder
            raise SceneError(path, "is damaged (a text in it is not UTF-8); get it again") from None
        except MemoryError:
            raise SceneError(path, "takes more memory than there is; scale it down") from None
        finally:
            if source is not None:
                source.close()


def _check_spec(path: Path, spec: "OpenImageIO.ImageSpec", max_pixels: int) -> None:
    """Refuse a picture whose header says that it is not flat, is empty, or is too large to decode."""
    if spec.deep or spec.depth > 1:
        raise SceneError(path, "holds a volume or deep pixels; save it as a flat picture")
    check_pixels(path, spec.width, spec.height, max_pixels)
    if not all(number > 0 for number in (spec.width, spec.height, spec.nchannels)):
        raise SceneError(path, "holds no pixels; get it again")
    # Tiles are decoded completely, however small the picture is; EXR files without tiles in blocks of rows.
    num_rows = 0 if spec.tile_width else spec.get_int_attribute("oiio:RowsPerChunk")
    num_rows = min(max(num_rows, _NUM_ROWS), spec.height) if num_rows else spec.height
    at_once = max(spec.width * num_rows, spec.tile_width * spec.tile_height * max(spec.tile_depth, 1))
    in_all = spec.width * spec.height
    if spec.nchannels * max(at_once / _MAX_CHANNELS, in_all / _MAX_LAYERED) > max_pixels:
        fact = f"holds {spec.nchannels} channels in {spec.width}x{spec.height} pixels"
        tile = f"and tiles of {spec.tile_width}x{spec.tile_height}, which is too much"
        raise SceneError(path, f"{fact} {tile}; save it with its colors only")


def _display_encoded(path: Path, source: "OpenImageIO.ImageInput", *, is_linear: bool) -> F32:
    """Color and alpha as returned by `read_image`, converted a few rows at a time to save memory."""
    spec = source.spec()
    has_alpha = 0 <= spec.alpha_channel < spec.nchannels
    others = [i for i in range(spec.nchannels) if i not in (spec.alpha_channel, spec.z_channel)]
    chosen = others[:3] if len(others) >= 3 else others[:1]
    num_colors = len(chosen)
    if has_alpha:
        chosen.append(spec.alpha_channel)
    if not num_colors:
        raise SceneError(path, "holds no colors, only alpha or depth; save it with at least a grey channel")
    is_associated = has_alpha and not spec.get_int_attribute("oiio:UnassociatedAlpha")
    image = np.empty((spec.height, spec.width, len(chosen)), np.float32)
    space = _stated_space(spec) if is_linear and num_colors == 3 else None
    in_order = chosen == list(range(len(chosen)))
    kept = slice(len(chosen)) if in_order else chosen  # a list takes twenty times as long
    for start, pixels in _blocks(path, source, spec, max(chosen) + 1):
        if not (np.isfinite(pixels.min()) and np.isfinite(pixels.max())):
            raise SceneError(path, "holds NaN or infinity; write it again with finite values")
        rows = image[start : start + len(pixels)]
        rows[:] = pixels[..., kept]
        color, alpha = rows[..., :num_colors], rows[..., num_colors:]
        with np.errstate(over="ignore"):  # values above 1, clipped below
            if is_associated:
                color[:] = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
            if space is not None:
                from brushgs.formats.pictures.exr.planes import rec709_of

                color[:] = rec709_of(color, space)
            if is_linear:
                color[:] = srgb_from_linear(color)
        np.clip(rows, 0, 1, out=rows)
    return image


def _stated_space(spec: "OpenImageIO.ImageSpec") -> str | None:
    """The Color Interop Forum name of the color space in a header, if it is one that brushgs writes."""
    from brushgs.formats.pictures.exr.planes import SPACES

    found = spec.get_string_attribute("colorInteropID")
    return found if found in {space.interop_id for space in SPACES.values()} else None


def _blocks(
    path: Path, source: "OpenImageIO.ImageInput", spec: "OpenImageIO.ImageSpec", num_channels: int
) -> Iterator[tuple[int, F32]]:
    """Blocks of rows from the top: first row, and pixels [rows, W, num_channels] of the first channels.

    A picture with tiles is one block.
    """
    import OpenImageIO

    step = spec.height if spec.tile_width else _NUM_ROWS
    for start in range(0, spec.height, step):
        stop = min(start + step, spec.height)
        if spec.tile_width:
            pixels = source.read_image(0, 0, 0, num_channels, OpenImageIO.FLOAT)
        else:  # rows of a file may be numbered from any number
            place = spec.y + start, spec.y + stop, spec.z, 0, num_channels, OpenImageIO.FLOAT
            pixels = source.read_scanlines(0, 0, *place)
        if pixels is None:
            raise SceneError(path, f"is damaged ({first_line(source.geterror())}); get it again")
        yield start, pixels.reshape(stop - start, spec.width, num_channels)


def _upright(pixels: F32, spec: "OpenImageIO.ImageSpec") -> F32:
    """Rotate and mirror a picture by its Exif orientation, 1 to 8."""
    orientation = spec.get_int_attribute("Orientation", 1)
    if orientation in (5, 6, 7, 8):
        pixels = pixels.transpose(1, 0, 2)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


def write_frame(
    frame: Frame | Strips,
    path: str | Path,
    background: Background = None,
    *,
    bits: int | None = None,
    colorspace: FileSpace | None = None,
    shot: Shot | None = None,
) -> None:
    """Write a frame; the suffix decides the format: .png, .jpg, .webp, .avif, .tif or .exr.

    All but EXR are display-encoded, with straight alpha if there is no background. EXR holds linear light,
    premultiplied, always with alpha; the depth as channel Z if the frame has one, and the layers of the
    frame; see `brushgs.formats.pictures.exr`. Equal frames give equal bytes.

    Args:
        frame: the picture; may be in strips for a format that `takes_strips`.
        path: the name of the file; it appears when it is complete.
        background: None keeps the transparency; one RGB color or an [H, W, 3] array, display-encoded, is
            put behind the picture, which is then written without alpha (EXR: with alpha 1).
        bits: per channel: 8 or 16 for .png and .tif, 8 or 10 for .avif; None for the default of the format:
            16 for .tif and .exr (half float), 8 for the others.
        colorspace: of an EXR file; None for linear light with Rec. 709 primaries.
        shot: metadata: all formats but AVIF store how the picture was painted, EXR all of it.

    Raises:
        ValueError: if the suffix is none of the above, the background has another shape, it is None for a
            JPEG or an AVIF (which have no transparency), or the format does not offer `bits`.
        SceneError: if the file cannot be written.
    """
    picture_format = find_written("picture", path)
    if picture_format is None:
        rule = f"path must end in one of {', '.join(PICTURE_SUFFIXES)}"
        raise ValueError(f"write_frame: {rule}, got {str(path)!r}; change the suffix")
    bits = choose_encoding(path, bits=bits).bits
    options: dict[str, Any] = {"bits": bits} if len(picture_format.bits) > 1 else {}
    if picture_format.holds_metadata:
        options["shot"] = shot
    if picture_format.is_linear:
        options["colorspace"] = colorspace
    function_of(picture_format.write)(frame, path, background, **options)


def encode_frame(frame: Frame, suffix: str, background: Background = None, **options: Any) -> bytes:
    """Encode a frame as `write_frame` does, but in memory; `suffix` is one of `PICTURE_SUFFIXES`.

    Raises ValueError as that does, and SceneError if the folder for temporary files is full.
    """
    # OpenImageIO writes to named files only.
    with scratch_folder() as folder:
        path = folder / f"frame{suffix}"
        write_frame(frame, path, background, **options)
        return path.read_bytes()


Edges = Literal["mirror", "nearest"]  # boundary modes of SciPy


def resize(picture: Array, width: int, height: int, *, edges: Edges = "mirror") -> Array:
    """Resize by bilinear interpolation, with smoothing along a side that becomes smaller.

    A side reduced by a factor f is smoothed by a Gaussian with a standard deviation of (f - 1) / 2 pixels.
    Bit-identical to scikit-image's `transform.resize`, which uses the same functions of SciPy.

    Args:
        picture: [H, W, C] finite, H, W and C >= 1; else ValueError is raised.
        width: pixels, >= 1.
        height: pixels, >= 1.
        edges: beyond the picture: "mirror" reflects it about its outermost pixels, "nearest" repeats these.

    Returns:
        [height, width, C] in the dtype and within the range of the picture.
    """
    from scipy.ndimage import gaussian_filter, zoom

    sizes = check("resize", picture=(picture, "H W C"))
    factors = np.divide(picture.shape, (height, width, sizes["C"]))
    smooth = gaussian_filter(picture, np.maximum(0, (factors - 1) / 2), mode=edges)
    resized: Array = zoom(smooth, [1 / factor for factor in factors], order=1, mode=edges, grid_mode=True)
    return np.clip(resized, picture.min(), picture.max(), out=resized)
