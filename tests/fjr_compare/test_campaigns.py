"""Simulated campaigns side by side: how often the same rig is called another, and what is found."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from bla_analyzer import Result, analyze
from fjr_bringup import Campaign, simulate_campaign
from fjr_compare.campaigns import compared_campaigns
from fjr_compare.comparing import judged_pairs
from fjr_kit.errors import InputError

COUNT = 9
EXCITATION = {
    "amplitudes_rad": [0.02], "realizations": 4, "periods": 2, "transient_periods": 2,
    "base_frequency_hz": 1.0, "f_min_hz": 1.0, "f_max_hz": 60.0, "grid": "odd",
}  # fmt: skip


def campaign(folder: Path, seed: int, rig: dict | None = None, **excitation) -> Result:
    """Simulate and analyze a campaign with noise and phases of its own."""
    values = {
        "excitation": {**EXCITATION, "seed": seed, **excitation},
        "simulator": {"noise_std_rad": 2e-5, "noise_seed": seed, **(rig or {})},
    }
    simulate_campaign(Campaign.create(overrides=values), folder, workers=1)
    return analyze(folder)


@pytest.fixture(scope="module")
def same(tmp_path_factory: pytest.TempPathFactory) -> list[Result]:
    """Return campaigns of one rig, the paper's with friction and cubic stiffness."""
    root = tmp_path_factory.mktemp("same")
    return [campaign(root / str(i), 100 + i) for i in range(COUNT)]


def test_one_rig_is_seldom_called_another(same):
    """36 pairs of 9 campaigns, each in 8 pairs: rates below three times the stated 5 %."""
    pairs = [compared_campaigns(a, b, 0.05) for a, b in combinations(same, 2)]
    lines = np.concatenate([pair.levels[0].bla.p_value for pair in pairs])
    assert lines.size > 900 and 0.02 < np.mean(lines < 0.05) < 0.07
    assert np.mean([pair.levels[0].p_value < 0.05 for pair in pairs]) < 0.15
    powers = [p.p_value for pair in pairs for p in pair.levels[0].powers]
    assert np.mean(np.array(powers) < 0.05) < 0.12
    assert np.mean([judged_pairs("campaigns", "a", [p], 0.05).changed for p in pairs]) < 0.12


def test_a_stiffness_of_four_percent_less_is_found_in_every_campaign(same, tmp_path):
    softer = campaign(tmp_path / "rig", 7, {"k0": 1440.0}, amplitudes_rad=[0.02])
    found = [judged_pairs("campaigns", "a", [compared_campaigns(one, softer, 0.05)], 0.05)
             for one in same]  # fmt: skip
    assert np.mean([each.changed for each in found]) > 0.8
    level = max((each.pairs[0].levels[0] for each in found), key=lambda one: one.change_percent)
    assert level.changed and 15.0 < level.worst_hz < 30.0  # about the resonance
    sentences = [sentence for each in found for sentence in each.changes]
    assert all("the BLA changed by" in sentence for sentence in sentences)


def test_more_noise_is_found_and_named(same, tmp_path):
    louder = campaign(tmp_path / "rig", 7, {"noise_std_rad": 5e-5})
    found = judged_pairs("campaigns", "a", [compared_campaigns(same[0], louder, 0.05)], 0.05)
    noise = next(p for p in found.pairs[0].levels[0].powers if p.kind == "noise")
    assert noise.changed and noise.change_db == pytest.approx(20 * np.log10(2.5), abs=2.0)
    assert any("noise changed by +" in sentence for sentence in found.changes)


def test_other_lines_are_shown_and_not_judged(same, tmp_path):
    other = campaign(tmp_path / "rig", 7, grid="odd_random", f_max_hz=50.0)
    pair = compared_campaigns(same[0], other, 0.05)
    level = pair.levels[0]
    assert 5 < level.bla.frequency_hz.size < 30 and level.p_value is None
    assert set(level.bla.frequency_hz) <= set(other.levels[0].bla.frequency_hz)
    assert any("The excited lines differ" in note for note in pair.notes)
    kinds = {power.kind: power.p_value for power in level.powers}
    assert {"total", "noise"} <= set(kinds) and set(kinds.values()) == {None}


def test_what_cannot_be_compared_is_refused_in_one_sentence(same):
    first, level = same[0], same[1].levels[0]
    quieter = level.model_copy(update={"amplitude_rad": level.amplitude_rad / 4.0})
    elsewhere = {"frequency_hz": level.bla.frequency_hz + 0.123}
    shifted = level.model_copy(update={"bla": level.bla.model_copy(update=elsewhere)})
    none = level.model_copy(update={"bla": None})
    for change, sentence in (
        ({"sample_rate_hz": 500.0}, "was sampled at 1000 Hz and .* at 500 Hz"),
        ({"levels": (quieter,)}, "no amplitude in common .20 against 5 mrad"),
        ({"levels": (shifted,)}, "have no reliable line in common"),
        ({"levels": (none,)}, "allows no BLA"),
    ):
        with pytest.raises(InputError, match=sentence):
            compared_campaigns(first, same[1].model_copy(update=change), 0.05)


def test_levels_that_one_lacks_are_left_out_and_that_is_said(same, tmp_path):
    both = campaign(tmp_path / "rig", 7, amplitudes_rad=[0.005, 0.02])
    pair = compared_campaigns(same[0], both, 0.05)
    assert len(pair.levels) == 1
    assert "Only 1 of 2 levels are in both; the others are not compared." in pair.notes


def test_another_controller_is_said(same):
    other = same[1].model_copy(update={"controller": {**same[1].controller, "p": 1.0}})
    notes = compared_campaigns(same[0], other, 0.05).notes
    assert any(note.startswith("The controllers differ") for note in notes)
    assert not compared_campaigns(same[0], same[1], 0.05).notes


def test_rounding_of_a_simulation_without_noise_is_no_power(tmp_path):
    one, two = (
        campaign(tmp_path / str(k0), 1, {"noise_std_rad": 0.0, "k0": k0}, transient_periods=16)
        for k0 in (1500.0, 1400.0)
    )
    assert 0.0 < one.levels[0].excited.noise.max() < 1e-15  # rad: the transient has died out
    pair = compared_campaigns(one, two, 0.05)
    assert {power.kind for level in pair.levels for power in level.powers} == {"total"}
