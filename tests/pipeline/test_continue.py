"""`--continue`: strokes like those below marks are painted as the marks are."""

import numpy as np

from brushgs.cli import main
from brushgs.formats.marks import write_marks
from brushgs.formats.pictures.images import read_image
from brushgs.values.marks import Erased, Overpaint
from examples.benchmarks.continue_marks import errors

VIEW = ("--size", "160x120", "--strokes", "200")


def test_half_of_a_paint_over_is_continued_nearer_to_the_other_half_than_its_look_is():
    """The table of the documentation has all looks."""
    found = errors(3000, 800, 120, ["oil"], ["oil"])
    own = found.pop("oil --continue")
    assert own.direction < 0.7 * min(error.direction for error in found.values())
    assert own.color < 0.85 * min(error.color for error in found.values())


def test_erasing_alone_teaches_nothing_and_says_so(scene, folder, capsys):
    one = Overpaint(erased=Erased(np.full((1, 3), 50.0), np.array([[0.0, 0, 1]]), np.ones(1)))
    write_marks(one, "erased.marks")
    for name, more in (("without.png", []), ("with.png", ["--continue", "--verbose"])):
        words = ["render", str(scene), *VIEW, "--marks", "erased.marks", *more, "-o", name]
        assert main(words) == 0
    words = " ".join(capsys.readouterr().err.split())
    assert "the marks hold no paint" in words
    first, second = (read_image(name) for name in ("without.png", "with.png"))
    np.testing.assert_array_equal(first, second)
