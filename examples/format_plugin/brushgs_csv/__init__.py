"""Adds a format and a look to brushgs: scenes as comma-separated text, and "dusk".

After `pip install examples/format_plugin`, `brushgs render dots.csv --look dusk` paints the lines

    x,y,z,size,r,g,b,opacity
    0.1,0,2.5,0.02,0.8,0.7,0.2,0.9
"""

from contextlib import nullcontext
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.formats.files import read_whole, replacing
from brushgs.formats.format import Format, begins_with
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.formats.scenes.stored import Stored
from brushgs.values.sh import C0

HEAD = "x,y,z,size,r,g,b,opacity"


def open_scene(path: Path) -> SceneFile:
    """Read the table; decoding its rows is left to `brushgs`, which checks them, as those of any format."""
    lines = read_whole(path, 1 << 28, "scene file").decode("ascii", "replace").splitlines()[1:]
    try:
        table = np.loadtxt(lines, np.float32, delimiter=",", ndmin=2).reshape(-1, 8)
    except ValueError as error:
        raise bg.SceneError(path, f"must hold 8 numbers a line ({error}); export it again") from None

    def decode(start: int, stop: int, out: Columns) -> None:
        rows = table[start:stop]
        out.means[:], out.scales[:], out.quats[:] = rows[:, :3], rows[:, 3:4], (1, 0, 0, 0)
        out.sh[:, 0], out.opacities[:] = rows[:, 4:7], rows[:, 7]

    encoding = bg.Encoding(scales="linear", colors="rgb")
    rows = RowSource(len(table), 1, lambda: nullcontext(decode), block_rows=4096, encoding=encoding)
    return SceneFile(path, "comma-separated text", len(table), 1, open_rows=lambda: rows)


def write_scene(gaussians: bg.Gaussians, path: Path, stored: Stored) -> None:
    """Write centers, mean sizes, colors and opacities; a view-dependent color is that of no direction."""
    sizes, colors = gaussians.scales.mean(axis=1), 0.5 + C0 * gaussians.sh[:, 0]
    table = np.column_stack([gaussians.means, sizes, colors, gaussians.opacities])
    with replacing(path) as temporary:
        np.savetxt(temporary, table, "%.9g", ",", header=HEAD, comments="")


FORMAT = Format(
    "table of Gaussians",
    "scene",
    (".csv",),
    begins_with(HEAD.encode()),
    read=open_scene,
    write=write_scene,
    note="comma-separated, a Gaussian a line",
    rounds=True,
)
LOOK = Path(__file__).with_name("dusk.toml")
