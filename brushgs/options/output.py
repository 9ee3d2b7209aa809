"""What files of pictures hold beside the picture, and how videos are encoded."""

from dataclasses import dataclass
from typing import get_args

from brushgs.options.choices import LAYERS, Codec

ALL_LAYERS = "all"
BITS = (8, 10, 16)


@dataclass(frozen=True)
class OutputConfig:
    """What is written of a picture.

    Attributes:
        layers: names of `LAYERS` that an EXR file holds beside the picture, or "all".
        deep: whether an EXR file holds a sample for each stroke in each pixel, in place of the picture.
        codec: of videos; None for the usual one of the suffix.
        bits: of each channel, 8, 10 or 16; None for the usual number of the format.
    """

    layers: tuple[str, ...] = ()
    deep: bool = False
    codec: Codec | None = None
    bits: int | None = None

    def __post_init__(self) -> None:
        known = (*LAYERS, ALL_LAYERS)
        if unknown := [name for name in self.layers if name not in known]:
            raise ValueError(f"layers must be names out of {', '.join(known)}, got {unknown[0]!r}")
        if self.codec is not None and self.codec not in get_args(Codec):
            raise ValueError(f"codec must be one of {', '.join(get_args(Codec))}, got {self.codec!r}")
        if self.bits is not None and self.bits not in BITS:
            raise ValueError(f"bits must be 8, 10 or 16, got {self.bits}")
        if self.deep and self.layers:
            raise ValueError("layers cannot be combined with deep, which is a file of its own; omit one")

    @property
    def all_layers(self) -> tuple[str, ...]:
        """The layers by name, in the order of the table."""
        return tuple(name for name in LAYERS if name in self.layers or ALL_LAYERS in self.layers)
