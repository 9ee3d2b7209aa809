"""The checkpoint of a refinement: a file with the state and the inputs of its fit.

It is written every `SECONDS_BETWEEN_CHECKPOINTS` and when a run is stopped, and removed after its strokes are
written: a killed run loses at most these seconds.
"""

from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import is_plain, replacing
from brushgs.options.experiments import RefineConfig
from brushgs.options.painting import PaintConfig, Up
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.styling import MAX_STYLES
from brushgs.pipeline.clip import Clip, files_of
from brushgs.pipeline.prepare import Prepared
from brushgs.pipeline.resume import (
    content_of,
    describe_options,
    differences,
    digest,
    motion_digest,
    named_digest,
    named_file_digest,
)
from brushgs.values.gaussians import Gaussians

SECONDS_BETWEEN_CHECKPOINTS = 20.0
# Options without influence on a fit: it draws by depth, on white. And files, which are compared by their
# content.
MORE_STYLES = tuple(f"style image {number}" for number in range(2, MAX_STYLES + 1))
_NOT_OF_A_FIT = "background", "order", "stroke", "palette file"
_STROKES, _MOTION = "result of clustering", "motion"  # compared last: they derive from all others


class Checkpoint:
    """The checkpoint of one fit.

    Attributes:
        path: the file.
        state: of the resumed fit; None for a new one.
        step: of the state in the file; None without a state of this fit.
    """

    def __init__(self, path: Path, fit: Mapping[str, Any] | None = None) -> None:
        """Name a checkpoint; nothing is read or written yet.

        Args:
            path: the file.
            fit: inputs of the fit, see `describe_fit`.
        """
        self.path, self._fit = path, dict(fit or {})
        self.state: dict[str, Any] | None = None
        self.step: int | None = None

    def read(self) -> None:
        """Read the state from the file.

        Raises:
            SceneError: if it cannot be read, is not a checkpoint, or belongs to another fit.
        """
        import torch

        try:
            content = torch.load(self.path, weights_only=True)
            found, state = content["fit"], content["state"]
            given = {name: value for name, value in self._fit.items() if name not in (_STROKES, _MOTION)}
            differing = differences(found, given) or differences(found, self._fit)
            step = int(state["step"])
        except Exception as error:  # torch raises anything for invalid files
            raise self.unreadable(error) from None
        if differing:
            raise SceneError(
                self.path,
                f"is the checkpoint of another fit ({differing}); give the scene and the options it was "
                "started with, or omit --resume to start anew",
            )
        self.state, self.step = state, step

    def save(self, state: dict[str, Any]) -> None:
        """Write a state, which has a "step".

        Raises:
            SceneError: if the file cannot be written.
        """
        import torch

        with replacing(self.path) as temporary:
            torch.save({"fit": self._fit, "state": state}, temporary)
        self.step = state["step"]

    def remove(self) -> None:
        """Remove the file after the result is written."""
        self.path.unlink(missing_ok=True)
        self.step = None

    def unreadable(self, error: Exception) -> SceneError:
        """The error for an invalid checkpoint."""
        return SceneError(self.path, f"is no checkpoint ({error}); delete it, or omit --resume")

    @property
    def advice(self) -> str:
        """How to resume; "" while there is nothing to resume."""
        return "" if self.step is None else f"--resume continues from step {self.step:,}: {self.path}"


def describe_fit(
    scene: SceneFiles | Clip,
    paint: PaintConfig,
    config: RefineConfig,
    prepared: Prepared,
    target: Gaussians,
    up: Up,
) -> dict[str, Any]:
    """All inputs of a fit: options, and digests of intermediate results.

    Args:
        scene: the files of the scene, or a moving scene.
        paint: how strokes are made and drawn.
        config: of the fit.
        prepared: the strokes and the stroke image.
        target: the scene to fit to, in the colors of the palette.
        up: of the views.
    """
    clip = scene.config if isinstance(scene, Clip) else None
    described_options = describe_options(paint, clip=clip)
    options = {name: value for name, value in described_options.items() if name not in _NOT_OF_A_FIT}
    where = None if config.where is None else str(config.where)
    fit = {name: _plain(value) for name, value in asdict(replace(config, where=None)).items()}
    fit |= {"steps": config.most_steps, "where": where}
    for name in ("is_resumed", "style", "weights", "regions"):
        del fit[name]
    fit |= {
        "rates": ",".join(map(str, config.rates)),
        "region rates": ";".join(map(str, config.region_rates)),
    }
    del fit["region_rates"]
    texture = prepared.texture
    paths = () if (source := files_of(scene)) is None else SceneSource.of(source).paths
    names = " ".join(path.name for path in paths)
    described: dict[str, Any] = {
        "scene": named_digest(names, *content_of(prepared.whole_scene)),
        "stroke": named_digest(
            texture.name, *texture.coverages, np.frombuffer(texture.kind.encode(), np.uint8)
        ),
        _STROKES: digest(*content_of(prepared.strokes), *content_of(target)),
        "up": _plain(up),
    }
    if prepared.moving is not None:
        described[_MOTION] = motion_digest(prepared.moving)
    if config.style is not None and config.style.only is None:
        described["style shares"] = str(config.style)
    for name, path in _files_of(paint, config).items():
        # Missing files are refused by the step that opens them.
        described[name] = None if path is None or not is_plain(path) else named_file_digest(path)
    return described | {name: _plain(value) for name, value in options.items()} | fit


def _files_of(paint: PaintConfig, config: RefineConfig) -> dict[str, Path | None]:
    """The files that a fit depends on beside its scene."""
    palette = None if paint.palette is None else paint.palette.file
    styles = () if config.style is None else config.style.files
    named = dict(zip(("style image", *MORE_STYLES), styles, strict=False))
    return {"palette": palette, "style image": None, "VGG weights": config.weights} | named


def _plain(value: Any) -> Any:
    """A value in the form stored by a checkpoint: a number, text or None."""
    return value if value is None or isinstance(value, bool | int | float | str) else str(value)
