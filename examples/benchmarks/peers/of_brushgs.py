"""brushgs itself, as `brushgs render` paints stills and films: in looks, as published, and frame by frame."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from brushgs.options.choices import PRESETS, StepValues
from brushgs.options.look import Look
from brushgs.options.painting import PaintConfig
from brushgs.options.styling import StyleConfig, StyleShare
from brushgs.outlets.learn_style import learn_style
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.still import paint_view
from brushgs.pipeline.styling import styled
from brushgs.rendering.track import Track, track_directions
from brushgs.values.arrays import F32
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from examples.benchmarks.peers.task import Task, on_white

NO_STAGE: StepValues = {"ground": {"stage": False}}


def config_of(look: str, task: Task, changes: StepValues | None = None) -> PaintConfig:
    """The options of a look, with some fields changed, in the task's view and count."""
    config = replace(Look.open(look).config, view=task.view)
    for step, values in (changes or {}).items():
        config = replace(config, **{step: replace(getattr(config, step), **values)})
    return replace(config, cluster=replace(config.cluster, strokes=task.strokes))


def as_published(task: Task) -> PaintConfig:
    """The rules of the paper, `--preset paper`, at the task's count."""
    values = {step: dict(of_step) for step, of_step in PRESETS["paper"].items()}
    values["cluster"]["strokes"] = task.strokes
    return replace(PaintConfig.of(values), view=task.view)


def in_style(task: Task) -> PaintConfig:
    """Oil in the style of the task's painting, learned in the same process."""
    import brushgs as bg

    file = Path(_folder().name) / "peer.style"
    bg.save_style(learn_style(task.style), file)
    return styled(config_of("oil", task), StyleConfig((StyleShare(file, 1.0),)))


_kept: list[TemporaryDirectory[str]] = []


def _folder() -> TemporaryDirectory[str]:
    _kept.append(TemporaryDirectory())  # until the process ends
    return _kept[-1]


class ScenePainter:
    """One painting of the scene, seen by all cameras."""

    def __init__(self, task: Task, config: PaintConfig) -> None:
        self.task = task
        self.prepared: Prepared = prepare(task.source, config, Report(), views=task.views, asks=PICTURE)
        self.painting = self.prepared.painting.with_depth(False)
        self._tracks: list[Track | None] | None = None

    @property
    def strokes(self) -> int:
        """Those of the subject; coats under them and backdrops are not counted."""
        return len(self.prepared.strokes)

    def paint(self, index: int) -> F32:
        """A still as the command paints it; a frame with directions tracked over the cameras."""
        if len(self.task.cameras) == 1:
            frame = paint_view(self.prepared, Report(), depth=False)
            assert isinstance(frame, Frame)
            return on_white(frame)
        directions = [None if track is None else track.directions(index) for track in self._tracked()]
        return on_white(self.painting.frame(self.task.cameras[index], directions))

    def _tracked(self) -> list[Track | None]:
        if self._tracks is None:
            self._tracks = [
                track_directions(coat.strokes, self.task.cameras) if coat.options.lock == "track" else None
                for coat in self.painting.coats
            ]
        return self._tracks

    def boxes(self, index: int) -> Sequence[tuple[Boxes, Boxes]]:
        """See `Painter`."""
        camera, found = self.task.cameras[index], []
        for coat, track in zip(self.painting.coats, self._tracked(), strict=True):
            directions = None if track is None else track.directions(index)
            unlocked = replace(coat, options=replace(coat.options, lock="off"))
            found.append((coat.boxes(camera, directions)[0], unlocked.boxes(camera)[0]))
        return found


class FramePainter:
    """Every frame a painting of its own: strokes made anew for each camera, as a still."""

    def __init__(self, task: Task, config: PaintConfig) -> None:
        self.task, self.config = task, config
        self.strokes: int | None = None

    def paint(self, index: int) -> F32:
        """The still of one camera."""
        still = ScenePainter(replace(self.task, cameras=(self.task.cameras[index],)), self.config)
        self.strokes = still.strokes if self.strokes is None else self.strokes
        return still.paint(0)

    def boxes(self, index: int) -> None:
        """None: a stroke of one frame is no stroke of the next."""
