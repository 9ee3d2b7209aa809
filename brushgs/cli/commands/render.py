"""`brushgs render`: paint a scene as a picture; along a camera path or of a moving scene, as frames or a
video.
"""

import os
import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from brushgs.cli import flags
from brushgs.cli.clips import open_clip
from brushgs.cli.configs import (
    grow_config,
    paint_config,
    painting_name,
    scene_source,
    views_config,
)
from brushgs.cli.console import output_beside, reported
from brushgs.cli.passes import ShowPasses
from brushgs.formats.registry import PICTURE_SUFFIXES, VIDEO_SUFFIXES
from brushgs.options.choices import PRESETS
from brushgs.options.output import OutputConfig
from brushgs.options.table import OF_FILES, Options, option, share

VIEW = {"size": "auto"}  # the defaults of this command

if TYPE_CHECKING:
    from brushgs.options.painting import PaintConfig
    from brushgs.options.scene_source import SceneSource
    from brushgs.options.sequence import SequenceConfig
    from brushgs.pipeline.clip import Clip
    from brushgs.values.shot import Origin


class Own(Options, frozen=True):
    """The options of this command alone. `output` stays text: a trailing slash means a folder."""

    # fmt: off
    output: Annotated[str | None, option("picture, {written}; .ora or .psd in layers, .svg as paths; along a "
        "path or of a moving scene a video, {videos}, or numbered pictures, "
        f"FOLDER/%05d{PICTURE_SUFFIXES[0]} or short FOLDER/ #save #file #name #format", flag="-o --output",
        default=f"SCENE-LOOK{PICTURE_SUFFIXES[0]} in the current "
        f"folder, SCENE-STROKE{PICTURE_SUFFIXES[0]} with --stroke, SCENE-LOOK{VIDEO_SUFFIXES[0]} for a film",
        metavar="FILE", example="picture.jpg", not_in_memory=OF_FILES)] = None
    preset: Annotated[str, option("a set of options; 'paper': the published method (weight, features, merge "
        "and extent paper, method minibatch, filter bilinear, lock off, order depth, look plain); '0.1': the "
        "defaults of version 0.1 (backdrop loose, size 1280x720, clean floaters); other flags override it "
        "#published #version", choices=tuple(sorted(PRESETS)),
        example="paper")] = "default"
    quality: Annotated[str | None, option("how much is painted, and a note of how long it will take: 'draft' "
        "has a quarter of the strokes of the look, made for this picture or path alone, and neither accents "
        "nor lost edges; 'good' changes nothing; 'final' has twice the strokes; other flags override it "
        "#fast #speed #time #preview #detail", choices=("draft", "good", "final"),
        default="good, without the note")] = None
    views: Annotated[bool, option("also write the sheet of `brushgs views`, SCENE-views.png: the scene from "
        "all around, each view with its flags #angles #contact #sheet",
        not_in_memory=OF_FILES)] = False
    explain: Annotated[bool, option("paint nothing; print which steps would run, and why others would not, "
        "with estimates of time and memory; with -o FILE.svg or FILE.dot draw the graph, with --verbose list "
        "all steps #steps #graph #time #estimate", not_in_memory="paints nothing; use "
        "brushgs.pipeline.prepare.open_job(scene, config, report).explain()")] = False
    # fmt: on


class First(Options, frozen=True):
    """`--first`, for an unfinished painting."""

    GROUP: ClassVar = "path"
    # fmt: off
    first: Annotated[float | None, share("paint only the first strokes: a share such as 0.3 or 30%, in one "
        "picture #unfinished #progress", default="1")] = None
    # fmt: on


class Passes(Options, frozen=True):
    """`--passes`, which explains the layers of EXR files."""

    GROUP: ClassVar = "output"
    passes: Annotated[bool, option("explain --layers, and quit", action=ShowPasses)] = False


def add_flags(parser: ArgumentParser) -> None:
    """Define the command."""
    flags.add_scene(parser)
    flags.add(parser, Own)
    flags.add_painting(parser, size="auto for a picture, 1280x720 for a film")
    flags.add(parser, "projection")
    flags.add(parser, "path")
    flags.add(parser, "draw", "lock", group=("path", ""))
    flags.add(parser, "grow")
    flags.add(parser, "hand")
    flags.add(parser, First)
    flags.add(parser, "sequence")
    flags.add(parser, "clip")
    flags.add(parser, "output")
    for kind in (flags.NoClobberFlag, flags.NoMetadataFlag):
        flags.add(parser, kind, group=(OutputConfig.GROUP, ""))
    flags.add(parser, Passes)
    flags.add(parser, flags.ReportFlags)
    flags.add(parser, flags.CacheFlag)


def run(args: Namespace) -> None:
    """Paint, and report the stages."""
    config, scene, sequence = paint_config(args, view=VIEW), scene_source(args), sequence_config(args)
    if args.explain:
        _explain(args, scene, config)
        return
    with reported(args) as report:
        clip = open_clip(args, scene)
        grow = grow_config(args)
        path = views_config(args, grow, is_moving=clip is not None)
        is_still = path is None and clip is None
        if not is_still and args.first is not None:
            cure = "with --orbit, --path or --grow" if clip is None else "with a moving scene"
            raise ValueError(f"--first cannot be combined {cure}: it is one picture")
        if args.output:
            _check_output(args.output, scene, is_still=is_still, is_moving=clip is not None)
        origin = _origin_of(args, scene, config)
        suffix = (PICTURE_SUFFIXES if is_still else VIDEO_SUFFIXES)[0]
        output, sheet = _outputs(args, scene, painting_name(args, config), suffix, origin)
        if args.quality is not None:
            _tell_time(args, clip or scene, config, path)
        if is_still:
            from brushgs.pipeline.still import paint_file

            first = 1.0 if args.first is None else args.first
            paint_file(scene, output, config, report=report, sheet=sheet, first=first, origin=origin)
        else:
            from brushgs.pipeline.sequence import paint_sequence

            target = clip or scene
            more: Any = {"grow": grow, "sheet": sheet, "origin": origin}
            paint_sequence(target, output, path, config, sequence, report=report, **more)


def _origin_of(args: Namespace, scene: "SceneSource", config: "PaintConfig") -> "Origin | None":
    """The metadata of the picture; None for none."""
    if args.no_metadata:
        return None
    from brushgs.cli.origin import origin_of
    from brushgs.formats.cameras.read import find_beside
    from brushgs.pipeline.outputs import input_files

    others = [args.look, flags.given(args, "view").get("camera_file"), flags.given(args, "path").get("file")]
    files = [Path(name) for name in others if name is not None]
    return origin_of(args, [*input_files(scene, config), *find_beside(scene.camera_folders()), *files])


def _outputs(
    args: Namespace, scene: "SceneSource", ending: str, suffix: str, origin: "Origin | None"
) -> tuple[str | Path, Path | None]:
    """Paths of the picture or film, and of the sheet of views or None."""
    from brushgs.cli.origin import output_of

    is_resumed = flags.given(args, "sequence").get("is_resumed", False)
    kept = Namespace(**vars(args) | {"no_clobber": args.no_clobber and not is_resumed})
    output = output_of(kept, output_beside(scene, ending, suffix), origin)
    if not args.views:
        return output, None
    from brushgs.pipeline.outputs import free_name
    from brushgs.pipeline.views_sheet import sheet_beside

    return output, free_name(sheet_beside(output, scene.name), None if args.no_clobber else origin)


def _explain(args: Namespace, scene: "SceneSource", config: "PaintConfig") -> None:
    from brushgs.cli.explain import show
    from brushgs.pipeline.prepare import PICTURE, open_job
    from brushgs.pipeline.report import Report

    clip = open_clip(args, scene)
    grow = grow_config(args)
    views = views_config(args, grow, is_moving=clip is not None)
    asks = [*PICTURE, *(("first_view", "scene") if args.views else ())]
    asks += ["growth"] if args.first not in (None, 1) or grow is not None else []
    job = open_job(clip or scene, config, Report(), asks=asks, views=views)
    show(job, clip or scene, config, args)


def _tell_time(args: Namespace, source: "SceneSource | Clip", config: "PaintConfig", views: Any) -> None:
    """Say on stderr about how long the painting will take."""
    if args.quiet or args.json:
        return
    from brushgs.cli.explain import expected_seconds
    from brushgs.pipeline.estimate import crowd
    from brushgs.pipeline.prepare import PICTURE, open_job
    from brushgs.pipeline.report import Report

    seconds = expected_seconds(open_job(source, config, Report(), asks=PICTURE, views=views), source, config)
    took = f"{seconds:.2g} seconds" if seconds < 100 else f"{seconds / 60:.0f} minutes"
    print(f"brushgs: note: this takes about {took} on this machine{crowd()}", file=sys.stderr, flush=True)


def sequence_config(args: Namespace) -> "SequenceConfig":
    """The options of a sequence."""
    from brushgs.options.sequence import SequenceConfig

    return SequenceConfig(**flags.given(args, "sequence"))


def _check_output(output: str, scene: "SceneSource", *, is_still: bool, is_moving: bool) -> None:
    """Check that the output suits the number of pictures.

    Raises:
        ValueError: if one picture would be a video, numbered frames or a folder, or a moving scene one
            picture.
    """
    name, suffix = Path(output).name, Path(output).suffix.lower()
    if is_moving and suffix in PICTURE_SUFFIXES and "%" not in name:
        cure = f"add --time, one moment of it, or write {Path(output).with_suffix(VIDEO_SUFFIXES[0])}"
        raise ValueError(f"{output} is one picture, and {scene} moves; {cure}")
    if not is_still:
        return
    if suffix in VIDEO_SUFFIXES:
        found = f"{output} is a video"
    elif "%" in name:
        found = f"{name} numbers frames"
    elif output.endswith(("/", os.sep)):
        found = f"{output} is a folder of frames"
    else:
        return
    raise ValueError(f"{found} and needs a camera path; add --orbit or --path, or --grow")
