"""Every effect at ten times its detection limit, under three excitations: is it named?

Run `python benchmarks/every_effect.py` (--only noise: one excitation). The paper's rig, its
parameters up to 5 % off the datasheet, is driven by a chirp, noise and trapezoidal moves, two
levels of three records each. The foresight of `fjr plan` says at which size an effect shows ten
times what a diagnosis of such records needs, or why these records cannot show it; a rig with it
is simulated and diagnosed by default settings. Right: the effect is named or in a named set.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from machine import describe

from controller_node import pd_filtered
from excitation_node import multisine
from excitation_node.record_experiment import RECORD, describe_record
from fjr_bringup import Campaign
from fjr_bringup.design.planned import planned_record
from fjr_interface.experiment import RecordDescription
from fjr_records.records import RecordSet
from fjr_sim_node.plant import PLANT
from gap_diagnosis import read_nominal
from gap_diagnosis.any_record import investigate
from gap_diagnosis.foresight.foresee import foresee

TIMES = 10.0
OFF = 0.05
NOISE_RAD = 1e-5
RATE_HZ, SECONDS, BAND_HZ = 1000.0, 20.0, (0.2, 25.0)
AMPLITUDES_RAD = {"chirp": (6e-3, 2e-2), "noise": (4e-3, 1.2e-2), "trapezoid": (0.1, 0.5)}
SPEEDS_RAD_S = (0.5, 1.0, 2.0)


@dataclass(frozen=True)
class Case:
    """An excitation and the effect of the rig: its parameters by full name."""

    excitation: str
    effect: str
    values: Mapping[str, float]


def runs_of(kind: str) -> list[RecordDescription]:
    """Return the descriptions of the six records of an excitation."""
    excitation = multisine.EXCITATION.check(
        {
            "amplitudes_rad": AMPLITUDES_RAD[kind],
            "sample_rate_hz": RATE_HZ,
            "f_min_hz": BAND_HZ[0],
            "f_max_hz": BAND_HZ[1],
            "realizations": 3,
        }
    )
    record = RECORD.check({"duration_s": SECONDS, "velocity_rad_s": SPEEDS_RAD_S})
    law = pd_filtered.describe(pd_filtered.CONTROLLER.check({}))
    return [
        describe_record(kind, excitation, record, level, realization, law)
        for level in range(len(AMPLITUDES_RAD[kind]))
        for realization in range(3)
    ]


def played(kind: str, values: Mapping[str, float]) -> RecordSet:
    """Return what a rig records."""
    campaign = Campaign.create(overrides={"simulator": {"noise_std_rad": NOISE_RAD, **values}})
    recorded = planned_record(campaign, runs_of(kind))
    assert isinstance(recorded, RecordSet)
    return recorded


def cases_of(kind: str) -> tuple[list[Case], dict[str, str]]:
    """Return the cases of an excitation, and of all other effects why records cannot show them."""
    found = foresee(played(kind, {}), read_nominal("paper"), showing=TIMES)
    cases, not_shown = [], {}
    for one in found.effects:
        if one.limit is None:
            not_shown[one.effect] = one.why_not
        else:
            values = {one.parameter: one.limit, **one.shape}
            cases.append(Case(kind, one.effect, values))
    return cases, not_shown


def judged(case: Case) -> tuple[Case, str, list[list[str]], list[float]]:
    """Return verdict, named sets and how surely each is present."""
    seed = sum(map(ord, case.effect))
    factors = np.random.default_rng(seed).uniform(1.0 - OFF, 1.0 + OFF, len(PLANT.names))
    rig = {p.name: float(p.default * f) for p, f in zip(PLANT, factors, strict=True)}
    records = played(case.excitation, {**rig, **case.values})
    diagnosis = investigate(records, read_nominal("paper")).diagnosis
    return case, diagnosis.verdict, diagnosis.equivalent, [c.present for c in diagnosis.causes]


def main() -> None:
    """Measure and print."""
    print(describe() + "\n", flush=True)
    kinds = [sys.argv[2]] if sys.argv[1:2] == ["--only"] else list(AMPLITUDES_RAD)
    print("| excitation | effect | | verdict | named | present |\n|---|---|---|---|---|---|")
    totals = {}
    for kind in kinds:
        cases, not_shown = cases_of(kind)
        right = 0
        with ProcessPoolExecutor(2, get_context("spawn")) as pool:
            for case, verdict, sets, present in pool.map(judged, cases):
                hit = any(case.effect in names for names in sets)
                right += hit
                named = "; ".join(" or ".join(names) for names in sets) or "nothing"
                size = ", ".join(f"{n.partition('.')[2]} {v:.3g}" for n, v in case.values.items())
                sure = ", ".join(f"{p:.2f}" for p in present)
                mark = "" if hit else "**missed**"
                print(f"| {kind} | {case.effect}: {size} | {mark} | {verdict} | {named} | {sure} |",
                      flush=True)  # fmt: skip
        totals[kind] = right, len(cases), not_shown
    for kind, (right, count, not_shown) in totals.items():
        print(f"\n{kind}: {right} of {count}. Not shown by such records:")
        for effect, why in not_shown.items():
            print(f"- {effect}: {why}")


if __name__ == "__main__":
    main()
