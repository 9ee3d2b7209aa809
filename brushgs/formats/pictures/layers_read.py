"""Read one layer of an OpenRaster or Photoshop file, as painting programs save them."""

import zipfile
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import scratch_folder
from brushgs.formats.pictures.images import MAX_PIXELS, check_pixels, read_image
from brushgs.formats.zip_file import ZIP_FAULTS, open_zip, why_not_read
from brushgs.values.arrays import F32, F64

_STACK, _MAX_STACK, _MAX_LAYER = "stack.xml", 1 << 20, 1 << 28  # bytes
MOST_LAYERS = 1000
LAYERED_READ = (".ora", ".psd")


def read_layer(path: Path, name: str) -> F32 | None:
    """The picture of a layer, in the size of the whole; None if no layer has that name, in any case.

    Args:
        path: .ora, or .psd, which needs psd-tools.
        name: of the layer; of several the uppermost.

    Returns:
        [H, W, 4] display-encoded, 0 to 1, straight alpha, times the opacity of the layer. How it mixes with
        others is not read.

    Raises:
        SceneError: if the file cannot be read; or, of .psd, without psd-tools.
    """
    return _of_psd(path, name) if path.suffix.lower() == ".psd" else _of_ora(path, name)


def _of_ora(path: Path, name: str) -> F32 | None:
    with open_zip(path) as archive:
        try:
            image = ElementTree.fromstring(_member(path, archive, _STACK, _MAX_STACK))
            width, height = int(image.get("w", "0")), int(image.get("h", "0"))
            found = next((one for one in _layers(image) if _is(one.get("name"), name)), None)
            if found is None:
                return None
            source, place = found.get("src", ""), (int(found.get("x", "0")), int(found.get("y", "0")))
            opacity = float(found.get("opacity", "1"))
        except (ElementTree.ParseError, ValueError) as error:
            raise SceneError(path, f"is a damaged OpenRaster file ({error}); save it again") from None
        content = _member(path, archive, source, _MAX_LAYER)
    check_pixels(path, width, height, MAX_PIXELS)
    with scratch_folder() as folder:
        (folder / "layer.png").write_bytes(content)
        try:
            pixels = read_image(folder / "layer.png")
        except SceneError as error:
            reason = str(error).removeprefix(f"{folder / 'layer.png'}: ")
            raise SceneError(path, f"its layer {name!r} {reason}") from None
    return _on_canvas(pixels, place, (width, height), opacity)


def _member(path: Path, archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """A file of an archive. Raises SceneError if it is missing, damaged or larger than `most` bytes."""
    try:
        member = archive.getinfo(name)
        if (why := why_not_read(member)) is not None:
            raise SceneError(path, f"its {name[:80]!r} {why}; save it again")
        if member.file_size > most:
            raise SceneError(path, f"its {name[:80]!r} is larger than {most >> 20} MiB; scale it down")
        with archive.open(member) as file:
            return file.read(most)
    except (KeyError, *ZIP_FAULTS) as error:
        raise SceneError(path, f"is no OpenRaster file, or damaged ({error}); save it again") from None


def _layers(image: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """The layers, the uppermost first."""
    for number, one in enumerate(image.iter("layer")):
        if number >= MOST_LAYERS:
            return
        yield one


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
        layer = layers[-1]  # they are listed from below
        pixels = np.asarray(layer.numpy(), np.float32)
    except SceneError:
        raise
    except Exception as error:  # psd-tools raises many kinds
        why = str(error).splitlines()[0][:80] if str(error) else type(error).__name__
        raise SceneError(path, f"cannot be read as a Photoshop file ({why}); save it again") from None
    return _on_canvas(pixels, (layer.left, layer.top), (image.width, image.height), layer.opacity / 255)


def _on_canvas(pixels: F32, place: tuple[int, int], size: tuple[int, int], opacity: float) -> F32:
    """A layer [h, w, C] at its place in the whole picture."""
    (left, top), (width, height) = place, size
    rgba = with_alpha(pixels)
    canvas = np.zeros((height, width, 4), np.float32)
    x, y = max(left, 0), max(top, 0)
    part = rgba[y - top : max(height - top, 0), x - left : max(width - left, 0)]
    canvas[y : y + part.shape[0], x : x + part.shape[1]] = part
    canvas[..., 3] *= min(max(opacity, 0.0), 1.0)
    return canvas


def with_alpha(pixels: F32 | F64) -> F32:
    """[H, W, 4] of 1 to 4 channels; opaque where there is no alpha."""
    has_alpha = pixels.shape[2] in (2, 4)
    colors = pixels[..., : pixels.shape[2] - has_alpha]
    rgb = np.broadcast_to(colors, (*pixels.shape[:2], 3))
    alpha = pixels[..., -1:] if has_alpha else np.ones((*pixels.shape[:2], 1))
    return np.concatenate([rgb, alpha], axis=2).astype(np.float32)
