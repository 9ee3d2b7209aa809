"""The layers of a frame as channels of an OpenEXR file: names, signs and precision that compositors expect.

Names have one dot at most: Nuke parts them there into layer and channel. Axes are those of compositing
programs: x right, y up, z toward the camera, where brushgs has y down and z forward.
"""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

import numpy as np

from brushgs.formats.pictures.oiio import Background, straight_colors
from brushgs.values.arrays import F32, Array
from brushgs.values.colors import linear_from_srgb
from brushgs.values.frame import Frame
from brushgs.values.layers import Matte

LARGEST_HALF = 65504.0  # larger numbers become infinite
# Layer of the file -> what its numbers mean: the header holds it, as "brushgs/LAYER".
NOTES: Mapping[str, str] = {
    "RGBA": "linear light, Rec. 709 primaries, premultiplied; strokes were blended display-encoded (sRGB), "
    "so layers that are laid over each other in linear light differ from this picture",
    "Z": "camera z in world units, the mean of the strokes by what each shows; 0 where nothing is painted",
    "N": "direction that the strokes face, unit vectors; camera axes x right, y up, z toward the camera",
    "forward": "motion to the next frame in pixels, u right, v up; not premultiplied",
    "stroke": "place on the stroke that shows most: u along it, v across it from its upper edge, 0 to 1",
    "height": "how high the paint stands, pixels",
    "unlit": "the picture before the lamp shines on it, otherwise like R G B A",
    "paint": "how much of the pixel is painted; the background takes the rest",
}


Rows = Callable[[slice], Array]  # takes a slice of rows and gives the values there


class Plane(NamedTuple):
    """One channel.

    Attributes:
        name: in the file.
        kind: "half" where 11 bits are enough.
        rows: gives [rows, W], or what spreads to that: large ones are made as they are written.
    """

    name: str
    kind: Literal["half", "float"]
    rows: Rows

    @property
    def layer(self) -> str:
        """The key of its note in `NOTES`."""
        return self.name.split(".")[0] if "." in self.name or self.name == "Z" else "RGBA"


def planes_of(frame: Frame, background: Background) -> list[Plane]:
    """The channels of a frame but for its mattes, the picture first.

    Args:
        frame: the picture.
        background: that it stands on; see `write_frame`.
    """
    planes = _planes("{}", "RGBA", "half", _light(frame, background))
    depth = _values(frame, "depth") if frame.depth is None else frame.depth
    if depth is not None:
        planes += _planes("{}", "Z", "float", depth[..., None])
    if (normal := _values(frame, "normal")) is not None:
        planes += _planes("N.{}", "XYZ", "half", normal * np.array((1, -1, -1), np.float32))
    if (motion := _values(frame, "motion")) is not None:
        planes += _planes("forward.{}", "uv", "float", motion * np.array((1, -1), np.float32))
    if (uv := _values(frame, "uv")) is not None:
        planes += _planes("stroke.{}", "uv", "half", uv)
    if (height := _values(frame, "height")) is not None:
        planes += _planes("height.{}", "Y", "half", height[..., None])
    if (unlit := _values(frame, "unlit")) is not None:
        bare = Frame(unlit[..., :3], unlit[..., 3])
        planes += _planes("unlit.{}", "RGBA", "half", _light(bare, background))
    paint = _values(frame, "paint")
    if paint is None and frame.layers and background is not None:
        paint = frame.alpha
    if paint is not None:
        planes += _planes("paint.{}", "A", "half", paint[..., None])
    return planes


def _values(frame: Frame, name: str) -> Array | None:
    layer = frame.layers.get(name)
    return None if layer is None or isinstance(layer, Matte) else layer


def _light(frame: Frame, background: Background) -> F32:
    """[H, W, 4] linear light and alpha, premultiplied; alpha is 1 on a background."""
    if background is not None:
        light = linear_from_srgb(frame.over(background))
        return np.concatenate([light, np.ones_like(light[..., :1])], axis=-1, dtype=np.float32)
    alpha = frame.alpha[..., None]
    return np.concatenate([linear_from_srgb(straight_colors(frame)) * alpha, alpha], -1, dtype=np.float32)


def _planes(pattern: str, letters: str, kind: Literal["half", "float"], values: Array) -> list[Plane]:
    """A plane for each channel of [H, W, channels]."""
    return [
        Plane(pattern.format(letter), kind, lambda rows, i=i: values[rows, :, i])  # type: ignore[misc]
        for i, letter in enumerate(letters)
    ]
