"""The reference: examples in the docstrings of public names run, every public function has one, and a page.

Examples begin with what `.ci/docs/begin.txt` makes, which the first page shows.
"""

import doctest
import inspect
import runpy
from pathlib import Path

import pytest

import brushgs
from brushgs.cli.parser import COMMANDS
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


def test_a_page_is_written_for_each_public_name_and_each_command(tmp_path):
    runpy.run_path(str(DOCS / "write_pages.py"))["main"](tmp_path)
    reference = tmp_path / "reference"
    index = (reference / "index.rst").read_text(encoding="utf-8")
    for folder, names in (("python", brushgs.__all__), ("commands", COMMANDS)):
        written = {path.stem for path in (reference / folder).glob("*.rst")}
        assert written == set(names)
        assert all(f"   {folder}/{name}\n" in index for name in names)
    render = (reference / "commands" / "render.rst").read_text(encoding="utf-8")
    assert ".. option:: --stroke-size PX" in render
    assert "10%; all; auto" in render  # as the help shows it


def test_the_site_leads_to_every_page_of_the_guides(tmp_path):
    pages = runpy.run_path(str(DOCS / "write_pages.py"))
    pages["main"](tmp_path)
    listed = {name for names in pages["CONTENTS"].values() for name in names}
    guides = {str(path.relative_to(tmp_path).with_suffix("")) for path in (tmp_path / "docs").rglob("*.md")}
    assert guides <= listed
    assert (tmp_path / "index.md").read_text(encoding="utf-8").count("{toctree}") == len(pages["CONTENTS"])
