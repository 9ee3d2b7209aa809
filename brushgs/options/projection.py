"""Options of pictures for headsets: all around the camera, and with one view for each eye."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from brushgs.options.output import ALL_LAYERS
from brushgs.options.table import Options, option

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig

Projection = Literal["perspective", "equirect"]
Stereo = Literal["side", "top", "vr180"]
SPHERE_SIZE, EYE_SIZE = (2048, 1024), (2048, 2048)  # of 360 degrees, and of one eye of 180
USUAL_SHARE = 1 / 30  # distance of the eyes over that of the subject: stereographers' rule of thumb
OF_EYES = ("depth", "normal", "motion", "uv", "height", "unlit")  # layers that may lie side by side
ON_SPHERES = ("paint", "charcoal")  # media whose faces meet without visible edges
OF_SPHERES = ("depth", "normal", "unlit")  # layers that may be resampled


class ProjectionConfig(Options, frozen=True):
    """The projection of pictures, and their number of eyes; see `brushgs.rendering.rigs`.

    `stereo` "vr180" has its own projection: each eye is a half sphere.
    """

    GROUP: ClassVar = "view"
    # fmt: off
    projection: Annotated[Projection, option("'perspective', or 'equirect': all 360 x 180 degrees around the "
        "camera, twice as wide as high (2048x1024 without --size) #360 #panorama #sphere #spherical #vr "
        "#headset")] = "perspective"
    stereo: Annotated[Stereo | None, option("one picture for each eye: 'side' by side (left eye first), "
        "'top' (left eye above), or 'vr180' (side by side, each eye 180 x 180 degrees); --size is that of "
        "one eye #3d #vr #vr180 #headset #stereoscopic", default="one eye")] = None
    ipd: Annotated[float | None, option("distance between the eyes, world units #eyes #depth #3d", gt=0,
        default="1/30 of the distance to the subject")] = None
    # fmt: on

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.projection == "equirect" and self.stereo in ("side", "top"):
            raise ValueError(
                f"stereo {self.stereo} cannot be combined with projection equirect: two fixed eyes have no "
                "depth to their sides; use stereo vr180"
            )
        if self.ipd is not None and self.stereo is None:
            raise ValueError("ipd needs stereo, the arrangement of the two eyes; add stereo side")

    @property
    def is_spherical(self) -> bool:
        """Whether a picture shows a whole sphere of directions, or a half sphere."""
        return self.projection == "equirect" or self.stereo == "vr180"

    @property
    def is_plain(self) -> bool:
        """Whether pictures are those of one pinhole camera."""
        return not self.is_spherical and self.stereo is None

    @property
    def usual_size(self) -> tuple[int, int] | None:
        """Default (width, height) of one eye in pixels; None if it is that of ordinary pictures."""
        if not self.is_spherical:
            return None
        return EYE_SIZE if self.stereo == "vr180" else SPHERE_SIZE

    @property
    def eyes_across(self) -> tuple[int, int]:
        """Number of eyes across and down in the picture."""
        return (1, 1) if self.stereo is None else (1, 2) if self.stereo == "top" else (2, 1)

    def whole_size(self, width: int, height: int) -> tuple[int, int]:
        """(width, height) of the picture of all eyes, from the size of one eye."""
        across, down = self.eyes_across
        return across * width, down * height

    def check_with(self, config: "PaintConfig") -> None:
        """Refuse options of a painting that suit one pinhole camera only.

        Raises:
            ValueError: names the option and the cure.
        """
        if config.view.fixed_size is not None:
            self._check_size(*config.view.fixed_size)
        if config.is_by_hand:
            raise ValueError(f"{self._flag} cannot be combined with hold, boil, redraw and smear; omit them")
        if config.output.deep:
            raise ValueError(f"{self._flag} cannot be combined with deep, the strokes of one camera; omit it")
        known = OF_SPHERES if self.is_spherical else OF_EYES
        for name in config.output.layers:
            if name not in known:
                cure = f"write {','.join(known)}" if name == ALL_LAYERS else "omit it"
                raise ValueError(
                    f"layers must be out of {', '.join(known)} with {self._flag}, got {name}; {cure}"
                )
        self._check_colors("background", config.draw.background)
        if self.is_spherical:
            self._check_colors("ground", config.ground.ground)
            self._check_lock(config.draw.lock)
            self._check_medium(config.media.kind)

    def _check_colors(self, name: str, value: str) -> None:
        if Path(value).is_file():
            raise ValueError(f"{name} must be a color with {self._flag}, got the picture {value}")

    def _check_medium(self, medium: str) -> None:
        """Refuse pens and wet paint, which are composed per picture and would show edges between faces."""
        if medium not in ON_SPHERES:
            raise ValueError(
                f"look must be in paint or charcoal with {self._flag}, got {medium}, whose pictures would "
                "show edges where they meet; use oil, impressionist, gouache, plain or charcoal"
            )

    def _check_lock(self, lock: str | None) -> None:
        if lock == "track":
            raise ValueError(
                f"lock track cannot be combined with {self._flag}: strokes are tracked in the picture of one "
                "camera; use canonical"
            )

    @property
    def _flag(self) -> str:
        if self.stereo is not None:
            return f"stereo {self.stereo}"
        return f"projection {self.projection}"

    def _check_size(self, width: int, height: int) -> None:
        """Check the aspect ratio of a size.

        Raises:
            ValueError: if a sphere is not twice as wide as high, or a half sphere not square.
        """
        if self.stereo == "vr180" and width != height:
            raise ValueError(
                f"size of an eye of stereo vr180 must be square such as {height}x{height}, got "
                f"{width}x{height}"
            )
        if self.is_spherical and self.stereo is None and width != 2 * height:
            raise ValueError(
                f"size of projection equirect must be twice as wide as high such as {2 * height}x{height}, "
                f"got {width}x{height}"
            )
