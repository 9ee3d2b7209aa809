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


def test_the_recipe_for_conda_needs_what_the_base_install_needs():
    run = RECIPE[RECIPE.index("  run:") : RECIPE.index("  run_constraints:")]
    found = set(re.findall(r"^    - ([\w-]+ >=[\d.]+)", run, re.MULTILINE))
    expected = {need.lower().replace(">=", " >=") for need in PROJECT["dependencies"]}
    assert {each.replace("py-openimageio", "openimageio") for each in found} == expected


def test_every_extra_for_users_is_told_in_the_pages():
    extras = set(PROJECT["optional-dependencies"]) - {"all", "test", "docs", "test-open3d"}
    for page in ("docs/install.md", "docs/machines.md", "README.md"):
        text = (ROOT / page).read_text(encoding="utf-8")
        assert [extra for extra in sorted(extras) if f"`{extra}`" not in text] == [], page
    assert extras == {
        extra
        for need in PROJECT["optional-dependencies"]["all"]
        for extra in re.search(r"\[(.*)\]", need)[1].split(",")
    }


def test_stills_need_no_package_of_an_extra():
    base = names_of(PROJECT["dependencies"])
    for extra in ("video", "kmeans", "refine", "cluster"):
        assert not base & names_of(PROJECT["optional-dependencies"][extra]), extra
