"""Make golden pictures anew, from the float64 reference: `python -m tests.golden.regenerate NAME... | all`.

Look at the outcome before it is committed; it travels in a commit of its own.
"""

import sys
from dataclasses import replace

import numpy as np

from brushgs.formats.pictures.images import write_frame
from brushgs.rendering import reference
from brushgs.rendering.canvas import CARRIED
from brushgs.rendering.light import BLUR
from brushgs.rendering.rasterize import RasterOptions
from brushgs.values.frame import Frame
from tests.golden.cases import CASES, FOLDER, HEIGHT, WIDTH, Case


def frame_of(case: Case) -> Frame:
    """What the definition paints."""
    texture = case.texture
    boxes = case.boxes(texture.num_sigmas)
    size, look = {"width": WIDTH, "height": HEIGHT}, {"underpaint": case.underpaint, "streaks": case.streaks}
    look |= {"filter": case.filter, "blend": case.blend}
    frame = reference.rasterize(boxes, texture, RasterOptions(relief=case.lamp is not None, **size, **look))
    height = frame.height
    if case.surface is not None:
        surface = case.surface()
        if height is not None:
            height = height + (1 - CARRIED * frame.alpha) * surface.height
        if case.blend == "glaze":
            rgb = frame.rgb * surface.rgb
        else:
            rgb = frame.rgb + (1 - frame.alpha)[..., None] * surface.rgb
        frame = Frame(rgb, np.ones_like(frame.alpha))
    if case.lamp is None:
        return frame
    return replace(frame, rgb=reference.light(frame.rgb, height, case.lamp, alpha=frame.alpha, blur=BLUR))


def main() -> None:
    names = list(CASES) if sys.argv[1:] == ["all"] else sys.argv[1:]
    unknown = sorted(set(names) - set(CASES))
    if unknown or not names:
        sys.exit(
            f"regenerate: give names among {', '.join(CASES)}, or all; got {', '.join(unknown) or 'none'}"
        )
    for name in names:
        path = FOLDER / f"{name}.png"
        write_frame(frame_of(CASES[name]), path, CASES[name].background)
        print(f"{path} {path.stat().st_size / 1024:.1f} KiB")


if __name__ == "__main__":
    main()
