"""Machines of a farm make the same strokes, whatever instruction sets they have."""

import numpy as np
import pytest

from brushgs import _core
from brushgs.values.gaussians import GAUSSIAN_COLUMNS
from tests.kit.programs import ran
from tests.scenes import still_life_of

_STROKES = """
import sys
import numpy as np
import brushgs as bg
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.passes.reduce.cluster import group
from tests.passes.scenes import covariances
with np.load(sys.argv[1]) as columns:
    scene = bg.Gaussians(**columns)
views = bg.plain_views(scene, [frame_scene(plain_first_view(scene), width=160, height=120)])
kept = bg.prune(scene, 0.9)
made = {}
for name, some in (("blind", None), ("seen", views)):
    grouping = group(kept, 400, views=some)
    strokes = grouping.merged("cover")
    painted = bg.break_colors(bg.repaint(bg.orient(bg.solidify(strokes), scene, "form"), scene, views))
    made |= {f"{name} labels": grouping.labels, f"{name} means": strokes.means, f"{name} sh": painted.sh}
    made |= {f"{name} opacities": strokes.opacities, f"{name} shapes": covariances(strokes)}
np.savez(sys.argv[2], **made)
"""
# What a processor would lack, to the core; then to NumPy and to its BLAS, whose last bits are their own.
OF_CORE = [{"BRUSHGS_ISA": "baseline"}, {"BRUSHGS_ISA": "avx2"}]
OF_NUMPY = [
    {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR AVX512F AVX512_SKX AVX2 FMA3"},
    {"OPENBLAS_CORETYPE": "Nehalem"},
]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """From what is lacking to the strokes; each is made in a process of its own."""
    folder = tmp_path_factory.mktemp("machines")
    scene = still_life_of(4000)
    np.savez(folder / "scene.npz", **{name: getattr(scene, name) for name in GAUSSIAN_COLUMNS})

    def strokes(lacking):
        file = folder / f"{'-'.join(lacking.values())[:30]}.npz"
        if not file.exists():
            code, _, err = ran("-W", "ignore", "-c", _STROKES, folder / "scene.npz", file, env=lacking)
            assert code == 0, err
        with np.load(file) as columns:
            return dict(columns)

    return strokes


@pytest.mark.parametrize("lacking", OF_CORE, ids=str)
def test_the_core_makes_them_bit_for_bit(made, lacking):
    if lacking["BRUSHGS_ISA"] not in _core.isas():
        pytest.skip(f"the core is not compiled for {lacking['BRUSHGS_ISA']}, or this processor lacks it")
    for name, values in made({}).items():
        np.testing.assert_array_equal(made(lacking)[name], values, err_msg=name)


@pytest.mark.parametrize("lacking", OF_NUMPY, ids=str)
def test_numpy_makes_the_same_clusters_and_strokes_but_for_rounding(made, lacking):
    for name, values in made({}).items():
        found = made(lacking)[name]
        if name.endswith("labels"):
            np.testing.assert_array_equal(found, values, err_msg=name)
        else:
            np.testing.assert_allclose(found, values, rtol=1e-4, atol=1e-5 * values.std(), err_msg=name)
