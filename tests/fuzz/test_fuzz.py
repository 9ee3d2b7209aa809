"""The short run of the fuzzer, the same inputs every time; `python -m tests.fuzz` is the long one."""

import random
import warnings
from contextlib import suppress

import pytest

from brushgs import SceneWarning
from brushgs.formats import load
from tests.fuzz.mutate import MAX_LENGTH, PNG_START, mutate
from tests.fuzz.readers import PICTURE_READERS, READERS
from tests.fuzz.run import fuzz
from tests.io.ply_maker import scene_columns, write_scene

INPUTS = 150  # of each reader, its seeds among them
FEW_INPUTS = 8  # of readers that start a process for each file
PICTURES = tuple(reader.name for reader in PICTURE_READERS)
SLOW = tuple(name for name in READERS if name.startswith("usd"))
# One process for each: starting it takes longer than its inputs.
OTHERS = tuple(name for name in READERS if name not in PICTURES + SLOW)
GROUPS = {"pictures": PICTURES, "read by a process": SLOW, "all others": OTHERS}


@pytest.mark.parametrize("group", GROUPS)
def test_damaged_files_give_a_sound_value_or_a_sentence(group, tmp_path):
    names, inputs = GROUPS[group], FEW_INPUTS if GROUPS[group] == SLOW else INPUTS
    outcome = fuzz("+".join(names), tmp_path, max_inputs=inputs, seed=20251121)
    assert outcome.is_clean, outcome.as_json()
    assert outcome.inputs == inputs * len(names)


FAULTS = {
    "bloat": "memory: 1",
    "claim": "MemoryError at ",
    "key": "KeyError at faulty.py",
    "nameless": "ValueError without the name of the file",
    "lines": "ValueError that holds control characters",
    "flood": "ValueError of 50",
    "warn": "RuntimeWarning at ",
    "nan": "a picture with values outside 0 to 1",
}
DEADLY = {"crash": "died of SIGSEGV", "hang": "hang"}


def test_every_breach_of_the_rules_is_reported_with_its_input(tmp_path):
    outcome = fuzz(f"tests.fuzz.faulty:{'+'.join(FAULTS)}", tmp_path, max_inputs=2)
    assert (outcome.crashes, outcome.hangs) == (0, 0)
    for fault, expected in zip(outcome.faults, FAULTS.values(), strict=True):
        assert expected in fault["what"]
        assert (tmp_path / fault["input"]).read_bytes() != b"good"


@pytest.mark.parametrize("name", DEADLY)
def test_a_crash_and_a_hang_are_reported_and_survived(name, tmp_path):
    outcome = fuzz(f"tests.fuzz.faulty:{name}", tmp_path, max_inputs=2, seconds=0.9, seconds_per_input=0.5)
    assert outcome.faults[0]["what"] == DEADLY[name]
    assert outcome.hangs if name == "hang" else outcome.crashes
    assert (tmp_path / outcome.faults[0]["input"]).read_bytes() != b"good"


def test_equal_seeds_give_equal_damage():
    seeds = [b"ply\nformat ascii 1.0\nelement vertex 3\n" * 9, PNG_START + b"\0\0\0\1IDATx\0\0\0\0"]
    for data in seeds:
        runs = [[mutate(random.Random(n), data, seeds, [b"token"]) for n in range(200)] for _ in range(2)]
        first, second = runs
        assert first == second
        assert len(set(first)) > 150
        assert max(map(len, first)) <= MAX_LENGTH


def test_undamaged_files_are_read(tmp_path):
    """Else the runs above would show only that nothing is ever read."""
    for reader in READERS.values():
        (tmp_path / "seeds").mkdir(exist_ok=True)
        seeds = reader.seeds(tmp_path / "seeds")
        num_read = 0
        for data in seeds:
            with warnings.catch_warnings(), suppress(ValueError):
                warnings.simplefilter("ignore", SceneWarning)
                reader.read(reader.write(data, tmp_path))
                num_read += 1
        assert num_read >= len(seeds) / 3, reader.name
    assert len(load(write_scene(tmp_path / "a.ply", scene_columns(3)))) == 3
