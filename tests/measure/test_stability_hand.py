"""`brushgs stability` of films that are made by hand."""

import json
from pathlib import Path

import pytest

from brushgs import cli
from brushgs.measure.stability.schedule import FrameSchedule
from brushgs.options.experiments import StabilityConfig
from tests.scenes import save_upright, still_life_of


def test_the_command_takes_the_flags(tmp_path, monkeypatch, capsys):
    """Nothing flips or spins but what was asked for, and that shows in the pictures."""
    save_upright(still_life_of(1500), tmp_path / "pears.ply")
    monkeypatch.chdir(tmp_path)
    words = "pears.ply --look plain --strokes 80 --size 64x48 --orbit 120 --no-plot --pairs 6 --see off"
    words += " --azimuth 30 --look-at subject --hold 2 --boil 0.5 --boil-every 2 --redraw 1 --smear 1"
    assert cli.main(["stability", *words.split()]) == 0, capsys.readouterr().err
    value = json.loads(Path("pears-stability/stability.json").read_text())
    found = {figures["name"]: figures for figures in value["stability"]["configurations"]}
    hand, track = found["hand"], found["track"]
    assert hand["events"]["flips"] == hand["events"]["spins"] == 0
    assert hand["alone_equal"] == hand["alone"] > 0
    excess = [[warp["excess"] for warp in figures["warps"]] for figures in (hand, track)]
    assert all(one > other for one, other in zip(*excess, strict=True))


@pytest.mark.parametrize(("pairs", "beat", "stride"), [(40, 1, 3), (40, 3, 4), (60, 6, 5), (120, 6, 1)])
def test_pairs_begin_at_all_moments_of_what_is_made_by_hand(pairs, beat, stride):
    schedule = FrameSchedule(121, True, StabilityConfig(pairs=pairs), beat)
    assert schedule.stride == stride
    assert {start % beat for start in schedule.starts(1)} == set(range(beat))
