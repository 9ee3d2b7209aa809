"""How much memory there is."""

import os
import platform
from pathlib import Path

import pytest

from brushgs.core import memory as module
from brushgs.core.memory import machine_memory
from brushgs.pipeline import strokes
from brushgs.pipeline.report import Report
from tests.kit.programs import ran


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


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library")
def test_a_freed_array_is_used_again() -> None:
    program = """
import resource, sys
import numpy as np
from brushgs.core.memory import keep_freed
if sys.argv[1] == "kept": keep_freed()
def faults(): return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def fill(): np.empty(25_000_001).fill(1.0)
fill()
before = faults()
for _ in range(20): fill()
print(faults() - before)
"""
    kept, returned = (int(ran("-c", program, word)[1]) for word in ("kept", "returned"))
    assert kept < 100 < returned  # pages may be of 2 MB


def test_only_large_scenes_keep_freed_memory(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[int] = []
    monkeypatch.setattr(strokes, "keep_freed", lambda: calls.append(1))
    strokes.load_scene(scene, Report())
    assert calls == []
    monkeypatch.setattr(strokes, "MANY_ROWS", 100)
    strokes.load_scene(scene, Report())
    assert calls == [1]
