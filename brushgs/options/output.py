"""What files of pictures hold beside the picture, and how videos are encoded."""

from typing import Annotated, ClassVar

from brushgs.options.choices import LAYERS, Codec
from brushgs.options.table import OF_FILES, OF_FILMS, Options, option

ALL_LAYERS = "all"
BITS = (8, 10, 16)


class OutputConfig(Options, frozen=True):
    """What is written of a picture."""

    GROUP: ClassVar = "output"
    ABOUT: ClassVar = "what the files hold"
    # fmt: off
    layers: Annotated[tuple[str, ...], option("what an EXR file holds beside the picture, with commas: "
        f"{', '.join(LAYERS)}, or all; `brushgs render --passes` explains them #passes #depth #normal #aov "
        "#exr", default="depth alone", metavar="NAMES")] = ()
    deep: Annotated[bool, option("a deep EXR file: in each pixel a sample for each stroke, with colour, "
        "alpha, depth and number #compositing")] = False
    codec: Annotated[Codec | None, option("how a video is encoded #video #quality #compression", default=
        "h264 for .mp4, prores (4444) for .mov, vp9 for .webm", not_in_memory=OF_FILMS)] = None
    bits: Annotated[int | None, option("bits of a channel: 8 or 16 of PNG and TIFF, 8 or 10 of AVIF and "
        "H.265 #depth #quality", default="8 of PNG and AVIF, 16 of TIFF, 10 of H.265", not_in_memory=OF_FILES
    )] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        known = (*LAYERS, ALL_LAYERS)
        if unknown := [name for name in self.layers if name not in known]:
            raise ValueError(f"layers must be names out of {', '.join(known)}, got {unknown[0]!r}")
        if self.bits is not None and self.bits not in BITS:
            raise ValueError(f"bits must be 8, 10 or 16, got {self.bits}")
        if self.deep and self.layers:
            raise ValueError("layers cannot be combined with deep, which is a file of its own; omit one")

    @property
    def all_layers(self) -> tuple[str, ...]:
        """The layers by name, in the order of the table."""
        return tuple(name for name in LAYERS if name in self.layers or ALL_LAYERS in self.layers)
