"""What the commands that measure share: a report with figures, its settings, and the files it goes to."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from brushgs import __version__
from brushgs.errors import SceneError
from brushgs.io.files import replacing
from brushgs.measure.plotting import check_plot
from brushgs.options.choices import REPORT_SUFFIXES
from brushgs.painting.outputs import check_folder, check_output
from brushgs.painting.report import Report
from brushgs.scene import Camera

if TYPE_CHECKING:
    from rich.console import Console

PLOT = ".png"


@dataclass
class ExperimentReport(Report):
    """A run, and what it found.

    Attributes:
        result: the figures, with a method `as_dict`; None until they are there.
        settings: all that a reader needs to repeat them, ready for JSON.
    """

    name: ClassVar[str]  # of the figures in the JSON, and of the files in a folder
    schema: ClassVar[int]  # of the figures; grows when a field changes its meaning
    result: Any = None
    settings: dict[str, Any] = field(default_factory=dict)

    def as_json(self) -> str:
        """The figures, the settings and the stages for machines: one JSON object."""
        value = json.loads(super().as_json()) | {"schema": self.schema, "brushgs": __version__}
        found = {} if self.result is None else {self.name: self.result.as_dict()}
        return json.dumps(value | {"settings": self.settings} | found, indent=2)

    def print_table(self) -> None:
        """Draw the stages and the figures on stderr."""
        super().print_table()
        if self.result is None:
            return
        from rich.console import Console

        console = Console(stderr=True, highlight=False)
        if not console.is_terminal:
            console.width = 120
        self.print_figures(console)

    def print_figures(self, console: "Console") -> None:
        """Draw the figures, which are there."""
        raise NotImplementedError


@dataclass(frozen=True)
class Outputs:
    """Files that a report is written to, by suffix: one that was named, or those of a folder.

    Attributes:
        paths: by suffix, such as ".json" and ".png".
        folder: that is made if missing; None where a single file is asked for.
    """

    paths: dict[str, Path]
    folder: Path | None = None

    @classmethod
    def of(cls, output: Path, name: str, *, wants_plot: bool) -> "Outputs":
        """A file with a suffix of this report, see `REPORT_SUFFIXES`, or a folder that gets one of each.

        Raises:
            ValueError: if the suffix is another one, or the plot alone is asked for and not wanted.
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

    @property
    def plot(self) -> Path | None:
        """The plot; None where there is none."""
        return self.paths.get(PLOT)

    def check(self, inputs: tuple[Path, ...]) -> None:
        """Refuse what could not be written, before the work for it is done.

        Raises:
            SceneError: if a folder is missing or read-only, or an output is one of the inputs.
            ValueError: if a plot is wanted that cannot be drawn.
        """
        if self.plot is not None:
            check_plot()
        for suffix, path in self.paths.items():
            if self.folder is not None and not self.folder.exists():  # made when there is something for it
                check_folder(path.resolve().parent.parent, path)
            else:
                check_output(path, (suffix,), inputs)

    def make_folder(self) -> None:
        """Make the folder, if one is asked for.

        Raises:
            SceneError: if it cannot be made.
        """
        if self.folder is None:
            return
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as error:
            raise SceneError(self.folder, f"the folder cannot be made: {error.strerror}") from None

    def write_text(self, suffix: str, text: str) -> None:
        """Write the file of a suffix, if it is wanted; it appears when it is whole.

        Raises:
            SceneError: if it cannot be written.
        """
        if suffix not in self.paths:
            return
        with replacing(self.paths[suffix]) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="")


def plain_config(config: Any) -> dict[str, Any]:
    """A configuration, ready for JSON."""
    values = asdict(config)
    return {name: str(value) if isinstance(value, Path) else value for name, value in values.items()}


def plain_camera(camera: Camera) -> dict[str, Any]:
    """A camera, ready for JSON."""
    return {
        "viewmat": np.asarray(camera.viewmat).tolist(),
        "K": np.asarray(camera.K).tolist(),
        "width": camera.width,
        "height": camera.height,
        "near": camera.near,
    }
