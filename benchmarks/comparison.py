"""How often does `fjr compare` call one rig another, and from which change on does it tell two?

Run `python benchmarks/comparison.py`: 40 campaigns of the paper's rig with M = 4, 30 with M = 7, at
7 and 20 mrad, each with noise and phases of its own, all pairs; then each of ten campaigns with M =
7 beside one of a softer rig. Four minutes of processor time.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from machine import describe

from bla_analyzer import Result, analyze
from fjr_bringup import Campaign, simulate_campaign
from fjr_compare.campaigns import compared_campaigns
from fjr_compare.comparing import judged_pairs
from fjr_compare.result import Comparison

RATE = 0.05
CAMPAIGNS = {4: 40, 7: 30}
SOFTER = (0.99, 0.98, 0.97, 0.96)
EXCITATION = {
    "amplitudes_rad": [0.007, 0.02], "periods": 2, "transient_periods": 2, "grid": "odd",
    "base_frequency_hz": 1.0, "f_min_hz": 1.0, "f_max_hz": 60.0,
}  # fmt: skip


def campaign(folder: Path, realizations: int, seed: int, k0: float = 1500.0) -> Result:
    """Simulate and analyze a campaign."""
    values = {
        "excitation": {**EXCITATION, "realizations": realizations, "seed": seed},
        "simulator": {"noise_std_rad": 2e-5, "noise_seed": seed, "k0": k0},
    }
    simulate_campaign(Campaign.create(overrides=values), folder / str(seed), workers=1)
    return analyze(folder / str(seed))


def compared(pairs: Sequence[tuple[Result, Result]]) -> list[Comparison]:
    """Return the comparison of each pair."""
    return [
        judged_pairs("campaigns", "first", [compared_campaigns(one, two, RATE)], RATE)
        for one, two in pairs
    ]


def main() -> None:
    """Measure and print."""
    print(describe() + f"\n\nShare of tests below p = {RATE:g} where nothing differs\n")
    print(f"{'M':>3}{'pairs':>7}{'mrad':>6}{'lines':>8}{'BLA':>8}{'total':>8}{'even':>8}"
          f"{'noise':>8}{'anything':>10}")  # fmt: skip
    kept: list[Result] = []
    for realizations, count in CAMPAIGNS.items():
        with tempfile.TemporaryDirectory() as folder:
            results = [campaign(Path(folder), realizations, 1000 + i) for i in range(count)]
        found = compared(list(combinations(results, 2)))
        anything = np.mean([each.changed for each in found])
        for index, mrad in enumerate((7, 20)):
            levels = [each.pairs[0].levels[index] for each in found]
            lines = np.concatenate([level.bla.p_value for level in levels])
            powers = [[p.p_value for p in level.powers] for level in levels]
            shares = [np.mean(lines < RATE), np.mean([v.p_value < RATE for v in levels])]
            shares += list(np.mean(np.array(powers, float) < RATE, axis=0))
            told = "".join(f"{share:8.3f}" for share in shares)
            print(f"{realizations:3d}{len(found):7d}{mrad:6d}{told}{anything:10.3f}", flush=True)
        kept = results[:10]
    print("\nShare of comparisons that find a softer rig, M = 7\n")
    for share in SOFTER:
        with tempfile.TemporaryDirectory() as folder:
            softer = campaign(Path(folder), 7, 7, 1500.0 * share)
        found = compared([(one, softer) for one in kept])
        print(f"k0 {100 * share - 100:+.0f} %: {np.mean([each.changed for each in found]):.1f}")


if __name__ == "__main__":
    main()
