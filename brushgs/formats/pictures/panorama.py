"""Tags of spherical and stereo pictures and videos, for players and headsets.

JPEG and PNG get the XMP tags of Google's Photo Sphere, OpenEXR its attribute for latitude-longitude maps,
MP4 and QuickTime the boxes of Spherical Video V2, Matroska and WebM only the stereo layout.
Sources: Photo Sphere XMP Metadata (developers.google.com/streetview/spherical-metadata); Spherical Video V2
RFC (github.com/google/spatial-media); ISO/IEC 14496-12.
"""

import mmap
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from brushgs.formats.files import replacing
from brushgs.values.shot import Panorama

_SPACE = "http://ns.google.com/photos/1.0/panorama/"
_ENTRY_HEAD = 86  # bytes of a video sample entry before its boxes
_CONTAINERS = (b"moov", b"trak", b"mdia", b"minf", b"stbl")
_STEREO_MODES = {None: 0, "top": 1, "side": 2}
MATROSKA_MODES = {"side": "left_right", "top": "top_bottom"}


def panorama_tags(panorama: Panorama, width: int, height: int) -> dict[str, Any]:
    """The tags of a picture, as attributes of OpenImageIO; empty if it is no Photo Sphere."""
    if not panorama.is_photo_sphere:
        return {}
    named: dict[str, Any] = {"ProjectionType": "equirectangular", "UsePanoramaViewer": "True"}
    named |= {"CroppedAreaImageWidthPixels": width, "CroppedAreaImageHeightPixels": height}
    named |= {"FullPanoWidthPixels": width, "FullPanoHeightPixels": height}
    named |= {"CroppedAreaLeftPixels": 0, "CroppedAreaTopPixels": 0}
    return {f"GPano:{name}": value for name, value in named.items()}


def panorama_packet(panorama: Panorama, width: int, height: int) -> bytes:
    """The tags as an XMP packet, for a PNG; empty if there are none."""
    if not (tags := panorama_tags(panorama, width, height)):
        return b""
    words = " ".join(f'{name}="{value}"' for name, value in tags.items())
    return (
        '<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?><x:xmpmeta xmlns:x="adobe:ns:meta/">'
        '<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description rdf:about="" '
        f'xmlns:GPano="{_SPACE}" {words}/></rdf:RDF></x:xmpmeta><?xpacket end="r"?>'
    ).encode()


def _video_boxes(panorama: Panorama) -> bytes:
    """The boxes to insert into the sample entry of a video."""
    boxes = b""
    if panorama.eyes is not None or panorama.degrees is not None:
        boxes += _box(b"st3d", bytes(4) + bytes([_STEREO_MODES[panorama.eyes]]))
    if panorama.degrees is not None:
        cut = 1 << 30 if panorama.degrees == 180 else 0  # a quarter of the sphere, in units of 2^-32
        pose = _box(b"prhd", bytes(4) + struct.pack(">iii", 0, 0, 0))
        bounds = _box(b"equi", bytes(4) + struct.pack(">IIII", 0, 0, cut, cut))
        source = _box(b"svhd", bytes(4) + b"brushgs\0")
        boxes += _box(b"sv3d", source + _box(b"proj", pose + bounds))
    return boxes


def mark_video(path: Path, panorama: Panorama) -> None:
    """Insert the boxes into an MP4 or QuickTime file, and correct the chunk offsets of frames behind them.

    libav can write the boxes only from side data, which PyAV cannot set.

    Raises ValueError if the file has no video, or its index is damaged.
    """
    if not path.stat().st_size:
        raise ValueError("mark_video: the file must have a video, but is empty")
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as whole:
        boxes = _children(whole, 0, len(whole))
        start, end = next(((first, last) for kind, first, last in boxes if kind == b"moov"), (0, 0))
        if not end:
            raise ValueError("mark_video: the file must have a box 'moov', got none")
        index = _with_boxes(whole[start:end], _video_boxes(panorama), start)
        with replacing(path) as marked, marked.open("wb") as other, memoryview(whole) as content:
            other.writelines([content[:start], index, content[end:]])


def _box(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", 8 + len(content)) + kind + content


def _children(content: bytearray | mmap.mmap, start: int, end: int) -> Iterator[tuple[bytes, int, int]]:
    """Kind, start and end of each box between two offsets. Raises ValueError if a box exceeds them."""
    while start + 8 <= end:
        length, kind = struct.unpack_from(">I4s", content, start)
        if length == 1 and start + 16 <= end:  # of more than 4 GiB
            (length,) = struct.unpack_from(">Q", content, start + 8)
        if not 8 <= length <= end - start:
            raise ValueError(f"mark_video: boxes must lie in each other, got {kind!r} of {length} bytes")
        yield kind, start, start + length
        start += length


def _with_boxes(index: bytes, boxes: bytes, start: int) -> bytes:
    """The box "moov", at offset `start` of a file, with `boxes` inserted into its video sample entry."""
    content = bytearray(index)
    if (path := _way_to_entry(content, 0, len(content))) is None:
        raise ValueError("mark_video: the file must have a video, got none")
    _shift_offsets(content, 8, len(index), len(boxes), start)
    for at in path:
        struct.pack_into(">I", content, at, struct.unpack_from(">I", content, at)[0] + len(boxes))
    place = path[-1] + _ENTRY_HEAD
    return bytes(content[:place] + boxes + content[place:])


def _way_to_entry(content: bytearray, start: int, end: int) -> list[int] | None:
    """Offsets of the nested boxes down to the video sample entry; None if there is none."""
    for kind, first, last in _children(content, start, end):
        if kind in _CONTAINERS:
            is_other = kind == b"mdia" and b"vide" not in content[first:last]
            way = None if is_other else _way_to_entry(content, first + 8, last)
            if way is not None:
                return [first, *way]
        elif kind == b"stsd":
            return [first, first + 16]
    return None


def _shift_offsets(content: bytearray, start: int, end: int, shift: int, after: int) -> None:
    """Add `shift` to the chunk offsets of frames behind `after` in the file."""
    for kind, first, last in _children(content, start, end):
        if kind in _CONTAINERS:
            _shift_offsets(content, first + 8, last, shift, after)
        elif kind in (b"stco", b"co64"):
            letter = "I" if kind == b"stco" else "Q"
            count = struct.unpack_from(">I", content, first + 12)[0]
            places = struct.unpack_from(f">{count}{letter}", content, first + 16)
            moved = [place + shift if place > after else place for place in places]
            struct.pack_into(f">{count}{letter}", content, first + 16, *moved)
