"""The flags of the command line, their help, and how they become configuration.

Only the standard library is imported: `brushgs --help` answers as fast as Python starts.
"""

import argparse
import os
import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from math import isfinite, radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, get_args

from brushgs import __version__
from brushgs.io.pictures.formats import VIDEO_SUFFIXES
from brushgs.options.choices import (
    MAX_SIDE,
    PRESETS,
    BenchFamily,
    ColorSpace,
    Extent,
    Features,
    Filter,
    Floaters,
    Lock,
    Merge,
    Method,
    Order,
    Params,
    Weight,
    size_rule,
)

if TYPE_CHECKING:
    from brushgs.options.experiments import BenchConfig, RefineConfig, StabilityConfig
    from brushgs.options.painting import (
        ClusterConfig,
        DrawConfig,
        PaintConfig,
        PaletteConfig,
        PruneConfig,
        ViewConfig,
    )
    from brushgs.options.sequence import PathConfig, SequenceConfig

DESCRIPTION = "Paint trained 3D Gaussian Splatting scenes with brush strokes, on the CPU."
EPILOG = """\
examples:
  brushgs demo                                        an example scene, painted
  brushgs render scene.ply --stroke swirl             any trained scene (3DGS .ply)
  brushgs render scene.ply --stroke gaussian          the plain 3DGS picture
  brushgs render scene.ply --stroke my_brush.png --strokes 2000 --size 1920x1080
  brushgs render scene.ply --orbit 120 -o turn.mp4    once around it, as a video

`brushgs COMMAND --help` tells the flags of a command. A finished command prints the path it wrote on
stdout and a table of what it did on stderr. Exit code 2: an input that cannot be used, said in a sentence."""
DECIBEL = "dB"  # the unit of an error budget
FRAMING_FLAGS = ("up", "azimuth", "elevation", "fov_deg", "zoom")
SEQUENCE_FLAGS = ("frames", "seconds", "fps", "loop", "resume", "jobs", "scheduler")


# A quarter of the pixels of a picture that is looked at; steps of 3 degrees.
STABILITY_SIZE, STABILITY_ORBIT = (640, 360), 120
BENCH_QUICK_SIZE = (640, 360)


class UsageError(ValueError):
    """Words on the command line that mean nothing."""


class _Parser(ArgumentParser):
    def error(self, message: str) -> NoReturn:
        message = re.sub(r"^argument (\S+?)(/\S+)?: (?=must )", r"\1 ", message).removeprefix("argument ")
        raise UsageError(f"{message} (see {self.prog} --help)")


def parse(words: Sequence[str]) -> Namespace:
    """The namespace of a command line.

    Raises:
        UsageError: if a flag or a value means nothing; one sentence.
    """
    return build_parser().parse_args(_joined(words))


def _joined(words: Sequence[str]) -> list[str]:
    """`--up -y` as `--up=-y`: the parser would take -y for a flag."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] == "--up" and re.match(r"-([xyz]$|[0-9.])", word, re.IGNORECASE):
            joined[-1] = f"--up={word}"
        else:
            joined.append(word)
    return joined


def build_parser() -> ArgumentParser:
    """The parser of all commands."""
    parser = _Parser(
        "brushgs",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"brushgs {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def command(name: str, help: str) -> ArgumentParser:
        sub = commands.add_parser(name, help=help, description=help[0].upper() + help[1:] + ".")
        sub.add_argument("--debug", action="store_true", help="show the traceback of an error")
        return sub

    render = command("render", "paint a scene: PLY in; picture, numbered frames or video out")
    render.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    render.add_argument(  # a name that ends in a slash is a folder, so it stays text
        "-o",
        "--output",
        metavar="FILE",
        help="picture (.png, .exr, .tif), default SCENE-STROKE.png in the current folder; along a path "
        "video (.mp4, .webm, .gif), default SCENE-STROKE.mp4, or numbered frames, FOLDER/%%05d.png (.exr, "
        ".tif) or short FOLDER/",
    )
    _add_draw(render)
    _add_prune(render)
    _add_cluster(render)
    _add_palette(render, is_required=False)
    render.add_argument(
        "--preset",
        choices=sorted(PRESETS),
        default="default",
        help="'paper': the published method (paper weight, features, merge, extent; minibatch, bilinear, no "
        "lock); single flags still win",
    )
    _add_view(render)
    _add_path(render)
    _add_telling(render)

    demo = command("demo", "build the example scene, paint it, and say where the picture is")
    demo.add_argument(
        "-o", "--output", type=Path, default=Path("brushgs-demo"), help="folder, default brushgs-demo"
    )
    _add_draw(demo)
    _add_strokes(demo)
    demo.add_argument("--size", type=_size, metavar="WxH", help="picture size in pixels, default 1200x900")
    demo.add_argument("--seed", type=_count_from(0), default=0, help="seed of scene and strokes, default 0")
    _add_telling(demo)

    prune = command("prune", "keep the Gaussians that matter most: PLY in, PLY out")
    prune.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(prune, "scene file, default SCENE-pruned.ply in the current folder")
    _add_prune(prune)
    _add_telling(prune)

    cluster = command("cluster", "merge Gaussians into fewer and larger ones: PLY in, PLY out")
    cluster.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(cluster, "scene file, default SCENE-strokes.ply in the current folder")
    _add_cluster(cluster)
    _add_telling(cluster)

    recolor = command("recolor", "give a scene the colours of a painting: PLY and picture in, PLY out")
    recolor.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(recolor, "scene file, default SCENE-recolored.ply in the current folder")
    _add_palette(recolor, is_required=True)
    _add_telling(recolor)

    refine = command("refine", "fit strokes to the scene, or to a style image: PLY in, PLY out")
    refine.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(refine, "scene file, default SCENE-refined.ply in the current folder")
    _add_draw(refine)
    _add_prune(refine)
    _add_cluster(refine)
    _add_palette(refine, is_required=False)
    _add_refine(refine)
    _add_telling(refine)

    stability = command("stability", "measure how still the strokes hold along a camera path")
    stability.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(
        stability,
        "folder for stability.json and stability.png, default SCENE-stability in the current folder; or one "
        "file, .json or .png",
    )
    _add_draw(stability)
    _add_prune(stability)
    _add_cluster(stability)
    _add_framing(stability.add_argument_group("view", "framed on the scene"), size="640x360")
    way = stability.add_argument_group("path", "the views that are compared, default --orbit 120")
    _add_way(way, nothing="--orbit 120")
    stability.set_defaults(camera_file=None, view=None, lock=None, resume=None, jobs=None, scheduler=None)
    stability.add_argument(
        "--pairs",
        type=_count_from(1),
        metavar="N",
        help="pairs of frames compared at each gap at most, 1 or more, default 40; no others are painted",
    )
    stability.add_argument(
        "--no-plot", action="store_true", help="no stability.png, which needs brushgs[plot]"
    )
    _add_telling(stability)

    bench = command("bench", "draw the curves of error against run time of a scene")
    bench.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    _add_output(
        bench,
        "folder for bench.json, bench.csv and bench.png, default SCENE-bench in the current folder; or one "
        "file, .json, .csv or .png",
    )
    bench.add_argument(
        "--quick",
        action="store_true",
        help="fewer counts and repeats at 640x360: under a minute on 100,000 Gaussians and two processors",
    )
    bench.add_argument(
        "--families",
        type=_words,
        metavar="NAME,...",
        help=f"which curves, of {', '.join(get_args(BenchFamily))}; default all that the scene has use for",
    )
    bench.add_argument(
        "--strokes",
        type=_counts,
        metavar="N,...",
        help="stroke counts of the first curve, ascending, each 1 or more; default 125 to 64000 by doubling; "
        "one per Gaussian that is kept is always the last",
    )
    bench.add_argument(
        "--repeats",
        type=_count_from(1),
        metavar="N",
        help="rounds in which every point runs, 1 or more, default 5 (3 with --quick)",
    )
    _add_draw(bench)
    _add_prune(bench)
    _add_merging(bench)
    _add_view(bench)
    bench.add_argument("--no-plot", action="store_true", help="no bench.png, which needs brushgs[plot]")
    _add_telling(bench)
    doctor = command("doctor", "find what is wrong or odd with a scene file, and cure it")
    doctor.epilog = (
        "Exit code: 0 where the scene is sound or only odd, or a cured scene was written; 3 where a fault "
        "was found; 2 where the file cannot be used at all."
    )
    doctor.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    doctor.add_argument("--fix", type=Path, metavar="FILE", help="write the cured scene to this .ply")
    doctor.add_argument(
        "--floaters",
        choices=get_args(Floaters),
        default="sure",
        help="what hangs in the air and --fix drops: what is 'sure' to be apart (default), 'strong': nearer "
        "things too, which takes some thin leaves along; 'keep' all",
    )
    _add_telling(doctor)

    strokes = command("strokes", "list the built-in strokes")
    strokes.add_argument("--json", action="store_true", help="as a JSON list")

    info = command("info", "tell what a scene file holds")
    info.add_argument("scene", type=Path, help="trained 3D Gaussian scene (.ply)")
    info.add_argument("--json", action="store_true", help="as a JSON object")
    return parser


def paint_config(args: Namespace) -> "PaintConfig":
    """The configuration of `brushgs render`.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.painting import PaintConfig, PruneConfig

    preset = PRESETS[args.preset]
    all_kept = {"keep": 1.0} if _is_plain(args) else {}
    return PaintConfig(
        prune=PruneConfig(**all_kept | _chosen(args, preset, "keep", "weight")),
        cluster=cluster_config(args, preset),
        palette=palette_config(args),
        view=view_config(args),
        draw=draw_config(args, preset),
    )


def palette_config(args: Namespace) -> "PaletteConfig | None":
    """Whose colours the strokes take; None where they keep their own.

    Raises:
        ValueError: if the strength is out of range, or there are flags of a palette and no palette.
    """
    if args.palette is None:
        for name in ("palette_strength", "palette_space"):
            if getattr(args, name) is not None:
                flag = name.replace("_", "-")
                raise ValueError(f"--{flag} must stand beside --palette, which says whose colours are taken")
        return None
    from brushgs.options.painting import PaletteConfig

    given = {"strength": args.palette_strength, "space": args.palette_space}
    return PaletteConfig(args.palette, **{name: value for name, value in given.items() if value is not None})


def refine_configs(args: Namespace) -> "tuple[PaintConfig, RefineConfig]":
    """How `brushgs refine` makes and draws strokes, and what it moves.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.experiments import RefineConfig
    from brushgs.options.painting import PaintConfig, ViewConfig
    from brushgs.options.region import Region

    if args.to == "style" and args.style is None:
        raise ValueError("--to style must stand beside --style, which says what style")
    if args.to == "self" and args.style is not None:
        raise ValueError("--to self must not stand beside --style; leave one out")
    paint = PaintConfig(
        prune=prune_config(args),
        cluster=cluster_config(args),
        palette=palette_config(args),
        view=ViewConfig(**_chosen(args, {}, "up")),
        draw=draw_config(args),
    )
    chosen = _chosen(args, {}, "style", "params", "steps", "views", "size", "seed", "vgg_weights")
    where = None if args.where is None else Region.parse(args.where)
    return paint, RefineConfig(**chosen, where=where, is_resumed=bool(args.resume))


def prune_config(args: Namespace) -> "PruneConfig":
    """The configuration of `brushgs prune`."""
    from brushgs.options.painting import PruneConfig

    return PruneConfig(**_chosen(args, {}, "keep", "weight"))


def cluster_config(args: Namespace, preset: Any = PRESETS["default"]) -> "ClusterConfig":
    """How Gaussians become strokes; `brushgs demo` has only some of its flags.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.painting import ClusterConfig, ErrorBudget, StrokeSize

    chosen = _chosen(args, preset, "features", "merge", "method", "seed")
    if getattr(args, "stroke_size", None) is not None:
        if args.strokes is not None:
            raise ValueError("--stroke-size must not stand beside --strokes, which says how many there are")
        return ClusterConfig(**chosen | {"strokes": StrokeSize(args.stroke_size)})
    if isinstance(args.strokes, str) and args.strokes.endswith(DECIBEL):
        return ClusterConfig(**chosen | {"strokes": ErrorBudget(_number(args.strokes[: -len(DECIBEL)]))})
    if args.strokes == "all" or (args.strokes is None and _is_plain(args)):
        return ClusterConfig(**chosen | {"strokes": None})
    return ClusterConfig(**chosen | _chosen(args, {}, "strokes"))


def _is_plain(args: Namespace) -> bool:
    """Whether the plain 3DGS picture is asked for: then the whole scene is drawn, unless flags say else."""
    return getattr(args, "stroke", None) == "gaussian"


def draw_config(args: Namespace, preset: Any = PRESETS["default"], background: str = "white") -> "DrawConfig":
    """How strokes are drawn, on `background` unless the flags say else."""
    from brushgs.options.painting import DrawConfig

    chosen = _chosen(args, preset, "stroke", "filter", "extent", "background", "lock", "order", "threads")
    return DrawConfig(**{"background": background} | chosen)


def view_config(args: Namespace) -> "ViewConfig":
    """The view asked for.

    Raises:
        ValueError: if flags of a framed view stand beside a camera file.
    """
    from brushgs.options.painting import ViewConfig

    if args.camera_file is None:
        if args.view is not None:
            raise ValueError("--view must stand beside --camera-file, which says what the views are")
    else:
        for name in FRAMING_FLAGS:
            if getattr(args, name) is not None:
                flag = name.replace("_", "-")
                raise ValueError(
                    f"--{flag} must not stand beside --camera-file, which says where the camera is"
                )
    chosen = _chosen(args, {}, "size", "camera_file", "view", "up", "zoom")
    for name, flag in (("azimuth", "azimuth"), ("elevation", "elevation"), ("fov_y", "fov_deg")):
        if getattr(args, flag) is not None:
            chosen[name] = radians(getattr(args, flag))
    return ViewConfig(**chosen)


def path_config(args: Namespace) -> "PathConfig | None":
    """The way of the camera; None where a single picture is asked for.

    Raises:
        ValueError: if flags exclude each other, or need a path and there is none.
    """
    if args.orbit is None and args.path is None:
        for name in SEQUENCE_FLAGS:
            if getattr(args, name):
                raise ValueError(
                    f"--{name} must stand beside --orbit or --path: one picture has no use for it"
                )
        if args.lock == "track":
            raise ValueError("--lock track must stand beside --orbit or --path: only a path can be tracked")
        _refuse_many(args.output or "")
        return None
    from brushgs.options.sequence import PathConfig

    if args.camera_file is not None:
        flag = "path" if args.path is not None else "orbit"
        raise ValueError(f"--camera-file must not stand beside --{flag}, which says where the cameras are")
    if args.path is not None:
        for name in FRAMING_FLAGS:
            if getattr(args, name) is not None:
                flag = name.replace("_", "-")
                raise ValueError(f"--{flag} must not stand beside --path, which says where the cameras are")
    chosen = _chosen(args, {}, "orbit", "frames", "seconds", "fps", "loop")
    return PathConfig(**chosen, file=args.path)


def _refuse_many(output: str) -> None:
    """Refuse the output of a path where there is none."""
    name = Path(output).name
    if Path(output).suffix.lower() in VIDEO_SUFFIXES:
        found = f"{output} is a video"
    elif "%" in name:
        found = f"{name} numbers frames"
    elif output.endswith(("/", os.sep)):
        found = f"{output} is a folder, for frames"
    else:
        return
    raise ValueError(f"{found}; say with --orbit or --path where the camera goes")


def sequence_config(args: Namespace) -> "SequenceConfig":
    """Where the frames of a path are painted, and which."""
    from brushgs.options.sequence import SequenceConfig

    return SequenceConfig(**_chosen(args, {}, "jobs", "scheduler"), is_resumed=bool(args.resume))


def stability_configs(args: Namespace) -> "tuple[PaintConfig, PathConfig, StabilityConfig]":
    """What `brushgs stability` paints, along which path, and what it measures.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from brushgs.options.experiments import StabilityConfig
    from brushgs.options.painting import PaintConfig

    if args.orbit is None and args.path is None:
        args.orbit = STABILITY_ORBIT
    args.size = args.size or STABILITY_SIZE
    path = path_config(args)
    assert path is not None, "there is an orbit, at least"
    paint = PaintConfig(
        prune=prune_config(args),
        cluster=cluster_config(args),
        view=view_config(args),
        draw=draw_config(args),
    )
    return paint, path, StabilityConfig(**_chosen(args, {}, "pairs"))


def bench_configs(args: Namespace) -> "tuple[PaintConfig, BenchConfig]":
    """What `brushgs bench` paints, and what it measures.

    Raises:
        ValueError: if a value is out of range, or flags exclude each other.
    """
    from dataclasses import replace

    from brushgs.options.experiments import BenchConfig
    from brushgs.options.painting import PaintConfig

    chosen = _chosen(args, {}, "families", "strokes", "repeats")
    config = replace(BenchConfig.quick() if args.quick else BenchConfig(), **chosen)
    args.strokes = None  # of the painting it is not one count but all
    if args.quick and args.size is None and args.camera_file is None:
        args.size = BENCH_QUICK_SIZE
    paint = PaintConfig(
        prune=prune_config(args),
        cluster=cluster_config(args),
        view=view_config(args),
        draw=draw_config(args),
    )
    return paint, config


def _chosen(args: Namespace, preset: Any, *names: str) -> dict[str, Any]:
    """The values of some flags that were given, else those of the preset; the rest keep their default."""
    given = {name: getattr(args, name) for name in names if getattr(args, name, None) is not None}
    return {name: preset[name] for name in names if name in preset} | given


def _add_output(parser: ArgumentParser, help: str) -> None:
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help=help)


def _add_draw(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--stroke",
        default="swirl",
        metavar="NAME|FILE",
        help="built-in stroke (`brushgs strokes` lists them), 'gaussian' for the plain 3DGS picture, or an "
        "image file; default swirl",
    )
    parser.add_argument(
        "--filter",
        choices=get_args(Filter),
        help="how small strokes read the stroke image: 'mip' without shimmer (default), 'bilinear' as "
        "published, 'nearest'",
    )
    parser.add_argument(
        "--extent",
        choices=get_args(Extent),
        help="size of strokes: 'fitted' to what the stroke image covers (default), 'paper': 2 sigma",
    )
    parser.add_argument(
        "--order",
        choices=get_args(Order),
        help="how strokes hide each other: by 'depth' (default for a picture), or 'soft', fading where "
        "depths are nearly equal, so that none jumps (default along a path)",
    )
    parser.add_argument(
        "--background",
        metavar="GROUND",
        help="white (default; toned in the demo), black, transparent, '#rrggbb', or an image file scaled to "
        "fill the picture",
    )
    parser.add_argument(
        "--threads",
        type=_count_from(1),
        help="processors to use, 1 or more, default all (of each of several --jobs: its share of all); the "
        "picture does not depend on it",
    )


def _add_prune(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--keep",
        type=_number,
        metavar="SHARE",
        help="share of the Gaussians that is kept, in (0, 1], default 0.7 (1 for strokes from a file, "
        "and with --stroke gaussian)",
    )
    parser.add_argument(
        "--weight",
        choices=get_args(Weight),
        help="what counts: 'contribution' to pictures by opacity, area, visibility (default), or 'paper'",
    )


def _add_strokes(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--strokes",
        type=_strokes,
        metavar="COUNT|PERCENT|all|auto|DB",
        help="number of strokes, 1 or more, or a share of the scene as loaded such as 10%%, or all; auto: as "
        "many as are worth their time in this picture; 24dB: the fewest that come as near to the plain "
        "picture; default 7000 (all with --stroke gaussian)",
    )
    parser.add_argument(
        "--stroke-size",
        type=_pixels,
        metavar="PX",
        help="in place of --strokes, how long strokes typically are in the picture, such as 24px, above 0; "
        "default none",
    )


def _add_cluster(parser: ArgumentParser) -> None:
    _add_strokes(parser)
    _add_merging(parser)


def _add_merging(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--features",
        choices=get_args(Features),
        help="what makes Gaussians alike: 'balanced', independent of the scene's unit (default), or 'paper'",
    )
    parser.add_argument(
        "--merge",
        choices=get_args(Merge),
        help="how Gaussians become one: 'cover' keeps the area they paint (default), 'paper' plain means",
    )
    parser.add_argument(
        "--method",
        choices=get_args(Method),
        help="k-means: 'auto' by size (default), 'lloyd' in exact steps, 'minibatch' as published",
    )
    parser.add_argument("--seed", type=_count_from(0), help="seed of the clustering, 0 or more, default 0")


def _add_refine(parser: ArgumentParser) -> None:
    group = parser.add_argument_group("refinement", "needs PyTorch: pip install 'brushgs[refine]'")
    group.add_argument(
        "--to",
        choices=("self", "style"),
        help="'self': the scene's plain picture (default); 'style': a style image (default with --style)",
    )
    group.add_argument(
        "--style", type=Path, metavar="FILE", help="a picture whose colours and marks are taken"
    )
    group.add_argument(
        "--params",
        choices=get_args(Params),
        help="what of the strokes moves: 'colour' alone, 'free' all but opacity, 'all' (default)",
    )
    group.add_argument(
        "--where",
        metavar="REGION",
        help="strokes that may change: box:x0,y0,z0,x1,y1,z1, sphere:x,y,z,radius (world units) or "
        "colour:#rrggbb,distance; default all",
    )
    group.add_argument(
        "--steps", type=_count_from(1), metavar="N", help="at most so many, default 900 (100 with --style)"
    )
    group.add_argument(
        "--views",
        type=_count_from(1),
        metavar="N",
        help="to learn from, around the scene, default 320, with --style 24",
    )
    group.add_argument("--size", type=_size, metavar="WxH", help="of these views in pixels, default 384x288")
    group.add_argument(
        "--up", metavar="AXIS", help="direction that is up, default what the file says, else -y"
    )
    group.add_argument(
        "--vgg-weights",
        type=Path,
        metavar="FILE",
        help="torchvision's weights of VGG-16 or VGG-19 (.pth), default those in torch's cache, else "
        "features that need none",
    )
    group.add_argument("--resume", action="store_true", help="go on with a refinement that was stopped")
    group.add_argument(
        "--report",
        type=Path,
        metavar="FOLDER",
        help="gets refine.json and refine.png: error against seconds, pictures before and after; or one "
        "file, .json or .png",
    )
    group.add_argument("--no-plot", action="store_true", help="no refine.png, which needs brushgs[plot]")


def _add_palette(parser: ArgumentParser, *, is_required: bool) -> None:
    group = parser.add_argument_group("palette", "the colours of a painting: their mean and their spread")
    group.add_argument(
        "--palette", type=Path, metavar="FILE", required=is_required, help="a picture whose colours are taken"
    )
    group.add_argument(
        "--palette-strength",
        type=_number,
        metavar="SHARE",
        help="share of the way to its colours, in [0, 1], default 1",
    )
    group.add_argument(
        "--palette-space",
        choices=get_args(ColorSpace),
        help="where colours are compared: 'lab' as the eye does (default), 'linear' light, 'srgb' as encoded",
    )


def _add_view(parser: ArgumentParser) -> None:
    group = parser.add_argument_group("view", "framed on the scene, or taken from a file")
    _add_framing(group, size="1280x720, or that of the camera in the file")
    group.add_argument(
        "--camera-file",
        type=Path,
        metavar="FILE",
        help="cameras.json of a 3DGS training, transforms.json of NeRF and nerfstudio, camera_path.json, or "
        "a COLMAP sparse model",
    )
    group.add_argument(
        "--view", type=_count_from(0), metavar="N", help="which camera of the file, from 0, default 0"
    )


def _add_framing(group: argparse._ArgumentGroup, size: str) -> None:
    group.add_argument(
        "--size",
        type=_size,
        metavar="WxH",
        help=f"picture size in pixels, default {size}",
    )
    group.add_argument(
        "--up",
        metavar="AXIS",
        help="direction that is up: +x, -x, +y, -y, +z, -z or three numbers 0,-1,0; default what the file "
        "says, else -y, as COLMAP and most trainers have it (+z: Blender)",
    )
    group.add_argument(
        "--azimuth",
        type=_number,
        metavar="DEG",
        help="degrees around the scene to the viewer's right, any, default 30",
    )
    group.add_argument(
        "--elevation",
        type=_number,
        metavar="DEG",
        help="degrees above the horizon, -90 to 90, default 15 (40 above flat ground)",
    )
    group.add_argument(
        "--fov-deg",
        type=_number,
        metavar="DEG",
        help="vertical field of view in degrees, in (0, 180), default 50",
    )
    group.add_argument(
        "--zoom", type=_number, help="1 shows the subject whole (default), 2 twice as large; above 0"
    )


def _add_path(parser: ArgumentParser) -> None:
    group = parser.add_argument_group("path", "many frames along a camera path, in place of one picture")
    _add_way(group, nothing="one picture")
    group.add_argument(
        "--lock",
        choices=get_args(Lock),
        help="how the direction of a stroke is chosen: 'track' follows it along the path (default there), "
        "'anchor' in each view alone (default for a picture), 'off' as published: strokes flip",
    )
    group.add_argument(
        "--resume",
        action="store_true",
        help="go on with numbered frames: only those that are missing are painted",
    )
    group.add_argument(
        "--jobs",
        type=_count_from(1),
        metavar="N",
        help="processes that paint, 1 or more, default 1, which uses all processors for one frame; frames do "
        "not depend on it",
    )
    group.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler whose workers paint, such as tcp://host:8786 (needs brushgs[cluster]); default "
        "this machine",
    )


def _add_way(group: argparse._ArgumentGroup, nothing: str) -> None:
    group.add_argument(
        "--orbit",
        type=_count_from(3),
        metavar="N",
        help=f"once around the up axis in N frames, 3 or more, from the framed view on; default {nothing}",
    )
    group.add_argument(
        "--path",
        type=Path,
        metavar="FILE",
        help="nerfstudio camera_path.json, transforms.json, cameras.json or a COLMAP sparse model: each view "
        "a frame, or key views of a smooth path if --frames or --seconds is given",
    )
    group.add_argument(
        "--frames",
        type=_count_from(2),
        metavar="N",
        help="frames along the path, 2 or more, default its views",
    )
    group.add_argument(
        "--seconds", type=_number, help="the same as a duration, above 0, default what the frames come to"
    )
    group.add_argument(
        "--fps", type=_number, help="frames a second, above 0, default what the file says, else 24"
    )
    group.add_argument("--loop", action="store_true", help="go on from the last view to the first")


def _add_telling(parser: ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="what was done as JSON on stdout, no table")
    parser.add_argument("--quiet", action="store_true", help="no table, no progress, no path: errors only")


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise ArgumentTypeError(f"must be a number, got {text!r}")
    return value


def _count_from(least: int) -> Callable[[str], int]:
    def count(text: str) -> int:
        if not re.fullmatch(r"\+?[0-9]{1,18}", text) or int(text) < least:
            raise ArgumentTypeError(f"must be a whole number of {least} or more, got {text!r}")
        return int(text)

    return count


def _counts(text: str) -> tuple[int, ...]:
    """Counts with commas between them."""
    return tuple(_count_from(1)(word) for word in text.split(","))


def _words(text: str) -> tuple[str, ...]:
    return tuple(word.strip() for word in text.split(","))


def _strokes(text: str) -> int | float | str:
    """An int is a count, a float a share; "all", "auto" and a budget such as "24dB" stay."""
    if text in ("all", "auto"):
        return text
    if text.lower().endswith(DECIBEL.lower()):
        if not 0 < (psnr := _number(text[: -len(DECIBEL)])) <= 100:
            raise ArgumentTypeError(f"must be above 0 dB and at most 100 dB, got {text!r}")
        return f"{psnr!r}{DECIBEL}"
    if text.endswith("%"):
        share = _number(text[:-1]) / 100
        if not 0 < share <= 1:
            raise ArgumentTypeError(f"must be above 0 % and at most 100 %, got {text!r}")
        return share
    try:
        return _count_from(1)(text)
    except ArgumentTypeError:
        raise ArgumentTypeError(
            f"must be a count of 1 or more, a share such as 10%, all, auto, or a budget such as 24dB, "
            f"got {text!r}"
        ) from None


def _pixels(text: str) -> float:
    match = re.fullmatch(r"([0-9]+\.?[0-9]*|\.[0-9]+) ?(px)?", text, re.IGNORECASE)
    if match is None or not 0 < float(match[1]) <= MAX_SIDE:
        raise ArgumentTypeError(f"must be a length above 0 in pixels such as 24px, got {text!r}")
    return float(match[1])


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"([0-9]{1,5})[xX]([0-9]{1,5})", text)
    if match is None:
        raise ArgumentTypeError(f"must be WIDTHxHEIGHT in pixels such as 1280x720, got {text!r}")
    size = int(match[1]), int(match[2])
    if broken := size_rule(*size):
        raise ArgumentTypeError(broken)
    return size
