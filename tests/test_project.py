"""What is said of the project in several places is the same in all of them."""

import re
import tomllib

from brushgs.version import __version__
from tests.test_examples import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
RECIPE = (ROOT / ".github" / "conda" / "recipe.yaml").read_text(encoding="utf-8")


def names_of(requirements):
    return {re.match(r"[\w-]+", each)[0].lower() for each in requirements}


def test_the_version_is_one():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in citation
    assert f'\n  version: "{__version__}"\n' in RECIPE
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.search(r"^## (\S+)", changes, re.MULTILINE)[1] == __version__
    wheels = re.findall(r"brushgs-([\d.]+)-cp", (ROOT / "docs" / "install.md").read_text(encoding="utf-8"))
    assert set(wheels) == {__version__}


def test_stills_need_no_package_of_an_extra():
    base = names_of(PROJECT["dependencies"])
    for extra in ("video", "kmeans", "refine", "cluster"):
        assert not base & names_of(PROJECT["optional-dependencies"][extra]), extra
