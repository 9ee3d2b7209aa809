"""`--continue`: strokes like those below marks are painted as the marks are."""

import numpy as np
import pytest

from brushgs.cli import main
from brushgs.formats.marks import write_marks
from brushgs.formats.pictures.images import read_image
from brushgs.values.marks import Erased, Overpaint
from examples.benchmarks.continue_marks import errors
from tests.scenes import save_upright, still_life_of

VIEW = ("--size", "160x120", "--strokes", "200")


def test_half_of_a_paint_over_is_continued_nearer_to_the_other_half_than_its_look_is():
    """The table of the documentation has all looks."""
    found = errors(3000, 800, 120, ["oil"], ["oil"])
    own = found.pop("oil --continue")
    assert own.direction < 0.7 * min(error.direction for error in found.values())
    assert own.color < 0.85 * min(error.color for error in found.values())


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("continue") / "scene.ply"
    save_upright(still_life_of(3000), path)
    return path


def test_it_needs_marks(scene, capsys):
    assert main(["render", str(scene), *VIEW, "--continue", "-o", str(scene.parent / "a.png")]) == 2
    assert "--continue needs --marks, the paint that is continued" in capsys.readouterr().err


def test_erasing_alone_teaches_nothing_and_says_so(scene, capsys):
    one = Overpaint(erased=Erased(np.full((1, 3), 50.0), np.array([[0.0, 0, 1]]), np.ones(1)))
    write_marks(one, scene.parent / "erased.marks")
    given = ["--marks", str(scene.parent / "erased.marks")]
    for name, more in (("without.png", []), ("with.png", ["--continue", "--verbose"])):
        assert main(["render", str(scene), *VIEW, *given, *more, "-o", str(scene.parent / name)]) == 0
    words = " ".join(capsys.readouterr().err.split())
    assert "the marks hold no paint" in words
    first, second = (read_image(scene.parent / name) for name in ("without.png", "with.png"))
    np.testing.assert_array_equal(first, second)
