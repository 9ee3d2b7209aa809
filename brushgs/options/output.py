"""Contents of picture files beside the picture, and encoding of videos."""

import re
from typing import Annotated, ClassVar

from brushgs.options.choices import LAYERS, Codec, FileSpace
from brushgs.options.table import OF_FILES, OF_FILMS, Options, option

ALL_LAYERS = "all"
BITS = (8, 10, 16)
CROP_RULE = "must be X,Y,W,H in pixels, at least 0,0,1,1, such as 0,0,640,480"


def read_crop(text: str) -> tuple[int, int, int, int]:
    """Left, top, width and height of a text such as "0,0,640,480"."""
    match = re.fullmatch(r"([0-9]{1,9}),([0-9]{1,9}),([0-9]{1,9}),([0-9]{1,9})", text.replace(" ", ""))
    if match is None:
        raise ValueError(f"{CROP_RULE}, got {text!r}")
    left, top, width, height = map(int, match.groups())
    return left, top, width, height


class OutputConfig(Options, frozen=True):
    """Layers, depth and codec of output files."""

    GROUP: ClassVar = "output"
    ABOUT: ClassVar = "contents of the files"
    # fmt: off
    layers: Annotated[tuple[str, ...], option("further layers of an EXR file, separated by commas: "
        f"{', '.join(LAYERS)}, or all; `brushgs render --passes` explains them #passes #depth #normal #aov "
        "#exr", default="depth alone", metavar="NAMES")] = ()
    crop: Annotated[tuple[int, int, int, int] | None, option("paint only these pixels of the picture, as the "
        "cut of the whole: left, top, width and height, such as 0,0,640,480 #crop #region #part #tile "
        "#detail #zoom", metavar="X,Y,W,H", read=read_crop)] = None
    deep: Annotated[bool, option("write a deep EXR file: one sample per stroke in each pixel, with color, "
        "alpha, depth and stroke number #compositing")] = False
    colorspace: Annotated[FileSpace | None, option("color space of an EXR file: linear light with the "
        "primaries of sRGB, ACEScg, ACES2065-1, Rec. 2020 or P3 (D65), or srgb, display-encoded #aces #ocio "
        "#gamut #color #exr", default="lin_srgb for EXR, srgb for other files", not_in_memory=OF_FILES
    )] = None
    sidecar: Annotated[bool, option("also write FILE.json with command and camera, for `brushgs adopt`: "
        "other programs drop what is stored in the picture #metadata #camera", not_in_memory=OF_FILES
    )] = False
    codec: Annotated[Codec | None, option("video codec #video #quality #compression", default=
        "h264 for .mp4, prores (4444) for .mov, vp9 for .webm", not_in_memory=OF_FILMS)] = None
    bits: Annotated[int | None, option("bits per channel: 8 or 16 for PNG and TIFF, 8 or 10 for AVIF and "
        "H.265 #depth #quality", default="8 for PNG and AVIF, 16 for TIFF, 10 for H.265",
        not_in_memory=OF_FILES
    )] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.crop is not None and (min(self.crop[:2]) < 0 or min(self.crop[2:]) < 1):
            raise ValueError(f"crop {CROP_RULE}, got {','.join(map(str, self.crop))}")
        known = (*LAYERS, ALL_LAYERS)
        if unknown := [name for name in self.layers if name not in known]:
            raise ValueError(f"layers must be names out of {', '.join(known)}, got {unknown[0]!r}")
        if self.bits is not None and self.bits not in BITS:
            raise ValueError(f"bits must be 8, 10 or 16, got {self.bits}")
        if self.deep and self.layers:
            raise ValueError("layers cannot be combined with deep, which is a file of its own; omit one")
        if self.deep and self.colorspace not in (None, "srgb"):
            raise ValueError(
                "colorspace must be srgb or omitted with deep, whose samples are laid over each other "
                f"display-encoded, got {self.colorspace!r}"
            )

    @property
    def all_layers(self) -> tuple[str, ...]:
        """The layers by name, in the order of `LAYERS`."""
        return tuple(name for name in LAYERS if name in self.layers or ALL_LAYERS in self.layers)
