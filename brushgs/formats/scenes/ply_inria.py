"""The standard layout of a 3D Gaussian scene in a PLY file: one property per number.

Scales are stored as logs, opacities as logits, and the spherical harmonics above degree 0 (f_rest)
channel by channel. Properties are found by name, not by position. Scenes of 2D Gaussians (flat discs) have
two scales, or a third one that is ignored. Scenes of Mip-Splatting also store the width of a 3D smoothing
filter.
Source: Kerbl et al. 2023, Yu et al. 2024, Huang et al. 2024, layouts of the reference implementations.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding, check_decoded_size
from brushgs.formats.scenes.ply_header import BRUSH, Element, Header, check_size, open_rows
from brushgs.formats.scenes.rows import Decoder, RowSource
from brushgs.values.arrays import F32

_MEANS = ("x", "y", "z")
_COLORS = ("f_dc_0", "f_dc_1", "f_dc_2")
_SCALES = ("scale_0", "scale_1", "scale_2")
FILTER_3D = "filter_3D"  # standard deviation of Mip-Splatting's smoothing filter, world units, no logarithm
_QUATS = ("rot_0", "rot_1", "rot_2", "rot_3")
_NUM_REST = {0: 1, 9: 4, 24: 9, 45: 16}  # f_rest properties -> spherical-harmonic terms
# Small enough that a block stays in the cache while it is decoded and checked, large enough that the cost of
# some fifty calls per block is negligible.
_BLOCK_BYTES = 1 << 21
_LONG_RUN = 5  # columns; shorter runs are copied faster column by column, with a long inner loop


def check_inria(path: Path, header: Header, vertex: Element) -> int:
    """The number of spherical-harmonic terms of each row.

    Raises SceneError for meshes, plain point clouds and scenes that lack a property; the message says which.
    """
    names = set(vertex.names)
    if not names & {*_SCALES, *_QUATS, *_COLORS}:
        faces = header.find("face")
        if faces is not None and faces.count:
            what = f"is a mesh ({faces.count} faces), not a 3D Gaussian scene"
            raise SceneError(path, f"{what}; train a scene from pictures of it first")
        if names >= set(_MEANS):
            what = "is a plain point cloud without scales and rotations"
            raise SceneError(path, f"{what}; train it as a 3DGS scene first")
    for name in (*_MEANS, *_COLORS, "opacity", *_SCALES[:2], *_QUATS):
        if name not in names:
            fault = f"property {name!r} is a list" if name in vertex.lists else ""
            fault = fault or f"no property {name!r} among {len(names)} read"
            raise SceneError(path, f"{fault}; export it as a 3D Gaussian scene")
    return count_terms(path, vertex)


def is_flat(header: Header, vertex: Element) -> bool:
    """Whether the Gaussians are flat discs: a comment says so, or they have two scales."""
    has_two = _SCALES[0] in vertex.names and _SCALES[2] not in vertex.names  # a compressed PLY has no scale_0
    return header.training == "2dgs" or has_two


def read_columns_of(num_terms: int, vertex: Element) -> set[str]:
    """Names of the columns that are read from a scene with `num_terms` spherical-harmonic terms."""
    rest = (name for channel in range(3) for name in _names_of_rest(channel, num_terms, 1, num_terms))
    brush = (BRUSH,) if has_brushes(vertex) else ()
    return {*_MEANS, *_COLORS, *rest, "opacity", *_SCALES, *_QUATS, FILTER_3D, *brush}


def has_brushes(vertex: Element) -> bool:
    """Whether the rows have a column of brushes, as written by brushgs: one byte each."""
    return BRUSH in vertex.names and vertex.dtype[BRUSH] == np.uint8


def count_terms(path: Path, element: Element) -> int:
    """Number of spherical-harmonic terms of an element, from its f_rest properties.

    Raises SceneError if these do not make up complete bands of degree 0 to 3.
    """
    rest = {name for name in element.names if name.startswith("f_rest_")}
    expected = {f"f_rest_{index}" for index in range(len(rest))}
    if len(rest) not in _NUM_REST or rest != expected:
        gap = f" and no {min(expected - rest)!r}" if rest != expected else ""
        rule = f"must have 0, 9, 24 or 45 f_rest properties (degree 0 to 3), got {len(rest)}{gap}"
        raise SceneError(path, f"{rule}; export it with complete bands of spherical harmonics")
    return _NUM_REST[len(rest)]


def open_inria(
    path: Path, header: Header, vertex: Element, num_terms: int, size: int, encoding: Encoding
) -> RowSource:
    """The rows of element `vertex`; `size` is the file size in bytes.

    Raises SceneError if the file is cut off or a value is no number.
    """
    check_size(path, header, vertex, size)
    check_decoded_size(path, vertex.count, num_terms, size)
    has_filter = FILTER_3D in vertex.names

    @cache
    def layout_of(num_used: int) -> _RowLayout:
        return _RowLayout(vertex.dtype, num_terms, num_used, is_flat=is_flat(header, vertex))

    def decode(rows: NDArray[np.void], out: Columns) -> None:
        if out.brushes is not None:
            out.brushes[:] = rows[BRUSH]
        layout = layout_of(out.sh.shape[1])
        layout.decode(rows, out, flat=0 if encoding.scales == "linear" else -np.inf)
        if has_filter:  # the formula needs standard values
            out.standardize(encoding)
            _smooth(out, rows[FILTER_3D])

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        with open_rows(path, header, vertex, _block_rows(vertex)) as rows:
            yield lambda start, stop, out: decode(rows.read(start, stop), out)

    return RowSource(
        vertex.count,
        num_terms,
        open_decoder,
        _block_rows(vertex),
        encoding=STANDARD if has_filter else encoding,
        is_logit=True,
        is_sequential=header.is_ascii,
        has_brushes=has_brushes(vertex),
        count_used=lambda: _count_used_terms(path, header, vertex, num_terms),
    )


def _block_rows(vertex: Element) -> int:
    return max(_BLOCK_BYTES // vertex.dtype.itemsize, 1)


def _smooth(out: Columns, widths: NDArray[Any]) -> None:
    """Apply the 3D smoothing filter of training to Gaussians (log-scales and logits), in place.

    Scales s become sqrt(s^2 + f^2). Opacities are multiplied by the square root of the ratio of the
    covariance determinants: the product of the old scales divided by the product of the new ones. A NaN width
    gives a row that is dropped later.
    Source: Yu et al. 2024, Mip-Splatting, section 5.1.
    """
    logs, widths = out.scales.astype(np.float64), np.abs(widths.astype(np.float64))
    smoothed = 0.5 * np.logaddexp(2 * logs, 2 * np.log(widths)[:, None])
    ratios = np.where(smoothed == -np.inf, 0, logs - smoothed).sum(axis=1)  # scales of 0 that stay 0: ratio 1
    # The log opacity of a logit is -log(1 + exp(-logit)).
    log_opacities = ratios - np.logaddexp(0, -out.opacities.astype(np.float64))
    out.scales[:] = smoothed
    out.opacities[:] = log_opacities - np.log(-np.expm1(log_opacities))


class _Run(NamedTuple):
    """Properties of one type at equal distances in a row, which are copied together."""

    columns: slice  # target columns
    dtype: np.dtype[Any]
    offset: int  # bytes from the start of a row
    step: int  # bytes from one property to the next


class _RowLayout:
    """The places of the properties in a row and their target columns, computed once per file."""

    def __init__(self, dtype: np.dtype[Any], num_terms: int, num_used: int, *, is_flat: bool) -> None:
        scales = _SCALES[:2] if is_flat else _SCALES
        self.means, self.quats, self.scales, self.opacities, self.colors = (
            _find_runs(dtype, names) for names in (_MEANS, _QUATS, scales, ("opacity",), _COLORS)
        )
        self.is_flat = is_flat
        self.rest = [
            _find_runs(dtype, _names_of_rest(channel, num_terms, 1, num_used)) for channel in range(3)
        ]

    def decode(self, rows: NDArray[np.void], out: Columns, *, flat: float) -> None:
        """Copy the properties of some rows to their columns; `flat` is the third scale of flat discs."""
        _copy(rows, self.means, out.means)
        _copy(rows, self.quats, out.quats)
        _copy(rows, self.scales, out.scales)
        if self.is_flat:
            out.scales[:, 2] = flat
        _copy(rows, self.opacities, out.opacities[:, None])
        _copy(rows, self.colors, out.sh[:, 0])
        for channel, runs in enumerate(self.rest):
            # One channel at a time: an inner loop of length 15 in place of 3 takes a third of the time.
            _copy(rows, runs, out.sh[:, 1:, channel])


def _find_runs(dtype: np.dtype[Any], names: tuple[str, ...]) -> list[_Run]:
    """Split properties into as few runs as possible, in order; files by trainers need one run."""
    runs: list[_Run] = []
    fields = dtype.fields
    assert fields is not None
    for column, name in enumerate(names):
        dtype_here, offset = fields[name][:2]
        if runs and runs[-1].dtype == dtype_here:
            last = runs[-1]
            count = column - last.columns.start
            step = last.step if count > 1 else offset - last.offset
            if offset == last.offset + count * step:
                runs[-1] = _Run(slice(last.columns.start, column + 1), dtype_here, last.offset, step)
                continue
        runs.append(_Run(slice(column, column + 1), dtype_here, offset, 0))
    return runs


def _copy(rows: NDArray[np.void], runs: list[_Run], out: F32) -> None:
    """Copy the properties of some rows to the columns of `out`."""
    for run in runs:
        view = _view(rows, run)
        if view.shape[1] >= _LONG_RUN:
            out[:, run.columns] = view
            continue
        for index in range(view.shape[1]):
            out[:, run.columns.start + index] = view[:, index]


def _view(rows: NDArray[np.void], run: _Run) -> NDArray[Any]:
    """The properties of a run, [rows, properties]."""
    width = run.columns.stop - run.columns.start
    data = rows.view(np.uint8).data  # of rows themselves NumPy refuses it if a property has ":" in its name
    return np.ndarray((len(rows), width), run.dtype, data, run.offset, (rows.itemsize, run.step))


def _names_of_rest(channel: int, num_terms: int, start: int, stop: int) -> tuple[str, ...]:
    """Names of the properties that hold terms `start` to `stop` of one channel."""
    first = channel * (num_terms - 1) - 1
    return tuple(f"f_rest_{first + term}" for term in range(start, stop))


def _count_used_terms(path: Path, header: Header, vertex: Element, num_terms: int) -> int:
    """The number of terms up to the highest band that is not zero in every row.

    Reading stops when the highest band has a nonzero value: for most scenes after the first block.
    """
    bands = {}  # number of terms up to and including a band -> runs of the band in a row
    for degree in (3, 2, 1):
        start, stop = degree**2, (degree + 1) ** 2
        if stop <= num_terms:
            channels = [_names_of_rest(channel, num_terms, start, stop) for channel in range(3)]
            bands[stop] = [run for names in channels for run in _find_runs(vertex.dtype, names)]
    used, block_rows = 1, _block_rows(vertex)
    # A signalling NaN should not raise a warning here.
    with np.errstate(all="ignore"), open_rows(path, header, vertex, block_rows) as rows:
        for start in range(0, vertex.count, block_rows):
            if used == num_terms:
                break
            block = rows.read(start, min(start + block_rows, vertex.count))
            higher = [stop for stop in bands if stop > used]
            used = next(
                (stop for stop in higher if any(_view(block, run).any() for run in bands[stop])), used
            )
    return used
