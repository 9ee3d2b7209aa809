"""The table of formats of moving scenes. To add one: write a module beside this one, and its line here.

Its content decides of which format a path is, as for still scenes. Formats that need a network or a pickle
stand here too, with the export that would work: their files are refused by name, and never unpickled. Lists
and folders of scene files, one a moment, are no line of this table. Imports nothing heavy.
"""

import re
from pathlib import Path
from typing import NamedTuple

from brushgs.formats.files import is_dir, is_plain
from brushgs.formats.formats import (
    NUM_FIRST_BYTES,
    ZIP_BEGINNINGS,
    Matcher,
    any_of,
    begins_with,
    is_json_with,
    is_zip_with,
)
from brushgs.formats.scenes.formats import SCENE_SUFFIXES
from brushgs.options.choices import CLIP_FPS
from brushgs.options.table import listed

NOMINAL_RATE = CLIP_FPS  # moments a second where a format does not say
NOMINAL_FRAMES = 50  # from time 0 to 1, where a format does not say: SpaceTimeGaussian trains so many at once
_MAX_HEADER = 1 << 20  # bytes of a PLY header, as `ply_header` reads it
_PIECE = 1 << 14  # bytes read at a time: those of trainers have 2 KiB
_PICKLES = b"\x80\x02\x8a\nl\xfc\x9cF", b"\x80\x02}", b"\x80\x04\x95", b"\x80\x05\x95"
_OFTEN_PICKLES = ".pth", ".pt", ".ckpt", ".pkl", ".pickle"


class MovingFormat(NamedTuple):
    """A format of moving scenes.

    Attributes:
        name: as a sentence has it after an article, "a splaTV clip".
        suffixes: of its files, in lower case, the usual one first; none of a folder.
        matches: whether a path with these first bytes is of this format; a folder has no first bytes.
        reader: module of this package with `open_moving(path) -> MovingScene`; None if it is not read.
        note: which files of this format are read, for help texts.
        cure: why it is not read, and the export that would be: one clause; for formats without a reader.
        package: that decodes it and may not be installed; empty for none.
    """

    name: str
    suffixes: tuple[str, ...]
    matches: Matcher
    reader: str | None = None
    note: str = ""
    cure: str = ""
    package: str = ""


def is_ply_with(*names: str) -> Matcher:
    """Recognises PLY files by names of properties, all of which their headers must hold."""

    def matches(path: Path, begin: bytes) -> bool:
        return begin.startswith((b"ply\n", b"ply\r")) and _properties(path).issuperset(names)

    return matches


def _properties(path: Path) -> set[str]:
    """Names of all properties in the header of a PLY file."""
    header = b""
    try:
        with path.open("rb", buffering=0) as file:
            while b"end_header" not in header and len(header) < _MAX_HEADER:
                piece = file.read(_PIECE)
                if not piece:
                    break
                header += piece
    except OSError:
        return set()
    header = header.partition(b"end_header")[0]
    return {name.decode() for name in re.findall(rb"[\r\n]property[ \t]+\w+[ \t]+(\w+)", header)}


def holds(*patterns: str) -> Matcher:
    """Recognises folders by files in them, and these files by their names.

    Args:
        patterns: of paths from the folder; one of them must be there.
    """
    names = {pattern.rpartition("/")[2] for pattern in patterns}

    def matches(path: Path, begin: bytes) -> bool:
        if not is_dir(path):
            return path.name in names
        try:
            return any(next(path.glob(pattern), None) is not None for pattern in patterns)
        except OSError:
            return False

    return matches


def is_pickle(path: Path, begin: bytes) -> bool:
    """Whether a file is a pickle, or an archive that PyTorch keeps one in; it is not opened as such."""
    if is_dir(path):
        return False
    if begin.startswith(ZIP_BEGINNINGS):
        return is_zip_with("/data.pkl")(path, begin)
    suffix = path.suffix.lower()
    return suffix in _OFTEN_PICKLES or (begin.startswith(_PICKLES) and suffix not in SCENE_SUFFIXES)


_NETWORK = "whose motion is a network"
KNOWN_MOVING = (
    # What is refused stands before what it could be taken for.
    MovingFormat(
        "4DGaussians model",
        (".pth",),
        holds(
            *("deformation.pth", "iteration_*/deformation.pth", "point_cloud/iteration_*/deformation.pth"),
            *("deformation_table.pth", "deformation_accum.pth"),
        ),
        cure=f"{_NETWORK}; write its moments with export_perframe_3DGS.py of 4DGaussians, and name the folder"
        " gaussian_pertimestamp",
    ),
    MovingFormat(
        "Deformable-3DGS or SC-GS model",
        (".pth",),
        holds("deform.pth", "iteration_*/deform.pth", "deform/iteration_*/deform.pth"),
        cure=f"{_NETWORK}; write its deformed Gaussians with save_ply of its own code, a PLY file a moment,"
        " and name their folder",
    ),
    MovingFormat(
        "QUEEN model",
        (".pkl",),
        holds(
            *("compressed/point_cloud.pkl", "[0-9]*/compressed/point_cloud.pkl"),
            "frames/[0-9]*/compressed/point_cloud.pkl",
        ),
        cure="which needs its decoders; train it with --log_ply, and name the PLY files of its frames",
    ),
    MovingFormat(
        "GIFStream model",
        (),
        is_json_with("anchors", "time_features", file="meta.json"),
        cure=f"{_NETWORK}; write the Gaussians of each moment with its own code, a PLY file each, and name"
        " their folder",
    ),
    MovingFormat(
        "SpaceTimeGaussian PLY of the full model",
        (".ply",),
        any_of(is_ply_with("trbf_center", "f_t_0"), is_ply_with("trbf_center", "f_dc_3")),
        cure="whose colours are a network; train the model ours_lite, whose PLY files are read",
    ),
    MovingFormat(
        "SpaceTimeGaussian PLY",
        (".ply",),
        is_ply_with("trbf_center", "trbf_scale"),
        reader="spacetime",
        note=".ply of SpaceTimeGaussian lite",
    ),
    MovingFormat(
        "FreeTimeGS PLY",
        (".ftgs.ply",),
        is_ply_with("time", "log_duration", "velocity_0"),
        reader="freetime",
        note=".ftgs.ply of FreeTimeGS",
    ),
    MovingFormat(
        "splaTV clip", (".splatv",), begins_with(b"Kg\0\0"), reader="splatv", note=".splatv of splaTV"
    ),
    MovingFormat(
        "params.npz of Dynamic3DGaussians",
        (".npz",),
        is_zip_with("means3D.npy", ".npz"),
        reader="dynamic3d",
        note="params.npz of Dynamic3DGaussians",
    ),
    MovingFormat(
        ".4dgs scene",
        (".4dgs",),
        begins_with(b"\x894DGS1\r\n"),
        reader="four_dgs",
        note=".4dgs, with the package fourdgs",
        package="fourdgs",
    ),
    MovingFormat(
        "pickle",
        _OFTEN_PICKLES,
        is_pickle,
        cure="as PyTorch saves checkpoints: it could run any code, and is not opened; write the scene with"
        " the code that trained it, as one PLY file or one a moment",
    ),
)
MOVING_FORMATS = tuple(row for row in KNOWN_MOVING if row.reader)
MOVING_READ = listed([row.note for row in MOVING_FORMATS] or [""])  # for help texts


def find_moving(path: Path) -> MovingFormat | None:
    """The format of a moving scene that a path is of, also of one that is not read; None if of none.

    None too for what is not there or may not be read: the reader of still scenes says so.
    """
    begin = b""
    if not is_dir(path):
        try:
            if not is_plain(path):
                return None
            with path.open("rb", buffering=0) as file:
                begin = file.read(NUM_FIRST_BYTES)
        except OSError:
            return None
        if not begin:
            return None
    return next((row for row in KNOWN_MOVING if row.matches(path, begin)), None)
