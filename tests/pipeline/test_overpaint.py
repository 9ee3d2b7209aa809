"""What is painted over a scene leaves the directions of all other strokes."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.pipeline.overpaint import Overpainted, overpainted
from brushgs.pipeline.report import Report
from brushgs.rendering.canonical import fit_canonical
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.values.marks import Combs, Overpaint
from brushgs.values.quats import rotation_matrices
from tests.scenes import still_life_of


def test_fields_turn_with_combed_strokes_and_others_keep_theirs():
    strokes, flat = bg.cluster(still_life_of(1000), 60), bg.BrushSet.open("flat")
    options, fields = RenderOptions.of(flat, lock="canonical"), fit_canonical(strokes)
    coat = Coat("strokes", strokes, flat, options, fields=fields)
    middle = strokes.means.astype(np.float64).mean(axis=0)
    combs = Combs(middle[None], np.array([1.0]), np.array([[1.0, 0, 0]]), np.ones(1))
    given = Overpaint(combs=combs)
    (after,) = overpainted([coat], strokes, Overpainted((given,), given), 1, Report())
    is_turned = (after.strokes.quats != strokes.quats).any(axis=1)
    assert 0 < is_turned.sum() < len(strokes)
    for name in ("facing", "along"):
        now, before = getattr(after.fields, name), getattr(fields, name)
        np.testing.assert_allclose(now[~is_turned], before[~is_turned], atol=1e-6)
        pairs = (strokes, before), (after.strokes, now)
        own = [np.einsum("nij,ni->nj", rotation_matrices(one.quats), vectors) for one, vectors in pairs]
        np.testing.assert_allclose(*own, atol=1e-5)
    assert not np.allclose(after.fields.along, fields.along)
    (bare,) = overpainted([replace(coat, fields=None)], strokes, Overpainted((given,), given), 1, Report())
    assert bare.fields is None
