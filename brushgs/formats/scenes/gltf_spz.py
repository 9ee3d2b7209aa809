"""Splats in glTF that are packed as SPZ, as Cesium writes them: proposals, the names of which changed.

The axes are taken as they are stored and then placed by the node, as Cesium does.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from brushgs.errors import SceneError
from brushgs.formats.gltf_file import CURE, GltfFile
from brushgs.formats.json_file import shown
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import STANDARD
from brushgs.formats.scenes.fill import activate_rows
from brushgs.formats.scenes.gltf_placed import Placement
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.spz import open_data

NAMES = (
    "KHR_gaussian_splatting_compression_spz_2",
    "KHR_gaussian_splatting_compression_spz",
    "KHR_spz_gaussian_splats_compression",
)
MAX_GROWTH = 100  # bytes in memory per byte of a file: as of SPZ files


@dataclass(frozen=True)
class PackedSplats:
    """One primitive of splats packed as SPZ, placed by one node.

    Attributes:
        scene: the SPZ scene inside the model.
        placement: where the node puts it.
    """

    scene: SceneFile
    placement: Placement

    @property
    def num_rows(self) -> int:
        """Gaussians that it holds."""
        return self.scene.num_rows

    @property
    def num_terms(self) -> int:
        """Spherical-harmonic terms of each."""
        return self.scene.num_terms

    def read(self, columns: Columns, *, is_raw: bool) -> tuple[Columns, Dropped]:
        """Decode into columns of as many rows; see `ColumnReader`."""
        found, _ = self.scene.read_columns(encoding=STANDARD, is_raw=True)
        for name in ("means", "quats", "scales", "opacities"):
            getattr(columns, name)[:] = getattr(found, name)
        columns.sh[:, : self.num_terms] = found.sh
        columns.sh[:, self.num_terms :] = 0
        self.placement.apply(columns, self.num_terms)
        if is_raw:
            return columns, Dropped()
        num_rest = columns.sh.shape[1] - 1
        return activate_rows(columns, STANDARD, first_row=0, num_rest=num_rest, is_logit=True)


def open_packed(
    file: GltfFile[Any],
    extensions: Iterator[tuple[str, Any]],
    placement: Placement,
    opened: dict[object, SceneFile],
) -> PackedSplats | None:
    """The packed splats of a primitive, or None if it has none.

    Args:
        file: the model.
        extensions: of the primitive, by name.
        placement: where its node puts it.
        opened: scenes by number of their buffer view, so that one that is placed twice is opened once.

    Raises:
        SceneError: if they are damaged.
    """
    for name, value in extensions:
        if name in NAMES:
            if not isinstance(value, dict):
                raise SceneError(file.path, f"{name} must be an object, got {shown(value)}; {CURE}")
            index = value.get("bufferView")
            data, _ = file.view(index, name)  # refuses what is no number
            if index not in opened:
                opened[index] = open_data(file.path, bytes(data))
            return PackedSplats(opened[index], placement)
    return None
