"""Options of hand-made films: held drawings, boiling lines, and strokes that are painted again."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal, get_args

from brushgs.options.table import OF_FILMS, Options, option, share

Wave = Literal["left", "right", "top", "bottom", "center", "near", "far"]
WAVES: tuple[Wave, ...] = get_args(Wave)
MAX_HOLD = 24  # frames: a second of film
MAX_REDRAW = 4.0  # times a second; more looks like boil


def _origin(text: str) -> Path:
    """Parse the origin of a wave: one of `WAVES`, or a picture."""
    if not text.strip():
        raise ValueError(f"must be {', '.join(WAVES)} or a picture, got an empty name")
    return Path("center" if text == "center" else text)


class HandConfig(Options, frozen=True):
    """Unsteadiness of a film; the defaults have none. See `brushgs.rendering.hand`.

    With `redraw_from` None, each stroke is redrawn at a time of its own.
    """

    GROUP: ClassVar = "films made by hand"
    ABOUT: ClassVar = "unsteadiness on request, for films; a part of the scene may have its own, see --rules"
    NOT_IN_MEMORY: ClassVar = OF_FILMS
    # fmt: off
    hold: Annotated[int, option("frames for which a drawing is held, 2 for 'on twos': strokes keep size, "
        "direction, brush, color and order, and move with the scene #stepped #animation #twos", ge=1,
        le=MAX_HOLD, unit="frames")] = 1
    hold_camera: Annotated[bool, option("hold the camera and the scene as well: held frames are equal")
        ] = False
    boil: Annotated[float, share("by how much strokes are drawn anew every few frames: 0.3 is alive, 0.55 "
        "made by hand, 0.8 ragged #wobble #jitter #line #alive")] = 0.0
    boil_every: Annotated[int, option("frames from one such drawing to the next, whole holds", ge=1, le=240,
        unit="frames")] = 3
    redraw: Annotated[float, option("share of the painted area that is laid anew in a second, large strokes "
        "seldom #repaint #living", ge=0, le=MAX_REDRAW)] = 0.0
    redraw_from: Annotated[Path | None, option("where that begins and spreads from, as a wave: "
        f"{', '.join(WAVES)}, or a picture in the place of the first frame, dark first #wave", default="each "
        "stroke has its own time", metavar="PLACE|FILE", read=_origin)] = None
    smear: Annotated[float, share("how far strokes that move fast in the picture trail behind, up to three "
        "times as long and thinner #blur #speed #motion #fast")] = 0.0
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.hold_camera and self.hold == 1:
            raise ValueError("hold-camera needs hold, the frames for which it is held; add hold 2")

    @property
    def files(self) -> tuple[Path, ...]:
        """The picture of `redraw_from`, if it is one."""
        is_file = self.redraw_from is not None and str(self.redraw_from) not in WAVES
        return (self.redraw_from,) if is_file and self.redraw_from is not None else ()


class Pace(Options, frozen=True):
    """The values of `HandConfig` for one part of a scene."""

    hold: int = 1
    boil: float = 0.0
    redraw: float = 0.0


STEADY = Pace()
