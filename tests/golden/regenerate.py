"""Make golden pictures anew, from the float64 reference: `python -m tests.golden.regenerate NAME... | all`.

Look at the outcome before it is committed; it travels in a commit of its own.
"""

import sys
from dataclasses import replace

from brushgs.io.pictures.images import write_frame
from brushgs.rendering import reference
from brushgs.rendering.light import BLUR
from brushgs.scene import Frame
from tests.golden.cases import CASES, FOLDER, HEIGHT, WIDTH, Case


def frame_of(case: Case) -> Frame:
    """What the definition paints."""
    texture = case.texture
    boxes = case.boxes(texture.num_sigmas)
    size, look = {"width": WIDTH, "height": HEIGHT}, {"underpaint": case.underpaint, "streaks": case.streaks}
    if case.lamp is None:
        return reference.rasterize(boxes, texture, filter=case.filter, **size, **look)
    frame = reference.rasterize(boxes, texture, filter=case.filter, relief=True, **size, **look)
    return replace(
        frame, rgb=reference.light(frame.rgb, frame.height, case.lamp, alpha=frame.alpha, blur=BLUR)
    )


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
