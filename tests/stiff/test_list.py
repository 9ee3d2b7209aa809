"""The list of stiff scenes is complete: every line has its tests, and every test it names is there."""

import ast
from pathlib import Path

from tests.kit.for_each import for_each
from tests.stiff import LIST
from tests.stiff.scenes import SCENES

# What was asked for, in one sentence.
ASKED = (
    "zero or unnormalised quaternions; NaN or Inf in any column; +Inf opacity logit and -Inf log-scale "
    "(legitimate: opacity 1, scale 0); 900,000 all-zero rows; scale ratios to 1e7; needles end-on and "
    "across the near plane; a Gaussian around the camera; one stroke that would fill the screen 100 "
    "times over (fade it, do not pop it); extents of +-2e7 around a subject at the origin; scenes 1e-4 "
    "and 1e4 units wide; exactly isotropic and exactly horizontal or vertical strokes; sub-pixel "
    "strokes; equal depths; N = 0, 1, 2; k >= N; all colours equal; all positions equal; SH degrees 0-3 "
    "and missing f_rest; linear scales or xyzw quaternions in the file (detected and named, cured on "
    "request); ascii, big-endian and truncated PLY, header counts of 1e18, plain point clouds and "
    "meshes named .ply; 1 x 1 and 8192 x 8192 images; textures of 1 x 1, all transparent, 16 bit, grey, "
    "palette"
)


def test_every_line_has_its_tests():
    assert list(LIST) == ASKED.split("; ")
    assert all(LIST.values())


@for_each("line", LIST)
def test_every_test_named_is_there_with_an_outcome(line):
    for outcome, proof in LIST[line]:
        assert outcome in ("drawn", "dropped", "refused")
        if proof.startswith("scene: "):
            assert SCENES[proof.removeprefix("scene: ")].outcome == outcome
            continue
        path, name = proof.split("::")
        tree = ast.parse((Path(__file__).parent / path).read_text(encoding="utf-8"))
        assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, proof
