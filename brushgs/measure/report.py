"""Common parts of all experiments: a report with figures, the settings to repeat them, and its files."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from brushgs.formats.files import replacing
from brushgs.measure.plotting import NO_MATPLOTLIB, can_plot, check_plot
from brushgs.options.choices import REPORT_SUFFIXES
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.painting import STEPS, PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.table import Options, Struct, values_of
from brushgs.options.where import WhereConfig
from brushgs.pipeline.background import check_background
from brushgs.pipeline.outputs import check_output
from brushgs.pipeline.report import Report
from brushgs.values.camera import Camera
from brushgs.version import __version__

if TYPE_CHECKING:
    from rich.console import Console

PLOT = ".png"
BARE_PARTS = ("prune", "cluster", "strokes", "draw", "view")  # steps that bare strokes also have


@dataclass(frozen=True)
class Outputs:
    """The files of a report by suffix: one named file, or those of a folder.

    Attributes:
        paths: by suffix, such as ".json" and ".png".
        folder: created if missing; None for a single file.
        why_no_plot: the reason if there is no plot.
    """

    paths: dict[str, Path]
    folder: Path | None = None
    why_no_plot: str = "not requested"

    @classmethod
    def of(cls, output: Path, name: str, *, wants_plot: bool) -> "Outputs":
        """A file with a suffix of this report, see `REPORT_SUFFIXES`, or a folder that gets one of each.

        Raises:
            ValueError: if the suffix is another one, or `output` is a plot and `wants_plot` is not set.
        """
        suffixes = REPORT_SUFFIXES[name]
        suffix = output.suffix.lower()
        if suffix in suffixes and not output.is_dir():
            if suffix == PLOT and not wants_plot:
                raise ValueError(
                    f"--no-plot cannot be combined with an output that is a plot, got '{output}'"
                )
            return cls({suffix: output})
        if suffix and not output.is_dir():
            raise ValueError(f"output must be a folder or end in {', '.join(suffixes)}, got '{output}'")
        wanted = [suffix for suffix in suffixes if wants_plot or suffix != PLOT]
        return cls({suffix: output / f"{name}{suffix}" for suffix in wanted}, output)

    def without_plot(self, why: str) -> "Outputs":
        """The same without the plot."""
        paths = {suffix: path for suffix, path in self.paths.items() if suffix != PLOT}
        return Outputs(paths, self.folder, why)

    @property
    def plot(self) -> Path | None:
        """The plot, or None."""
        return self.paths.get(PLOT)

    def check(self, inputs: tuple[Path, ...]) -> None:
        """Refuse outputs that cannot be written, before the work for them.

        Raises:
            SceneError: if a folder is read-only or a file, or an output is one of the inputs.
        """
        for suffix, path in self.paths.items():
            check_output(path, (suffix,), inputs)

    def write_text(self, suffix: str, text: str) -> None:
        """Write the file of a suffix atomically, if it is among the outputs.

        Raises:
            SceneError: if it cannot be written.
        """
        if suffix not in self.paths:
            return
        with replacing(self.paths[suffix]) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="")


@dataclass
class ExperimentReport(Report):
    """The stages of an experiment, and its figures.

    Attributes:
        result: the figures, with a method `as_dict`; None until they are measured.
        settings: everything needed to repeat them, ready for JSON.
    """

    name: ClassVar[str]  # key of the figures in the JSON and in `REPORT_SUFFIXES`, stem of files in a folder
    schema: ClassVar[int]  # version of the figures; increases when a field changes its meaning
    result: Any = None
    settings: dict[str, Any] = field(default_factory=dict)

    def plan_outputs(self, output: Path, inputs: tuple[Path, ...], *, wants_plot: bool) -> Outputs:
        """The files of the report at `output`, one file or a folder, checked before any long work.

        Without matplotlib a folder gets no plot, and a note says so.

        Raises:
            SceneError: see `Outputs.check`.
            ValueError: see `Outputs.of`; or if `output` is the plot, and matplotlib is not installed.
        """
        outputs = Outputs.of(output, self.name, wants_plot=wants_plot)
        outputs.check(inputs)
        if outputs.plot is None or can_plot():
            return outputs
        if outputs.folder is None:
            check_plot()
        self.tell(f"{outputs.plot} is skipped: {NO_MATPLOTLIB}")
        return outputs.without_plot("needs matplotlib")

    def as_json(self) -> str:
        """Figures, settings and stages as one JSON object."""
        value = json.loads(super().as_json()) | {"schema": self.schema, "brushgs": __version__}
        figures = {} if self.result is None else {self.name: self.result.as_dict()}
        return json.dumps(value | {"settings": self.settings} | figures, indent=2)

    def write(
        self,
        outputs: Outputs,
        draw_plot: Callable[[Path], None],
        *,
        texts: Mapping[str, str] | None = None,
        stage: str = "write",
    ) -> None:
        """Write the files of the report, the JSON last: it includes this stage.

        Args:
            outputs: see `plan_outputs`.
            draw_plot: writes the plot to a path; called only if a plot is among the outputs.
            texts: content of further files, by suffix.
            stage: name of the stage.

        Raises:
            SceneError: if a file cannot be written.
        """
        with self.stage(stage) as now:
            for suffix, text in (texts or {}).items():
                outputs.write_text(suffix, text)
            if outputs.plot is not None:
                draw_plot(outputs.plot)
            else:
                now.skipped.append(f"plot: {outputs.why_no_plot}")
            written = [str(path) for path in outputs.paths.values()]
            now.did = " and ".join(written)
            now.counts = {"paths": written}
        outputs.write_text(".json", self.as_json() + "\n")

    def print_table(self) -> None:
        """Print the stages and the figures on stderr."""
        super().print_table()
        if self.result is None:
            return
        from rich.console import Console

        console = Console(stderr=True, highlight=False)
        if not console.is_terminal:
            console.width = 120
        self.print_figures(console)

    def print_figures(self, console: "Console") -> None:
        """Print the figures; called only if there are any."""
        raise NotImplementedError


def check_opaque_background(background: str) -> None:
    """Refuse a background on which pictures cannot be compared.

    Raises:
        ValueError: if it is transparent, or neither a color nor a file.
    """
    check_background(background)
    if background == "transparent":
        raise ValueError("background must be a color or an image to compare pictures on, got transparent")


def plain_paint(scene: SceneFiles | None, paint: PaintConfig) -> dict[str, Any]:
    """The scene files, None for a scene in memory, and the painting options, ready for JSON.

    Steps that bare strokes do not have are included only if a look or a flag changed them.
    """
    parts = {name: getattr(paint, name) for name in BARE_PARTS}
    name = None if scene is None else str(SceneSource.of(scene))
    bare = PaintConfig()
    others = {step: getattr(paint, step) for step in STEPS if step not in BARE_PARTS}
    of_look = {step: _plain(part) for step, part in others.items() if part != getattr(bare, step)}
    return {"scene": name} | {name: plain_config(part) for name, part in parts.items()} | of_look


def plain_config(config: Options) -> dict[str, Any]:
    """A configuration, ready for JSON."""
    found: dict[str, Any] = _plain(config)
    return found


def _plain(value: Any) -> Any:
    """A value of options, ready for JSON; as text if it has a text form."""
    if isinstance(value, Focus | Direction | WhereConfig):
        return str(value)
    if isinstance(value, Struct):
        return {name: _plain(item) for name, item in values_of(value).items()}
    if is_dataclass(value):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | int | float | None) else str(value)


def plain_camera(camera: Camera) -> dict[str, Any]:
    """A camera, ready for JSON."""
    return {
        "viewmat": np.asarray(camera.viewmat).tolist(),
        "K": np.asarray(camera.K).tolist(),
        "width": camera.width,
        "height": camera.height,
        "near": camera.near,
    }
