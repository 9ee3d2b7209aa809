"""Trained 3D Gaussian scenes in PLY files, in any of their layouts."""

import warnings
from dataclasses import dataclass
from pathlib import Path

from brushgs.errors import SceneError, SceneWarning
from brushgs.io.scenes.columns import Columns
from brushgs.io.scenes.encoding import STANDARD, Encoding
from brushgs.io.scenes.identify import open_ply
from brushgs.io.scenes.notes import LoadNotes
from brushgs.io.scenes.ply_compressed import is_compressed, read_compressed
from brushgs.io.scenes.ply_header import Element, Header, parse_header
from brushgs.io.scenes.ply_inria import check_is_scene, read_inria
from brushgs.io.scenes.ply_rows import warn_of_surplus
from brushgs.scene import SH_TERMS, Gaussians


def read_ply(path: str | Path, encoding: Encoding = STANDARD) -> tuple[Gaussians, LoadNotes]:
    """Read a trained 3D Gaussian scene from a PLY file.

    Read are the Inria layout (properties in any order and of any scalar type, spherical harmonics of
    degree 0 to 3, with or without normals, ASCII or binary of either byte order) and the compressed
    layout of PlayCanvas and SuperSplat. Rows with NaN, with infinity where it has no meaning, or with
    an all-zero rotation are left out with a SceneWarning. Bands of spherical harmonics that are zero
    in every row are left out, which changes no picture.

    Args:
        path: the file; its content decides, not its suffix.
        encoding: what the numbers mean, where the file does not follow the usual layout.

    Returns:
        The Gaussians as float32 in the order of the file, and what was found and left out.

    Raises:
        SceneError: if the file is not such a scene, is damaged, or no row of it can be drawn; or if a
            reading is asked for of a compressed file, whose layout leaves no choice.
    """
    source = _open_scene(Path(path))
    if not source.is_compressed:
        columns, dropped, num_terms_stored = read_inria(*source.place, encoding=encoding)
    elif encoding.is_standard:
        columns, dropped, num_terms_stored = read_compressed(*source.place)
    else:
        raise SceneError(
            path, "is a compressed PLY, which can be read in one way only; leave the reading out"
        )
    warn_of_surplus(source.path, source.header, source.size)
    dropped.report(source.path, source.vertex.count)
    gaussians = columns.gaussians()
    if encoding.is_standard and not source.is_compressed:
        _warn_of_other_reading(source.path, gaussians)
    notes = LoadNotes(
        format=source.format,
        rows_read=source.vertex.count,
        rows_dropped=dropped.num_rows,
        sh_degree_stored=SH_TERMS[num_terms_stored],
        sh_degree_used=gaussians.sh_degree,
        up=source.header.up,
        is_strokes=source.header.is_strokes,
    )
    return gaussians, notes


@dataclass(frozen=True)
class RawScene:
    """All rows of a scene file as they lie in it, neither checked nor decoded.

    Attributes:
        path: the file.
        columns: log-scales and logits, if the file follows the usual layout; all bands that it has.
        is_compressed: whether it is the compressed layout, which leaves no doubt what its numbers mean.
        format: layout and encoding in words.
        up: axis that the header names as up, "+x" to "-z", or None.
    """

    path: Path
    columns: Columns
    is_compressed: bool
    format: str
    up: str | None


def read_raw(path: str | Path) -> RawScene:
    """Read a scene file as `read_ply` does, but all of it and as it is.

    Raises:
        SceneError: if the file is not a 3D Gaussian scene or is damaged.
    """
    source = _open_scene(Path(path))
    read = read_compressed if source.is_compressed else read_inria
    columns, _, _ = read(*source.place, is_raw=True)
    warn_of_surplus(source.path, source.header, source.size)
    return RawScene(source.path, columns, source.is_compressed, source.format, source.header.up)


@dataclass(frozen=True)
class _Source:
    """Where the rows of a scene file lie."""

    path: Path
    header: Header
    vertex: Element
    size: int  # bytes of the whole file

    @property
    def is_compressed(self) -> bool:
        return is_compressed(self.header)

    @property
    def place(self) -> tuple[Path, Header, Element, int]:
        return self.path, self.header, self.vertex, self.size

    @property
    def format(self) -> str:
        layout = "compressed PLY" if self.is_compressed else "PLY"
        return f"{layout}, {_ENCODINGS[self.header.encoding]}"


def _open_scene(path: Path) -> _Source:
    """Read the header, and refuse what is no 3D Gaussian scene."""
    with open_ply(path) as file:
        header = parse_header(file, path)
        size = file.seek(0, 2)
    vertex = header.find("vertex")
    if vertex is None:
        names = ", ".join(element.name for element in header.elements) or "none"
        raise SceneError(path, f"has no element 'vertex' among: {names}; export it as a 3D Gaussian scene")
    if vertex.count == 0:
        raise SceneError(
            path, "holds no Gaussians: its header says 'element vertex 0'; export the scene again"
        )
    if not is_compressed(header):
        check_is_scene(path, header, vertex)
    return _Source(path, header, vertex, size)


def _warn_of_other_reading(path: Path, gaussians: Gaussians) -> None:
    """Warn of a file whose numbers cannot be what the usual layout says; only where that is certain.

    Read as a log, a scale is at least 1; read as a logit, an opacity lies in 0.5 to 0.7311. No trained
    scene has all of its rows there; a few rows made by hand may. Colours of 0 to 255 read as coefficients
    are blinding. Looked at are the least and largest opacity and scale, and some colours: 1 % of the loading.
    """
    if len(gaussians) < _FEW_ROWS:
        return
    seems = []
    low, high = gaussians.opacities.min(), gaussians.opacities.max()
    if low >= 0.5 and high <= _SIGMOID_OF_1:
        is_fog = gaussians.scales.min() >= 1
        if is_fog or high - low > _SPREAD:
            seems.append("scales and opacities" if is_fog else "opacities")
    colors = gaussians.sh[:_SOME_ROWS, 0]
    if colors.min() >= 0 and colors.max() > _BLINDING:
        seems.append("colours")
    if seems:
        message = f"{' and '.join(seems)} seem to be stored as they are, so the picture will be a fog"
        cure = f"'brushgs doctor {path} --fix cured.ply' cures it"
        warnings.warn(SceneWarning(f"{path}: {message}; {cure}"), stacklevel=3)


_SIGMOID_OF_1 = 0.7310587
_SPREAD = 0.01  # equal opacities may be anything, and are what scripts write
_BLINDING = 16.0  # a coefficient of 16 is five times as bright as white; trained scenes reach 12.6
_FEW_ROWS = 10
_SOME_ROWS = 4096
_ENCODINGS = {
    "ascii": "ASCII",
    "binary_little_endian": "binary little-endian",
    "binary_big_endian": "binary big-endian",
}
