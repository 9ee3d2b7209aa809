"""Trained 3D Gaussian scenes in PLY files, in any of their layouts."""

import warnings
from pathlib import Path

from brushgs.errors import SceneError, SceneWarning
from brushgs.io.compressed_ply import is_compressed, read_compressed
from brushgs.io.identify import open_ply
from brushgs.io.inria_ply import check_is_scene, read_inria
from brushgs.io.notes import LoadNotes
from brushgs.io.ply_header import parse_header
from brushgs.io.ply_rows import warn_of_surplus
from brushgs.scene import SH_TERMS, Gaussians


def read_ply(path: str | Path) -> tuple[Gaussians, LoadNotes]:
    """Read a trained 3D Gaussian scene from a PLY file.

    Read are the Inria layout (properties in any order and of any scalar type, spherical harmonics of
    degree 0 to 3, with or without normals, ASCII or binary of either byte order) and the compressed
    layout of PlayCanvas and SuperSplat. Rows with NaN, with infinity where it has no meaning, or with
    an all-zero rotation are left out with a SceneWarning. Bands of spherical harmonics that are zero
    in every row are left out, which changes no picture.

    Args:
        path: the file; its content decides, not its suffix.

    Returns:
        The Gaussians as float32 in the order of the file, and what was found and left out.

    Raises:
        SceneError: if the file is not such a scene, is damaged, or no row of it can be drawn.
    """
    path = Path(path)
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
    if is_compressed(header):
        layout, read = "compressed PLY", read_compressed
    else:
        check_is_scene(path, header, vertex)
        layout, read = "PLY", read_inria
    columns, dropped, num_terms_stored = read(path, header, vertex, size)
    warn_of_surplus(path, header, size)
    dropped.report(path, vertex.count)
    gaussians = columns.gaussians()
    _warn_if_decoded(path, gaussians)
    notes = LoadNotes(
        format=f"{layout}, {_ENCODINGS[header.encoding]}",
        rows_read=vertex.count,
        rows_dropped=dropped.num_rows,
        sh_degree_stored=SH_TERMS[num_terms_stored],
        sh_degree_used=gaussians.sh_degree,
        up=header.up,
    )
    return gaussians, notes


def _warn_if_decoded(path: Path, gaussians: Gaussians) -> None:
    """Warn of a file that seems to hold scales and opacities where their logs and logits belong.

    Read as a log, a scale is at least 1; read as a logit, an opacity lies in 0.5 to 0.7311. No trained
    scene has all of its rows there; a few rows made by hand may.
    """
    if len(gaussians) < _FEW_ROWS:
        return
    low, high = gaussians.opacities.min(), gaussians.opacities.max()
    if low >= 0.5 and high <= _SIGMOID_OF_1 and gaussians.scales.min() >= 1:
        message = "scales and opacities seem to be stored as they are, so the picture will be a fog"
        cure = "export the logs of the scales and the logits of the opacities"
        warnings.warn(SceneWarning(f"{path}: {message}; {cure}"), stacklevel=3)


_SIGMOID_OF_1 = 0.7310587
_FEW_ROWS = 10
_ENCODINGS = {
    "ascii": "ASCII",
    "binary_little_endian": "binary little-endian",
    "binary_big_endian": "binary big-endian",
}
