"""At which rate does the loop become periodic at 90 mrad, the paper's strong amplitude?

Run `python benchmarks/periodicity.py`. Ten realizations from rest at each rate; one counts as
periodic if the motor position of the tenth period differs from that of the ninth by less than 1e-5,
rms over rms.
"""

from __future__ import annotations

import numpy as np
from machine import describe

from fjr_sim_node.simulation.simulator import run_realization
from fjr_validation.paper.levels import campaign_of

AMPLITUDE_RAD = 9e-2
RATES_HZ = (1000.0, 2000.0, 4000.0, 20_000.0)
RIGS = {"whole plant": {}, "transmission alone": {"fs": 0.0, "fsm": 0.0}}
REALIZATIONS, PERIODS = 10, 10
LIMIT = 1e-5


def mismatch(rate_hz: float, simulator: dict[str, float], number: int) -> float:
    """Return by how much the last period differs from the one before, relative."""
    campaign = campaign_of(
        AMPLITUDE_RAD,
        REALIZATIONS,
        PERIODS,
        rate_hz=rate_hz,
        transient_periods=0,
        simulator=simulator,
    )
    experiment = campaign.experiment(0, number)
    position = run_realization(campaign.values["simulator"], experiment).position
    before, last = position.reshape(PERIODS, -1)[-2:]
    return float(np.linalg.norm(last - before) / np.linalg.norm(last))


def main() -> None:
    """Measure and print."""
    print(describe() + "\n")
    heads = "".join(f"{rate / 1e3:>8g} kHz" for rate in RATES_HZ)
    print(f"Periodic to {LIMIT:g} of {REALIZATIONS} realizations at 90 mrad\n\n{'':20}{heads}")
    for name, simulator in RIGS.items():
        print(f"{name:20}", end="")
        for rate_hz in RATES_HZ:
            found = [mismatch(rate_hz, simulator, number) for number in range(REALIZATIONS)]
            print(f"{sum(value < LIMIT for value in found):12d}", end="", flush=True)
        print()


if __name__ == "__main__":
    main()
