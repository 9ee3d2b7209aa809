"""How much memory there is."""

import os
from pathlib import Path

import pytest

from brushgs.core import memory as module
from brushgs.core.memory import machine_memory


@pytest.mark.skipif(not hasattr(os, "sysconf"), reason="the system tells nothing")
def test_it_is_that_of_the_machine_where_nothing_limits_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_LIMIT_FILES", ())
    monkeypatch.setattr(module, "_address_space", lambda: None)
    assert machine_memory() == os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def test_a_limit_that_is_lower_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    limits = tmp_path / "memory.max", tmp_path / "none", tmp_path / "words"
    limits[0].write_text("1048576\n")
    limits[2].write_text("max\n")
    monkeypatch.setattr(module, "_LIMIT_FILES", tuple(map(str, limits)))
    assert machine_memory() == 1 << 20
    monkeypatch.setattr(module, "_address_space", lambda: 1 << 19)
    assert machine_memory() == 1 << 19


def test_a_system_that_tells_nothing_has_no_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_LIMIT_FILES", ())
    monkeypatch.setattr(module, "_address_space", lambda: None)
    monkeypatch.setattr(module.os, "sysconf", lambda name: (_ for _ in ()).throw(ValueError(name)))
    assert machine_memory() is None
