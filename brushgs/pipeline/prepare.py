"""The preparation for every command: from a scene and options to strokes, views and drawing options.

Cameras are framed on the cleaned scene, so that paintings of one scene with different counts line up.
"""

import warnings
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, TypedDict, Unpack

from brushgs.errors import SceneWarning
from brushgs.options.painting import STEPS, PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.options.where import WhereConfig
from brushgs.pipeline.background import Background, check_background
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.lamp import check_sun
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.moving import Moving
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Job, Memory, NoMemory, Steps, held
from brushgs.pipeline.steps import PAINTING
from brushgs.pipeline.where import Rest
from brushgs.rendering.canvas import Painting
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.cameras.paths import CameraPath
    from brushgs.passes.color.recolor import Palette
    from brushgs.passes.form.edges import Edges
    from brushgs.rendering.growing import GrowingPainting
    from brushgs.rendering.options import RenderOptions
    from brushgs.rendering.plain import PlainViews
    from brushgs.values.notes import LoadNotes

# Values that callers may request, by the names of `Prepared`.
STROKES = (
    "strokes",
    "plain",
    "rest",
    "texture",
    "kit",
    "options",
    "overpaint",
    "palette",
    "notes",
    "region_names",
    "moving",
)
VIEW = ("cameras", "path", "background")
PICTURE = (*VIEW, *STROKES, "painting", "edges", "ground_changes")
_VALUE_OF = {"cameras": "shown", "scene": "whole", "plain": "shown_plain"}  # where the graph has another name
_FIRST = (
    "styles",
    "regions",
    "own_brushes",
    "overpaint",
    "palette",
)  # files that options name: wrong ones are refused early
_EARLY = ("first_view", *VIEW, "scene")  # values that are found before the long work, in this order


@dataclass(frozen=True, eq=False, kw_only=True)
class Prepared:
    """The requested values of a painting; others are None or empty.

    Attributes:
        strokes: the strokes in space.
        texture: the stroke images, or a kernel.
        kit: which strokes each of several images suits; the strokes' brushes are its rows.
        options: how strokes are drawn, for a still or along a path.
        cameras: the views, one per frame.
        path: the path that the cameras belong to; None for a still.
        background: behind the strokes; None for transparent.
        palette: the palette of the strokes; None if they keep their colors.
        notes: what the scene file holds besides its Gaussians; None for Gaussians in memory.
        first_view: of the scene.
        painting: coats of strokes, ground and lamp.
        scene: the Gaussians as loaded, without floaters.
        pruned: the Gaussians that strokes are made of.
        maker: makes other numbers of strokes.
        growth: how the painting grows.
        moving: how the strokes move; None for a still scene.
        rest: Gaussians outside the requested part of the scene, without strokes; None if all are painted.
        region_names: of the parts with their own rules, from label 1 on.
        plain: Gaussians that are drawn unpainted among the strokes; None if all are painted.
        edges: role of each stroke in lost and found edges; None without them.
        ground_changes: color changes of the ground, in order.
        view: the options of the view, with the size and position of a composed picture.
        plain_views: small plain pictures that guided the strokes; None if the scene alone decides.
    """

    strokes: Gaussians = None  # type: ignore[assignment]  # reading a value that was not requested fails at once
    texture: "BrushSet" = None  # type: ignore[assignment]
    kit: "BrushKit" = None  # type: ignore[assignment]
    options: "RenderOptions" = None  # type: ignore[assignment]
    cameras: Sequence[Camera] = ()
    path: "CameraPath | None" = None
    background: Background = None
    palette: "Palette | None" = None
    notes: "LoadNotes | None" = None
    first_view: FirstView | None = None
    painting: Painting = None  # type: ignore[assignment]
    scene: Gaussians | None = None
    pruned: Gaussians | None = None
    maker: StrokeMaker | None = None
    growth: "GrowingPainting | None" = None
    moving: Moving | None = None
    rest: Rest | None = None
    region_names: Sequence[str] = ()
    plain: Gaussians | None = None
    edges: "Edges | None" = None
    ground_changes: Sequence[Callable[[Array], Array]] = ()
    view: ViewConfig | None = None
    plain_views: "PlainViews | None" = None

    @property
    def camera(self) -> Camera:
        """The first view, of a still the only one."""
        return self.cameras[0]

    @property
    def known_view(self) -> FirstView:
        """The first view, for a caller that requested it."""
        assert self.first_view is not None, "ask for first_view"
        return self.first_view

    @property
    def whole_scene(self) -> Gaussians:
        """The Gaussians as loaded, without floaters, for a caller that requested them."""
        assert self.scene is not None, "ask for scene"
        return self.scene

    @property
    def stroke_maker(self) -> StrokeMaker:
        """The maker of strokes, for a caller that requested it."""
        assert self.maker is not None, "ask for maker"
        return self.maker


class JobOptions(TypedDict, total=False):
    """The keywords of `open_job`, documented there."""

    asks: Collection[str]
    views: Camera | PathConfig | GrowConfig | None
    check_path: Callable[["CameraPath"], None] | None
    on_background: bool
    memory: Memory | None
    where: WhereConfig | None
    workers: SequenceConfig | None
    steps: Steps


def prepare(
    source: SceneFiles | Gaussians | Clip, config: PaintConfig, report: Report, **options: Unpack[JobOptions]
) -> Prepared:
    """Make strokes of a scene and other requested values, and nothing that they do not need.

    Peak memory: a scene is freed as soon as the next one is made from it, unless the caller holds it.

    Args:
        source: see `open_job`.
        config: of the painting.
        report: gets the stages of the steps that run.
        options: the requested values, and the views; see `open_job`.

    Raises:
        SceneError: if a file cannot be read.
        ValueError: if an option does not suit the scene; before long work if possible.
    """
    job = open_job(source, config, report, **options)
    found = job.run()
    fields_of = {_VALUE_OF.get(one.name, one.name): one.name for one in fields(Prepared)}
    return Prepared(**{fields_of[name]: found[name] for name in job.asked if name in fields_of})


def _note_unseen(config: PaintConfig) -> None:
    """Warn if colors are requested of a monochrome medium."""
    media = config.media
    chroma = config.color.chroma
    unseen = [("--palette", config.palette is not None), (f"--chroma {chroma:g}", chroma > 1)]
    if media.has_own_color:
        cure = "take a look in paint, such as oil or watercolour, or set color in [media] of a look file"
        for flag in (flag for flag, is_asked in unseen if is_asked):
            fact = f"{flag} gives no colors, since {media.kind} is of one, {media.color}"  # type: ignore[attr-defined]
            warnings.warn(SceneWarning(f"{fact}; {cure}"), stacklevel=2)


def open_job(
    source: SceneFiles | Gaussians | Clip,
    config: PaintConfig,
    report: Report,
    *,
    asks: Collection[str] = PICTURE,
    views: Camera | PathConfig | GrowConfig | None = None,
    check_path: Callable[["CameraPath"], None] | None = None,
    on_background: bool = True,
    memory: Memory | None = None,
    where: WhereConfig | None = None,
    workers: SequenceConfig | None = None,
    steps: Steps = PAINTING,
) -> Job:
    """A job of the graph of a painting; no step has run yet.

    Args:
        source: the files of a scene; Gaussians in memory, which count as a scene and not as strokes; or a
            moving scene for a film: then `Prepared.cameras` has one per frame.
        config: see `PaintConfig`.
        report: gets the stages of the steps that run.
        asks: names of requested fields of `Prepared`.
        views: one camera, or a path; None for the camera that `config.view` describes, also for a painting
            that grows.
        check_path: raises for an unsuitable path, before the long work.
        on_background: whether the background of the options lies behind the painting.
        memory: of earlier jobs for the same source: steps with unchanged inputs are not repeated, and have no
            stage. None takes that of `holding`, or repeats all.
        where: the part of the scene that strokes are made of; `Prepared.rest` is the rest. None for all.
        workers: read a scene larger than memory; None for this machine.
        steps: the graph.

    Raises:
        ValueError: if options exclude each other.
    """
    config = config.in_pixels
    check_sun(config.light, is_film=isinstance(views, PathConfig), is_moving=isinstance(source, Clip))
    if (on_background and "background" in asks) or config.cluster.target is not None:
        check_background(config.draw.background)
    if "painting" in asks:
        _note_unseen(config)
    memory = memory or held() or NoMemory()
    inputs = {
        "config": config,
        "source": source,
        "views": views,
        "where": where,
        "on_background": on_background,
        "report": report,
        "workers": workers,
        "check_path": check_path,
        "memory": memory,
    }
    inputs |= {f"{step}_config": getattr(config, step) for step in STEPS}
    asked = [*(one for one in _EARLY if one in asks), *sorted({*asks} - {*_EARLY})]
    return Job(steps, [*_FIRST, *(_VALUE_OF.get(name, name) for name in asked)], inputs, memory)
