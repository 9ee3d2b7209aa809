"""`brushgs stability`: a scene file becomes a table, a JSON file and a plot."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from brushgs import __version__
from brushgs.background import check_background
from brushgs.config import PaintConfig, PathConfig, StabilityConfig
from brushgs.errors import SceneError
from brushgs.io.atomic import replacing
from brushgs.paths import CameraPath, plan_path
from brushgs.pipeline import check_folder, check_output, input_files
from brushgs.report import Report
from brushgs.scene import Camera, Gaussians
from brushgs.stability.figures import SCHEMA, Stability
from brushgs.stability.measure import check_cameras, measure_stability, painted_frames
from brushgs.stability.painters import Easel
from brushgs.stability.plot import check_plot, write_plot
from brushgs.stages import cluster_scene, load_scene, open_ground, open_stroke, prune_scene

FILE_NAME = "stability"  # of the files in a folder


@dataclass
class StabilityReport(Report):
    """A run, and what it found.

    Attributes:
        result: the figures; None until they are there.
        settings: all that a reader needs to repeat them, ready for JSON.
    """

    result: Stability | None = None
    settings: dict[str, Any] = field(default_factory=dict)

    def as_json(self) -> str:
        """The figures, the settings and the stages for machines: one JSON object."""
        value = json.loads(super().as_json()) | {"schema": SCHEMA, "brushgs": __version__}
        found = {} if self.result is None else {"stability": self.result.as_dict()}
        return json.dumps(value | {"settings": self.settings} | found, indent=2)

    def print_table(self) -> None:
        """Draw the stages and the figures on stderr."""
        super().print_table()
        if self.result is None:
            return
        from rich.console import Console

        from brushgs.stability.table import stability_table

        console = Console(stderr=True, highlight=False)
        if not console.is_terminal:
            console.width = 120
        console.print(stability_table(self.result), markup=False)


@dataclass(frozen=True)
class Outputs:
    """Files that a report is written to; None for those that are not wanted."""

    figures: Path | None  # JSON
    plot: Path | None  # PNG

    @classmethod
    def of(cls, output: Path, *, wants_plot: bool) -> "Outputs":
        """A .json file, a .png file, or a folder with both.

        Raises:
            ValueError: if the suffix is another one, or the plot alone is asked for and not wanted.
        """
        suffix = output.suffix.lower()
        if suffix == ".json" and not output.is_dir():
            return cls(output, None)
        if suffix == ".png" and not output.is_dir():
            if not wants_plot:
                raise ValueError(f"--no-plot must not stand beside an output that is a plot, got '{output}'")
            return cls(None, output)
        if suffix and not output.is_dir():
            raise ValueError(f"output must be a folder or end in .json, .png, got '{output}'")
        plot = output / f"{FILE_NAME}.png" if wants_plot else None
        return cls(output / f"{FILE_NAME}.json", plot)

    def check(self, inputs: tuple[Path, ...]) -> None:
        """Refuse what could not be written, before the work for it is done.

        Raises:
            SceneError: if a folder is missing or read-only, or an output is one of the inputs.
            ValueError: if a plot is wanted that cannot be drawn.
        """
        if self.plot is not None:
            check_plot()
        for path in (self.figures, self.plot):
            if path is None:
                continue
            if path.stem == FILE_NAME and not path.parent.exists():  # made when there is something to put in
                check_folder(path.resolve().parent.parent, path.parent)
            else:
                check_output(path, (".json", ".png"), inputs)


def report_stability(
    scene: str | Path,
    output: str | Path,
    paint: PaintConfig,
    path: PathConfig,
    config: StabilityConfig | None = None,
    *,
    report: StabilityReport | None = None,
    wants_plot: bool = True,
) -> StabilityReport:
    """Measure how still the strokes of a scene hold along a path; write figures and plot.

    Args:
        scene: a trained 3D Gaussian scene.
        output: a folder, which gets `stability.json` and `stability.png` and is made if missing; or one file
            that ends in .json or .png.
        paint: pruning, strokes, view and stroke; its lock is not looked at, all are painted.
        path: the way of the camera.
        config: what is measured.
        report: where the stages are told; a new one if None.
        wants_plot: whether a folder gets the plot, which needs matplotlib.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    config, report, output = config or StabilityConfig(), report or StabilityReport(), Path(output)
    outputs = Outputs.of(output, wants_plot=wants_plot)
    outputs.check(input_files(scene, paint))
    check_background(paint.draw.background)
    if paint.draw.background == "transparent":
        raise ValueError("background must be a colour or an image to compare pictures on, got transparent")
    texture = open_stroke(paint.draw, report)
    gaussians, file_up = load_scene(scene, report)
    way = _plan(gaussians, paint, path, file_up, report)
    ground = open_ground(paint.draw, way.cameras[0], report)
    assert ground is not None
    strokes = prune_scene(gaussians, paint.prune, report)
    strokes = cluster_scene(strokes, paint.cluster, report, num_loaded=len(gaussians))
    easel = Easel(gaussians, strokes, way.closed, texture, paint.draw, ground, paint.cluster.seed)
    report.settings = _settings(scene, paint, path, config, way)
    report.result = _measure(easel, config, report)
    _write(outputs, report, f"{Path(scene).stem}, {len(strokes):,} strokes of {texture.name}, {way.source}")
    report.output = str(output)
    if outputs.figures is not None:
        _write_figures(outputs.figures, report)
    return report


def _plan(
    gaussians: Gaussians, paint: PaintConfig, path: PathConfig, file_up: str | None, report: Report
) -> CameraPath:
    with report.stage("path") as stage:
        way = plan_path(gaussians, paint.view, path, file_up=file_up)
        check_cameras(way.closed)
        first = way.cameras[0]
        stage.did = f"{way.source}, {len(way.cameras)} views, {first.width}x{first.height}"
        stage.counts = {
            "source": way.source,
            "views": len(way.cameras),
            "loop": way.is_loop,
            "width": first.width,
            "height": first.height,
        }
    return way


def _measure(easel: Easel, config: StabilityConfig, report: Report) -> Stability:
    num_painted = painted_frames(easel.cameras, config)
    with report.stage("measure", frames=num_painted) as stage:
        result = measure_stability(easel, config, advance=report.advance)
        num_pairs = len(result.starts)
        stage.did = (
            f"{num_painted} frames in {len(result.configurations)} configurations, {num_pairs} pairs a gap"
        )
        stage.counts = {"frames": num_painted, "pairs": num_pairs, "stride": result.stride}
        num_left = len(easel.cameras) - num_painted
        if num_left:
            stage.left_out.append(f"painting {num_left} frames: no pair needs them (--pairs)")
    return result


def _settings(
    scene: str | Path, paint: PaintConfig, path: PathConfig, config: StabilityConfig, way: CameraPath
) -> dict[str, Any]:
    """All that a reader needs to repeat the figures."""
    return {
        "scene": str(scene),
        "prune": _plain(asdict(paint.prune)),
        "cluster": _plain(asdict(paint.cluster)),
        "draw": _plain(asdict(paint.draw)),
        "view": _plain(asdict(paint.view)),
        "path": _plain(asdict(path)) | {"source": way.source},
        "measure": _plain(asdict(config)),
        "first_camera": _camera(way.cameras[0]),
        "last_camera": _camera(way.cameras[-1]),
    }


def _camera(camera: Camera) -> dict[str, Any]:
    return {
        "viewmat": np.asarray(camera.viewmat).tolist(),
        "K": np.asarray(camera.K).tolist(),
        "width": camera.width,
        "height": camera.height,
        "near": camera.near,
    }


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """The same, ready for JSON."""
    return {name: str(value) if isinstance(value, Path) else value for name, value in values.items()}


def _write(outputs: Outputs, report: StabilityReport, title: str) -> None:
    """The folder, if one is asked for, and the plot."""
    with report.stage("write") as stage:
        folder = (outputs.figures or outputs.plot or Path()).parent
        try:
            folder.mkdir(exist_ok=True)
        except OSError as error:
            raise SceneError(folder, f"the folder cannot be made: {error.strerror}") from None
        if outputs.plot is not None and report.result is not None:
            write_plot(report.result, outputs.plot, title)
        written = [str(path) for path in (outputs.figures, outputs.plot) if path is not None]
        stage.did = " and ".join(written)
        stage.counts = {"paths": written}
        if outputs.plot is None:
            stage.left_out.append("plot: not asked for")


def _write_figures(path: Path, report: StabilityReport) -> None:
    with replacing(path) as temporary:
        temporary.write_text(report.as_json() + "\n", encoding="utf-8")
