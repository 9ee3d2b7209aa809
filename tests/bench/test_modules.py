"""Every benchmark can be imported: no other test runs them, so a name that moved would not show."""

from importlib import import_module
from pathlib import Path

import pytest

NAMES = sorted(p.stem for p in Path(__file__).parent.glob("*.py") if not p.stem.startswith(("_", "test_")))


@pytest.mark.parametrize("name", NAMES)
def test_a_benchmark_can_be_imported(name):
    pytest.importorskip("torch", reason="needs the extra [refine]")
    assert import_module(f"tests.bench.{name}").__doc__
