"""What `info --where` tells of a part of a scene."""

import json

import numpy as np
import pytest

from brushgs.doctor.describe import describe
from brushgs.formats import load
from brushgs.options.where import Where, WhereConfig
from tests.kit.commands import refused, run


def part(scene, text, **options):
    facts = describe(scene, WhereConfig(Where.parse(text), **options))
    return {name: value for name, value in facts.items() if name.startswith("where")}


def test_a_part_is_counted_and_has_its_corners(scene):
    gaussians = load(scene)
    x = gaussians.means[:, 0]
    inside = x >= 0.5
    facts = part(scene, "half:1,0,0,0.5")
    assert facts["where"] == "half:1,0,0,0.5"
    assert facts["where_gaussians"] == inside.sum()
    assert facts["where_share"] == pytest.approx(inside.mean(), rel=1e-5)
    opacity = gaussians.opacities[inside].sum() / gaussians.opacities.sum()
    assert facts["where_opacity"] == pytest.approx(opacity, rel=1e-5)
    np.testing.assert_allclose(facts["where_low"], gaussians.means[inside].min(axis=0), rtol=1e-5)
    np.testing.assert_allclose(facts["where_high"], gaussians.means[inside].max(axis=0), rtol=1e-5)


def test_what_is_in_it_in_part_counts_in_part(scene):
    hard, soft = part(scene, "subject"), part(scene, "subject", soft=0.5)
    assert soft["where_gaussians"] > hard["where_gaussians"]
    assert soft["where_share"] < soft["where_gaussians"] / 1000


def test_info_tells_of_a_part_and_refuses_what_is_none(scene, capsys):
    code, out, _ = run(capsys, "info", scene, "--where", "sphere:90,0,0,1", "--json")
    assert code == 0
    facts = json.loads(out)
    assert (facts["where_gaussians"], facts["where_share"], facts["where_opacity"]) == (0, 0, 0)
    assert "where_low" not in facts
    code, out, _ = run(capsys, "info", scene, "--where", "subject and not sphere:90,0,0,1")
    assert code == 0
    assert "where            subject and not sphere:90,0,0,1\n" in out
    assert "where gaussians  " in out
    for text, sentence in (("subjekt", "did you mean subject?"), ("part:999", "part:999 is not there")):
        assert sentence in refused(capsys, "info", scene, "--where", text)
