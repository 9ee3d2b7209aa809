"""An outside witness: GaussForge, which reads SPZ with the library of its makers.

Its Python API fails on scenes without view-dependent colors, its conversion to PLY does not.
"""

from pathlib import Path

import gaussforge
import numpy as np

from brushgs import Gaussians
from brushgs.formats import load

NAMES = ("means", "quats", "scales", "opacities", "sh")


def convert(data: bytes, form: str, to: str, **options: int) -> bytes:
    """A file in another format."""
    result = gaussforge.GaussForge().convert(data, form, to, **options)
    assert "error" not in result, result["error"]
    content: bytes = result["data"]
    return content


def as_gaussforge_reads(data: bytes, form: str, folder: Path) -> Gaussians:
    """The Gaussians of a file, by way of a PLY."""
    path = folder / "witness.ply"
    path.write_bytes(convert(data, form, "ply"))
    return load(path)


def assert_alike(actual: Gaussians, expected: Gaussians, *names: str, atol: float = 5e-7) -> None:
    """Columns equal but for float32 rounding.

    Of quaternions, rotations are compared, by 1 - cos of half the angle between them: a component that
    follows from the unit length may have lost half of its digits.
    """
    for name in names or NAMES:
        first, second = (np.asarray(getattr(scene, name), float) for scene in (actual, expected))
        if name == "quats":
            lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
            assert (1 - np.abs((first * second).sum(axis=1)) / lengths).max() < 3e-7
            continue
        # Opacities of 0 and 1 become 1e-6 and 1 - 1e-6.
        smallest = 1.1e-6 if name == "opacities" else atol
        np.testing.assert_allclose(first, second, rtol=3e-6, atol=smallest, err_msg=name)
