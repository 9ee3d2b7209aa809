"""The reference: examples in the docstrings of public names run, every public function has one, and a page.

Examples begin with what `.ci/docs/begin.txt` makes, which the first page shows.
"""

import doctest
import inspect
from pathlib import Path

import pytest

import brushgs
from tests.kit.for_each import for_each

DOCS = Path(__file__).resolve().parent.parent / ".ci" / "docs"
BEGIN = DOCS / "begin.txt"
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def public_values():
    """Public functions and classes by name."""
    return {name: getattr(brushgs, name) for name in brushgs.__all__}


EXAMPLES = [
    test
    for name, value in public_values().items()
    for test in doctest.DocTestFinder().find(value, name)
    if test.examples
]


@pytest.fixture(scope="module")
def begun():
    names = {}
    exec(BEGIN.read_text(encoding="utf-8"), names)
    return names


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.name)
def test_the_example_of_a_docstring_runs(example, begun, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example.globs = dict(begun)
    said = []
    doctest.DocTestRunner(optionflags=FLAGS).run(example, out=said.append)
    assert not said, "".join(said)


@for_each("name", [name for name, value in public_values().items() if inspect.isfunction(value)])
def test_every_public_function_has_an_example(name):
    assert name in {example.name for example in EXAMPLES}
