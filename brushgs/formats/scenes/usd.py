"""Gaussians in USD stages: prims of the type ParticleField3DGaussianSplat, of USD 26.03 and newer.

Scales and opacities are linear, of float32 or of float16. Every prim is placed by its xform; of what changes
in time the first moment is read. Source: OpenUSD, UsdVol.
"""

import json
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.json_file import parse_json
from brushgs.formats.scenes.columns import Columns, check_decoded_size
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import STANDARD, Encoding
from brushgs.formats.scenes.fill import Decoder, fill
from brushgs.formats.scenes.gltf_placed import Placement
from brushgs.formats.scenes.parts import fill_parts
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.stored import MAX_TEXT
from brushgs.formats.scenes.upright_notes import is_turned_by, read_notes
from brushgs.formats.scenes.used_terms import drop_zero_bands
from brushgs.formats.usd.process import Answer, reading
from brushgs.values.arrays import F64

_BLOCK_ROWS = 1 << 13
_ENCODING = Encoding("linear", "linear", "xyzw", "sh")
# Numbers may have two bytes, and USD packs those that repeat.
_MAX_GROWTH = 20
_COLUMNS = "means", "quats", "scales", "opacities", "sh"


@dataclass(frozen=True)
class _Part:
    """The splats of one prim: columns as stored, [N, ...], and the matrix [4, 4], world from splats."""

    columns: dict[str, NDArray[Any]]
    matrix: F64

    @property
    def num_rows(self) -> int:
        return len(self.columns["means"])

    @property
    def num_terms(self) -> int:
        return int(self.columns["sh"].shape[1])

    def read(self, columns: Columns, *, is_raw: bool) -> tuple[Columns, Dropped]:
        """Decode into columns of as many rows; see `ColumnReader`."""
        return fill(
            columns,
            lambda: nullcontext(self._decoder()),
            block_rows=_BLOCK_ROWS,
            num_rest=columns.sh.shape[1] - 1,
            is_sequential=False,
            is_logit=True,
            encoding=STANDARD,
            is_raw=is_raw,
        )

    def _decoder(self) -> Decoder:
        placement = Placement(self.matrix)

        def decode(start: int, stop: int, out: Columns) -> None:
            for name in _COLUMNS[:-1]:
                getattr(out, name)[:] = self.columns[name][start:stop]
            out.sh[:, : self.num_terms] = self.columns["sh"][start:stop]
            out.sh[:, self.num_terms :] = 0
            out.standardize(_ENCODING)
            placement.apply(out, self.num_terms)

        return decode


def open_scene(path: Path) -> SceneFile:
    """Read the splats of a stage.

    Raises:
        SceneError: if the package usd-core is missing, or the stage is damaged or holds no splats.
    """
    with reading(path, "splats") as answer:
        parts = [_open_part(path, answer, index) for index in range(len(answer.header["parts"]))]
        up, notes = answer.header["up"], [part["notes"] for part in answer.header["parts"]]
    if not parts:
        fact = "is a USD stage without Gaussian splats (ParticleField3DGaussianSplat)"
        raise SceneError(path, f"{fact}; export the splats as .ply or .usdc of USD 26.03")
    stored, turn = read_notes(path, _parsed(notes[0]))
    is_ours = turn is not None and len(parts) == 1 and is_turned_by(parts[0].matrix, turn)
    if is_ours:
        parts = [_Part(parts[0].columns, np.eye(4))]
    elif turn is not None:  # something else was added, or it was moved
        stored = stored._replace(first_view=None, counts=None, brushes=())
    num_rows, num_terms = sum(part.num_rows for part in parts), max(part.num_terms for part in parts)
    check_decoded_size(path, num_rows, num_terms, path.stat().st_size, max_growth=_MAX_GROWTH)

    def read_columns(*, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
        readers = [(part.num_rows, partial(part.read, is_raw=is_raw)) for part in parts]
        columns, dropped = fill_parts(readers, num_terms, stored.rows_of_brushes(num_rows))
        if not is_raw:
            drop_zero_bands(columns)
        return stored.in_order(columns), dropped

    return SceneFile(
        path=path,
        format="USD with ParticleField3DGaussianSplat",
        num_rows=num_rows,
        num_terms=num_terms,
        read_columns=read_columns,
        up=None if is_ours or up is None else f"+{up.lower()}",
        is_strokes=stored.is_strokes,
        training="antialiased" if stored.antialiased else "default",
        scene=stored.scene,
        first_view=stored.first_view,
        brushes=stored.brushes,
    )


def _open_part(path: Path, answer: Answer, index: int) -> _Part:
    matrix = answer.array(f"matrix_{index}")
    if not np.isfinite(matrix).all():
        raise SceneError(path, "its prims scale beyond all numbers; export it again")
    return _Part({name: answer.array(f"{name}_{index}") for name in _COLUMNS}, matrix)


def _parsed(notes: str | None) -> object:
    """The object in the text of a prim of ours; None where there is none."""
    try:
        return None if notes is None or len(notes) > MAX_TEXT else parse_json(notes)
    except (json.JSONDecodeError, RecursionError):
        return None
