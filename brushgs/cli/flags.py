"""Groups of flags that several commands share.

A flag is defined once: its name, type, range, help and the field of the configuration that it fills. `given`
returns the fields of one step that were set on the command line, so that no second list of names is needed.
Defaults are those of the config classes in `brushgs.options`; names of file formats come from the tables of
`brushgs.io`. Only the standard library is imported.
"""

import argparse
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import Any, get_args

from brushgs.cli import values
from brushgs.io.cameras.formats import BESIDE_READ, CAMERAS_READ
from brushgs.io.formats import in_words
from brushgs.io.moving.formats import MOVING_READ
from brushgs.io.pictures.formats import PICTURES_READ
from brushgs.io.scenes.formats import SCENE_SUFFIXES, SCENES_READ
from brushgs.options.choices import (
    COLORS,
    DEFAULT_BACKDROP,
    DEFAULT_LOOK,
    LAYERS,
    LOOKS,
    METHODS,
    MOMENTS_PER_SECOND,
    PLAIN_LOOK,
    REPORT_SUFFIXES,
    STYLE_SUFFIX,
    Canvas,
    Clean,
    Codec,
    ColorSpace,
    Extent,
    Features,
    Filter,
    Merge,
    Order,
    See,
    Side,
    StrokesFor,
    Weight,
)

Container = ArgumentParser | argparse._ArgumentGroup
BESIDE_GIVES = f"up and the first view, if they fit it: {BESIDE_READ}, in its folder or the one above"


class ConfigFlags:
    """Adds flags that fill the fields of one step of the configuration, such as "draw" or "path".

    The value of a flag is stored in the namespace as "STEP.FIELD", and only if the flag is given.
    """

    def __init__(self, container: Container, step: str) -> None:
        self._container = container
        self._step = step

    def add(self, flag: str, *, field: str | None = None, **options: Any) -> None:
        """Add a flag; `field` is the one it fills where the names differ, `options` are argparse's."""
        name = flag.removeprefix("--").replace("-", "_")
        if "action" not in options and "choices" not in options:
            options.setdefault("metavar", name.upper())
        dest = f"{self._step}.{field or name}"
        self._container.add_argument(flag, dest=dest, default=argparse.SUPPRESS, **options)


class Fields(argparse.Action):
    """A flag whose value is several fields of a step, by name."""

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Store the fields."""
        step, _, _ = self.dest.partition(".")
        for name, value in values.items():
            setattr(namespace, f"{step}.{name}", value)


class CameraFile(argparse.Action):
    """A file of cameras; "none" in its place makes `args.seeks_cameras` False, see `SceneSource`."""

    def __call__(self, parser: Any, namespace: Namespace, values: Any, option_string: Any = None) -> None:
        """Store the file, or that there is none, also beside the scene."""
        namespace.seeks_cameras = isinstance(values, Path)
        if isinstance(values, Path):
            setattr(namespace, self.dest, values)
        elif hasattr(namespace, self.dest):
            delattr(namespace, self.dest)


def add_no_cameras(container: Container) -> None:
    """`args.seeks_cameras` of a command that takes no camera file."""
    container.add_argument(
        "--camera-file",
        default=argparse.SUPPRESS,
        action=CameraFile,
        choices=("none",),
        help=f"passes over cameras that lie beside the scene; by default these give {BESIDE_GIVES}",
    )


def given(args: Namespace, step: str) -> dict[str, Any]:
    """The fields of one step that were set on the command line."""
    prefix = f"{step}."
    return {name.removeprefix(prefix): value for name, value in vars(args).items() if name.startswith(prefix)}


def add_scene(parser: ArgumentParser) -> None:
    """The scene that a command reads: `args.scene`, a list of paths, `args.lod`, and those of `add_time`."""
    parser.add_argument(
        "scene",
        type=Path,
        nargs="+",
        help=f"trained 3D Gaussian scene: {SCENES_READ}; or a moving one: {MOVING_READ}; several files, a "
        "folder of them, or a pattern in quotes, are one scene, or the moments of a moving one if they are "
        "numbered so",
    )
    parser.add_argument(
        "--lod",
        type=values.count_from(0),
        metavar="N",
        help="level of detail of a scene that has several, from 0, the finest; default chosen by its size",
    )
    add_time(parser)


def add_time(container: Container) -> None:
    """The moment of a moving scene: `args.time`; and the rate of its files: `args.moments_per_second`."""
    container.add_argument(
        "--time",
        type=values.scene_time,
        metavar="S|PERCENT|all",
        help="moment of a moving scene, in seconds or as a share of its duration such as 40%%; 'all' takes "
        "numbered files for one scene at rest; default the first moment",
    )
    container.add_argument(
        "--moments-per-second",
        type=values.number,
        metavar="RATE",
        help="rate of numbered files that are the moments of a moving scene, above 0, default "
        f"{MOMENTS_PER_SECOND:g}: each is seen for 1/RATE of a second; other scenes have none",
    )


def add_scene_output(parser: ArgumentParser, ending: str, *, has_moments: bool = False) -> None:
    """The scene file that a command writes: `args.output`, None for the default.

    Args:
        parser: gets the flag.
        ending: of the default name.
        has_moments: whether a moving scene gets a folder of files, one a moment. A name that ends in a slash
            is a folder, so it stays text.
    """
    suffixes, default = ", ".join(SCENE_SUFFIXES), f"SCENE-{ending}"
    folder = f"; of a moving scene a folder of such files, one a moment, default {default}/"
    parser.add_argument(
        "-o",
        "--output",
        type=str if has_moments else Path,
        metavar="FILE",
        help=f"scene file ({suffixes}), default {default}{SCENE_SUFFIXES[0]} in the current folder"
        + (folder if has_moments else ""),
    )


def add_experiment_output(parser: ArgumentParser, name: str, *, is_main: bool = True) -> None:
    """Where a command that measures writes its figures and its plot: `args.report`, and `args.no_plot`.

    Args:
        parser: gets the flags.
        name: of the command, which its files bear.
        is_main: whether the report is the output of the command (-o), or written only on demand (--report).
    """
    suffixes = REPORT_SUFFIXES[name]
    files = in_words([f"{name}{suffix}" for suffix in suffixes], "and")
    default = f"SCENE-{name} in the current folder" if is_main else "none"
    parser.add_argument(
        *(("-o", "--output") if is_main else ("--report",)),
        dest="report",
        type=Path,
        metavar="FOLDER|FILE",
        help=f"folder for {files}, default {default}; or a single file, {in_words(suffixes)}",
    )
    parser.add_argument(
        "--no-plot",
        action="store_true",
        help=f"skip {name}.png, which is skipped with a note where matplotlib is not installed",
    )


def add_painting(parser: ArgumentParser, *, size: str = "1280x720") -> None:
    """All that decides what one picture of a scene shows; `size` is the default of that in words."""
    add_look(parser)
    add_draw(parser, has_look=True)
    add_prune(parser)
    add_strokes_for(add_cluster(parser, has_look=True))
    add_stroke_passes(parser)
    add_palette(parser)
    add_style(parser)
    add_rules(parser)
    add_where(parser, "what is painted; the rest is shown as it is", has_camera_file=True, step="painted")
    add_view(parser, size=size)


def add_output(parser: ArgumentParser) -> Container:
    """`OutputConfig`; returns its group."""
    group = parser.add_argument_group("output", "what the files hold")
    flags = ConfigFlags(group, "output")
    flags.add(
        "--layers",
        type=values.words,
        metavar="NAMES",
        help=f"what an EXR file holds beside the picture, with commas: {', '.join(LAYERS)}, or all; `brushgs "
        "render --passes` explains them; default depth alone",
    )
    flags.add(
        "--deep",
        action="store_true",
        help="a deep EXR file: in each pixel a sample for each stroke, with colour, alpha, depth and number",
    )
    flags.add(
        "--codec",
        choices=get_args(Codec),
        help="how a video is encoded; default h264 for .mp4, prores (4444) for .mov, vp9 for .webm",
    )
    flags.add(
        "--bits",
        type=values.count_from(1),
        metavar="N",
        help="bits of a channel: 8 or 16 of PNG (default 8) and TIFF (default 16), 8 or 10 of AVIF (default "
        "8) and H.265 (default 10)",
    )
    return group


def add_workers(flags: ConfigFlags, scheduler: str) -> None:
    """`SequenceConfig` of what runs on other machines; `scheduler` is its help."""
    flags.add("--scheduler", metavar="ADDRESS", help=f"{scheduler}; default this machine")
    flags.add(
        "--workers-timeout",
        type=values.number,
        metavar="SECONDS",
        help="seconds to wait where the scheduler has no worker, above 0, default 60",
    )


def add_report(parser: ArgumentParser) -> None:
    """How a command reports what it did."""
    group = parser.add_argument_group("report")
    group.add_argument(
        "--json", action="store_true", help="print the report as JSON on stdout, not as a table"
    )
    amount = group.add_mutually_exclusive_group()
    amount.add_argument("--quiet", action="store_true", help="print errors only: no table, progress or path")
    amount.add_argument("--verbose", action="store_true", help="print all stages in the table, with details")


def add_look(parser: ArgumentParser, *, usual: str = DEFAULT_LOOK) -> None:
    """The look, `args.look`, and the parts of it that no other group has; `usual` is painted without it."""
    default = f"{usual} ({PLAIN_LOOK} with --preset paper and --stroke gaussian)"
    if usual == PLAIN_LOOK:
        parser.set_defaults(usual_look=usual)
        default = usual
    group = parser.add_argument_group(
        "look",
        "a sensible whole of brushes, strokes, colour, ground and light; every flag overrides its part",
    )
    group.add_argument(
        "--look",
        metavar="NAME|FILE",
        help=f"{in_words(LOOKS, 'or')}, the bare method; or a file of your own (`brushgs looks` lists them, "
        f"`brushgs looks {DEFAULT_LOOK} > mine.toml` gives one to change); where other flags say 'default', "
        f"a look may say otherwise; default {default}",
    )
    add_ground(group)
    add_color(group)
    add_light(group)


def add_ground(container: Container) -> None:
    """`GroundConfig`."""
    ground = ConfigFlags(container, "ground")
    ground.add(
        "--ground",
        metavar="NAME|COLOR|FILE",
        help="what the canvas is toned with: 'toned', the complement of the scene's colours, 'canvas', "
        "'paper', a colour as of --background, an image file, or 'none' for the background; default that of "
        "the look",
    )
    ground.add(
        "--backdrop",
        type=values.backdrop,
        metavar="stage|loose|on|off|N",
        help="what stands around an object: 'stage', a table, a wall and its shadow; 'loose', strokes in the "
        f"air, of the number of the look or {DEFAULT_BACKDROP}, or N of them; 'on' is that of the look also "
        "around scenes that fill the picture; default that of the look, and none where a scene has "
        "surroundings of its own",
    )
    ground.add(
        "--stage-tone",
        metavar="auto|light|dark|COLORS",
        help="lightness of the wall of a stage, or the colours of table and wall, as '#7a6a58,#9aa4b0'; "
        "default auto: the outline of the subject reads",
    )
    ground.add(
        "--shadow",
        type=values.share,
        metavar="SHARE",
        help="strength of the shadow on a stage, 0 to 1; default that of the look",
    )


def add_color(container: Container) -> None:
    """`ColorConfig`."""
    color = ConfigFlags(container, "color")
    color.add(
        "--pigments",
        type=values.count_from(0),
        metavar="N",
        help="number of colours that paint is mixed of, 2 to 256, or 0 for any; default that of the look",
    )
    color.add(
        "--chroma",
        type=values.number,
        metavar="FACTOR",
        help="how colourful, 0 (grey) to 3; 1 as the scene; default that of the look",
    )
    color.add(
        "--values",
        type=values.share,
        metavar="SHARE",
        help="how far lights and darks are opened to those of a painting, lights warmer than darks, 0 to 1; "
        "default that of the look",
    )


def add_light(container: Container) -> None:
    """`LightConfig`."""
    light = ConfigFlags(container, "light")
    light.add(
        "--relief",
        type=values.share,
        metavar="SHARE",
        help="strength of light and shade on the paint, 0 (flat) to 1; default that of the look",
    )
    lamps = ConfigFlags(container.add_mutually_exclusive_group(), "light")
    lamps.add(
        "--lamp",
        type=values.lamp,
        metavar="AZ,EL",
        help="where the light comes from in the first view, in degrees clockwise from the right of the "
        "picture, and above the canvas, up to 90; default that of the look, the upper left",
    )
    lamps.add(
        "--sun",
        type=values.sun,
        metavar="AZ,EL[..AZ,EL]",
        help="where the light stands in the scene, in degrees: the azimuth as of --azimuth, and above the "
        "table; two with .. between them: it passes from one to the other along a film; default --lamp",
    )
    light.add(
        "--key",
        type=values.share,
        metavar="SHARE",
        help="strength in which that lamp lights the scene, warm in the light and cool in the shade, 0 (only "
        "the paint is lit) to 1; default that of the look",
    )
    light.add(
        "--gloss",
        type=values.number,
        metavar="SHARE",
        help="strength of highlights, 0 to 0.5; paint looks like plastic from 0.15 on; default that of the "
        "look",
    )
    light.add(
        "--canvas",
        choices=get_args(Canvas),
        help="what lies under the paint, default that of the look",
    )


def add_draw(parser: ArgumentParser, *, has_look: bool = False) -> None:
    """`DrawConfig`, without the lock, which matters along a path; `has_look` if a look has the defaults."""
    stroke = "the brushes of the look, impasto in plain" if has_look else "impasto"
    background = "the ground of the look, else white" if has_look else "white"
    container = parser.add_argument_group("drawing")
    flags = ConfigFlags(container, "draw")
    flags.add(
        "--stroke",
        metavar="NAME|FILE|FOLDER",
        help="built-in stroke (`brushgs strokes` lists them), an image file, or 'gaussian' for the plain "
        "3DGS picture; several with commas between them (flat,dab: long strokes take the flat brush, short "
        f"ones dabs), or a folder of images: any of them; image files: {PICTURES_READ}; default {stroke}",
    )
    flags.add(
        "--filter",
        choices=get_args(Filter),
        help="how the stroke image is sampled: 'mip', small strokes do not shimmer (default), 'bilinear' as "
        "published, 'nearest'",
    )
    flags.add(
        "--extent",
        choices=get_args(Extent),
        help="size of strokes: 'fitted' to what the stroke image covers (default), 'paper': 2 sigma",
    )
    flags.add(
        "--order",
        choices=get_args(Order),
        help="how strokes hide each other: by 'depth' (default for a picture), or 'soft': strokes of nearly "
        "equal depth blend, so that none pops (default along a path)",
    )
    flags.add(
        "--underpaint",
        type=values.on_off,
        metavar="on|off",
        help="a soft copy of each stroke behind it, so that nothing shows between strokes, default on",
    )
    flags.add(
        "--streaks",
        type=values.number,
        metavar="SHARE",
        help="by what share bristles are lighter or darker than their stroke, 0 to 0.5, default 0.1",
    )
    flags.add(
        "--background",
        metavar="COLOR|FILE",
        help="transparent, '#rrggbb', an image file, scaled to fill the picture, or one of "
        f"{', '.join(COLORS)}; default {background} (dark brown in the demo)",
    )
    add_threads(container)


def add_threads(container: Container) -> None:
    """`DrawConfig.threads`."""
    ConfigFlags(container, "draw").add(
        "--threads",
        type=values.count_from(1),
        metavar="N",
        help="processors to use, 1 to 1024, default all (with several --jobs an equal share each); the "
        "picture does not depend on it",
    )


def add_where(
    parser: ArgumentParser, limited: str, *, has_camera_file: bool = False, step: str = "where"
) -> None:
    """`WhereConfig`, see `configs.where_config`.

    Args:
        parser: gets the flags.
        limited: what is limited to the part of the scene, as "only there Gaussians are dropped".
        has_camera_file: whether the command has --camera-file already, which then is that of masks too.
        step: that the flags fill.
    """
    flags = ConfigFlags(parser.add_argument_group("where", limited), step)
    flags.add(
        "--where",
        field="expression",
        type=values.where,
        metavar="EXPR",
        help="part of the scene: subject, surroundings, box:x0,y0,z0,x1,y1,z1, sphere:x,y,z,radius, "
        "half:nx,ny,nz,d (where n.x >= d), colour:#rrggbb,distance, height:low..high above the ground (world "
        "units, or %% of the subject's), part:N (N-th largest connected one) or part:x,y,z (the nearest), "
        "mask:FILE|FOLDER (painted pictures, white inside), text:words (needs --clip); combined by and, or, "
        "not, ( ); default all",
    )
    flags.add(
        "--where-soft",
        field="soft",
        type=values.share,
        metavar="SHARE",
        help="width of the edge as a share of the subject's size, 0 (hard, default) to 2",
    )
    flags.add(
        "--clip",
        type=Path,
        metavar="FOLDER",
        help="CLIP model that finds text:words, yours: a folder with config.json, model.safetensors and "
        "tokenizer.json, as transformers saves it (extra text); default the environment's BRUSHGS_CLIP",
    )
    if not has_camera_file:
        flags.add(
            "--camera-file",
            action=CameraFile,
            type=values.camera_file,
            metavar="FILE|none",
            help=f"cameras of the masks, by the names of the pictures or in their order: {CAMERAS_READ}; by "
            f"default cameras that lie beside the scene give {BESIDE_GIVES}; 'none' passes over these",
        )


def add_clean(container: Container) -> None:
    """`CleanConfig`."""
    ConfigFlags(container, "clean").add(
        "--clean",
        field="floaters",
        choices=get_args(Clean),
        help="what is dropped: 'sure': floaters that are clearly detached, and crumbs that hang below an "
        "object (default), 'strong': closer floaters too, which loses some thin leaves; 'floaters': as "
        "'sure' without crumbs; 'off': nothing",
    )


def add_prune(parser: ArgumentParser) -> None:
    """`PruneConfig`."""
    flags = ConfigFlags(parser.add_argument_group("pruning"), "prune")
    flags.add(
        "--keep",
        type=values.share,
        metavar="SHARE",
        help="share of the Gaussians to keep, such as 0.7 or 70%%, in (0, 1], default 0.7 (more where each "
        "counts or becomes a stroke; 1 for a file of strokes, and with --stroke gaussian without --preset)",
    )
    flags.add(
        "--weight",
        choices=get_args(Weight),
        help="importance of a Gaussian: its 'contribution' to pictures by opacity, area and visibility "
        "(default), or 'paper': intensity as published",
    )


def add_cluster(parser: ArgumentParser, *, has_look: bool = False) -> Container:
    """`CleanConfig`, `ClusterConfig` without what strokes are made for, and `args.memory`; their group."""
    group = parser.add_argument_group("clustering")
    add_clean(group)
    add_stroke_count(group, has_look=has_look)
    add_merging(group)
    group.add_argument(
        "--memory",
        type=values.memory,
        metavar="SIZE",
        help="memory that strokes may be made in, such as 8GB: a scene that takes more is read in blocks and "
        "neighbours of one size and colour are merged as they come; default 3/4 of the machine's",
    )
    return group


def add_stroke_passes(parser: ArgumentParser) -> None:
    """`StrokesConfig`."""
    group = parser.add_argument_group(
        "strokes",
        "what strokes are beside clusters of Gaussians; files of strokes are painted as they are, and "
        "--preset paper and --stroke gaussian switch these off, with --underpaint and --streaks",
    )
    flags = ConfigFlags(group, "strokes")
    flags.add(
        "--see",
        choices=get_args(See),
        help="'views': small plain pictures of what is painted decide where strokes go, which of them are "
        "split, and their colours (default); 'off': the scene alone",
    )
    flags.add(
        "--focus",
        type=values.focus,
        metavar="auto|off|subject|X,Y,Z,R|FILE",
        help="where more strokes go to an area, out of the same number: 'auto', faces, hands and what stands "
        "out, up to eight times as many; or twice as many: the subject, a sphere in world units, or where a "
        "picture in the place of the painting is light; default that of the look, off in plain",
    )
    flags.add(
        "--solid",
        type=values.on_off,
        metavar="on|off",
        help="paint in place of glass: faint strokes become smaller and opaque, default on",
    )
    flags.add(
        "--direction",
        type=values.direction,
        metavar="own|form|colour|painting:FILE|guides:FILE",
        help="which way strokes run: 'own', as clustered; 'form', along shapes and edges (default); "
        "'colour', along edges of colour; as the brush marks of a painting, or along lines in space do",
    )
    flags.add(
        "--broken-color",
        type=values.number,
        metavar="L",
        help="by how much strokes differ in lightness from their neighbours, OKLab, 0 to 0.2, default 0.016",
    )
    flags.add(
        "--economy",
        type=values.share,
        metavar="SHARE",
        help="how far few large strokes describe what is flat, and what is left goes to accents of light and "
        "dark, 0 to 1; default that of the look",
    )
    flags.add(
        "--edges",
        type=values.share,
        metavar="SHARE",
        help="how far outlines are lost in the shade and found near the focus, 0 (all hard) to 1; default "
        "that of the look",
    )


def add_stroke_count(container: Container, *, has_look: bool = False) -> None:
    """`ClusterConfig.strokes`: a count, or a target that the count is chosen for."""
    usual = "that of the look, auto in plain" if has_look else "auto"
    flags = ConfigFlags(container.add_mutually_exclusive_group(), "cluster")
    flags.add(
        "--strokes",
        type=values.strokes,
        metavar="COUNT|PERCENT|all|auto|DB",
        help="number of strokes, 1 or more; a share of the scene as loaded such as 10%%; all; auto: the knee "
        "of error against the time of the painting, or of a frame of a film (auto:frame: of a frame in any "
        "case); 24dB: the fewest that reach this PSNR to the plain picture, above 0 and at most 100; default "
        f"{usual} (all with --stroke gaussian)",
    )
    flags.add(
        "--stroke-size",
        field="strokes",
        type=values.stroke_size,
        metavar="PX",
        help="in place of --strokes, the typical length of strokes in the picture such as 24px, above 0; "
        "default none",
    )


def add_strokes_for(container: Container) -> None:
    """`ClusterConfig.strokes_for`."""
    ConfigFlags(container, "cluster").add(
        "--strokes-for",
        choices=get_args(StrokesFor),
        help="'scene': strokes are made of all of it, so that any view of them fits (default); 'view': only "
        "of what this picture or path sees, so that all are spent there",
    )


def add_merging(container: Container) -> None:
    """`ClusterConfig` without the count."""
    flags = ConfigFlags(container, "cluster")
    flags.add(
        "--features",
        choices=get_args(Features),
        help="what makes Gaussians similar: 'balanced', independent of the scene's unit (default), or "
        "'paper' as published",
    )
    flags.add(
        "--merge",
        choices=get_args(Merge),
        help="how Gaussians merge: 'cover' keeps the area they paint (default), 'paper': plain means",
    )
    flags.add(
        "--method",
        choices=list(METHODS),
        help="k-means: " + ", ".join(f"'{name}' {words}" for name, words in METHODS.items()),
    )
    add_seed(container)


def add_seed(container: Container) -> None:
    """`ClusterConfig.seed`."""
    ConfigFlags(container, "cluster").add(
        "--seed",
        type=values.count_from(0),
        metavar="N",
        help="seed of all random choices, 0 to 4294967295, default 0",
    )


def add_palette(parser: ArgumentParser, *, is_required: bool = False) -> None:
    """`PaletteConfig`."""
    group = parser.add_argument_group(
        "palette", "recolor strokes with the mean and covariance of a picture's colours"
    )
    flags = ConfigFlags(group, "palette")
    flags.add(
        "--palette",
        field="file",
        type=Path,
        metavar="FILE",
        required=is_required,
        help=f"picture whose colours are taken: {PICTURES_READ}",
    )
    flags.add(
        "--palette-strength",
        field="strength",
        type=values.share,
        metavar="SHARE",
        help="0 keeps the colours of the scene, 1 (or 100%%) takes those of the picture, in [0, 1], "
        "default 1",
    )
    flags.add(
        "--palette-space",
        field="space",
        choices=get_args(ColorSpace),
        help="colour space of the comparison: 'lab', perceptual (default), 'linear' light, 'srgb' as encoded",
    )


def add_style(parser: ArgumentParser) -> None:
    """`StyleConfig` and `AdjustConfig`."""
    group = parser.add_argument_group(
        "style",
        "what was learnt from paintings and edits, and changes of colour (`brushgs style` learns one)",
    )
    ConfigFlags(group, "style").add(
        "--style",
        field="styles",
        type=values.styles,
        metavar="FILE:SHARE",
        help=f"style, or several with commas: monet{STYLE_SUFFIX}:0.7,dusk{STYLE_SUFFIX}:0.3; shares add up "
        "to at most 1, what is missing is the painting without style; default none, without a share 1",
    )
    adjust = ConfigFlags(group, "adjust")
    adjust.add(
        "--adjust",
        action=Fields,
        type=values.adjustments,
        metavar="NAME=NUMBER",
        help="one or several with commas: brightness -1 to 1 (default 0), contrast and saturation 0 to 3 "
        "(default 1), temperature -1 (blue) to 1 (orange, default 0); after palette and style",
    )
    adjust.add(
        "--swap",
        field="swaps",
        action="append",
        type=values.swap,
        metavar="#a:#b",
        help="colours near #a move to #b, such as '#3a5f0b:#7a1f1f'; may be given again; default none",
    )


def add_rules(parser: ArgumentParser) -> None:
    """`Rules`."""
    group = parser.add_argument_group("parts", "what is painted otherwise in parts of the scene")
    ConfigFlags(group, "rules").add(
        "--rules",
        field="file",
        type=Path,
        metavar="FILE",
        help='TOML file of tables [[region]], each with where = "subject" (any EXPR of `brushgs refine '
        "--where`) and any of brushes, size, share, palette, palette_strength, style, adjust, direction, "
        "opacity, soft; default none",
    )


def add_view(parser: ArgumentParser, *, size: str = "1280x720") -> None:
    """`ViewConfig`; `size` is the default in words."""
    group = parser.add_argument_group("view", "framed on the scene, or a camera from a file")
    flags = ConfigFlags(group, "view")
    flags.add(
        "--size",
        type=values.chosen_size,
        metavar="WxH|auto",
        help="picture size in pixels; 'auto' chooses portrait, square or landscape of as many pixels as "
        "1280x720 has by what is framed, and sets an object into the picture with room for its shadow; "
        f"default {size}, or that of the camera in the file",
    )
    add_placing(group)
    flags.add(
        "--camera-file",
        action=CameraFile,
        type=values.camera_file,
        metavar="FILE|none",
        help=f"cameras: {CAMERAS_READ}; 'none' passes over cameras that lie beside the scene, which by "
        f"default give {BESIDE_GIVES}",
    )
    flags.add(
        "--view",
        type=values.count_from(0),
        metavar="N",
        help="index of the camera in the file, from 0, default 0",
    )


def add_framing(container: Container, *, size: str) -> None:
    """`ViewConfig` of a view that is framed on the scene; `size` is the default in words."""
    ConfigFlags(container, "view").add(
        "--size", type=values.picture_size, metavar="WxH", help=f"picture size in pixels, default {size}"
    )
    add_placing(container)


def add_placing(container: Container) -> None:
    """`ViewConfig` of where a framed view is from."""
    flags = ConfigFlags(container, "view")
    add_up(container)
    flags.add(
        "--azimuth",
        type=values.degrees,
        metavar="DEG",
        help="degrees around the scene to the viewer's right, any; 0 is a view along an axis of the scene; "
        "default 30",
    )
    flags.add(
        "--elevation",
        type=values.degrees,
        metavar="DEG",
        help="degrees above the horizon, -90 to 90, default 15 (40 above flat ground)",
    )
    flags.add(
        "--from",
        field="side",
        choices=get_args(Side),
        help="in place of --azimuth, the side that is shown; 'left' and 'right' are those of who sees "
        "the front; default 'three-quarter'",
    )
    add_aim(container)


def add_aim(container: Container) -> None:
    """`ViewConfig` of what a framed view looks at, and how near."""
    flags = ConfigFlags(container, "view")
    flags.add(
        "--look-at",
        type=values.look_at,
        metavar="X,Y,Z|NAME",
        help="what is in the middle: 'subject', whole (default), 'scene', with all surroundings, 'part', the "
        "upper third of the subject, where heads are, or a point in world units",
    )
    flags.add(
        "--distance",
        type=values.number,
        metavar="D",
        help="from the camera to the point --look-at X,Y,Z, in world units, above 0; default that from which "
        "the subject is seen whole",
    )
    flags.add(
        "--pan",
        type=values.pair,
        metavar="RIGHT,UP",
        help="move the camera aside without turning it, in shares of the picture, -10 to 10, default 0,0",
    )
    flags.add(
        "--roll",
        type=values.degrees,
        metavar="DEG",
        help="degrees by which the scene is turned clockwise in the picture, any, default 0",
    )
    flags.add(
        "--fov-deg",
        field="fov_y",
        type=values.degrees,
        metavar="DEG",
        help="vertical field of view in degrees, in (0, 180), default 50",
    )
    flags.add(
        "--zoom",
        type=values.number,
        metavar="FACTOR",
        help="1 shows the whole subject (default), 2 twice as large; above 0",
    )


def add_up(container: Container) -> None:
    """`ViewConfig.up`."""
    ConfigFlags(container, "view").add(
        "--up",
        metavar="AXIS",
        help="up direction of the scene: +x, -x, +y, -y, +z, -z or three numbers such as 0,-1,0; default "
        "from the header of the file, else the likely axis, and -y where that is hardly less likely",
    )


def add_path(container: Container, *, default: str) -> None:
    """`PathConfig`; `default` is the path without these flags, in words."""
    flags = ConfigFlags(container, "path")
    flags.add(
        "--orbit",
        type=values.count_from(3),
        metavar="N",
        help=f"one turn around the up axis in N frames, 3 or more, from the framed view; default {default}",
    )
    flags.add(
        "--path",
        field="file",
        type=Path,
        metavar="FILE",
        help=f"cameras: {CAMERAS_READ}; each view is a frame, or with --frames or --seconds a key view of a "
        "smooth path; an animated camera moves as it does",
    )
    flags.add(
        "--frames",
        type=values.count_from(2),
        metavar="N",
        help="frames along the path, 2 or more, default one per view",
    )
    flags.add(
        "--seconds",
        type=values.number,
        metavar="S",
        help="duration in place of --frames, above 0, default frames over fps",
    )
    flags.add(
        "--fps",
        type=values.number,
        metavar="RATE",
        help="frames per second, above 0, default that of the path file, else 24, of a moving scene 30",
    )
    flags.add(
        "--loop",
        action="store_true",
        help="close the path: continue from the last view to the first; a moving scene runs there and back",
    )


def add_span(parser: ArgumentParser, about: str) -> ConfigFlags:
    """The part of a moving scene that is shown, of `ClipConfig`; gives the group, which `about` describes."""
    flags = ConfigFlags(parser.add_argument_group("clip", about), "clip")
    moment = "a moment, in seconds such as 0.4 or as a share such as 40%%"
    flags.add("--start", type=values.clip_time, metavar="TIME", help=f"{moment}, default that of the scene")
    flags.add("--end", type=values.clip_time, metavar="TIME", help=f"{moment}, default that of the scene")
    return flags


def add_clip(parser: ArgumentParser) -> None:
    """`ClipConfig`."""
    flags = add_span(parser, "a film of a moving scene")
    flags.add(
        "--speed",
        type=values.number,
        metavar="FACTOR",
        help="seconds of the scene in a second of the film, above 0, default 1",
    )
    flags.add(
        "--cross-fade",
        type=values.number,
        metavar="SECONDS",
        help="with --loop: the end fades into the beginning in so many seconds of the scene, above 0; "
        "default it runs back instead",
    )
