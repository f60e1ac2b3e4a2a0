"""Size of the experiments: the paper's M and P, or a small version for a first look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

CASES: dict[str, dict[str, float]] = {
    "both": {},
    "transmission": {"fs": 0.0, "fsm": 0.0},
    "friction": {"k1": 0.0},
    "noise": {"noise_snr_db": 20.0},
}
"""What differs from the paper's rig in the four cases of Fig. 4."""

NAMES = {
    "both": "two nonlinearities",
    "transmission": "transmission nonlinearity",
    "friction": "friction nonlinearity",
    "noise": "two nonlinearities and noise",
}
COLORS = {"both": "#d62728", "transmission": "#1f4fd8", "friction": "#000000", "noise": "#2ca02c"}
"""The paper's colours of Fig. 4."""

SMALL_RAD, STRONG_RAD = 1e-3, 9e-2
"""The paper's small and strong amplitude of a line."""
SNR_DB = 20.0
ALMOST_DB2 = 3.0
"""V up to which a BLA counts as almost equal to G0."""


@dataclass(frozen=True)
class Settings:
    """Sizes of the experiments.

    Attributes:
        sweep_amplitudes: amplitudes of Fig. 4 and of the maps.
        sweep_realizations, sweep_periods: M and P of each of them.
        friction_realizations, transmission_realizations, both_realizations, robust_periods: M and
            P of Fig. 9.
        repeats: whole experiments behind the spread of V at the optimum.
        experiments: whole experiments behind the certificate, of 7 realizations and 2 periods.
        noise_repeats: runs of one realization with new noise each.
        random_sets: parameter sets of the amplitude search.
        agreement_realizations: M behind the comparison of fast and robust method.
        record_repeats: experiments behind the comparison on short records.
    """

    sweep_amplitudes: int = 25
    sweep_realizations: int = 40
    sweep_periods: int = 4
    friction_realizations: int = 40
    transmission_realizations: int = 100
    both_realizations: int = 40
    robust_periods: int = 4
    repeats: int = 10
    experiments: int = 200
    noise_repeats: int = 200
    random_sets: int = 20
    agreement_realizations: int = 400
    record_repeats: int = 40

    @property
    def amplitudes(self) -> np.ndarray:
        """Amplitudes of the sweep in rad."""
        return np.round(np.geomspace(1e-3, 1e-1, self.sweep_amplitudes), 6)


FULL = Settings()
QUICK = Settings(
    sweep_amplitudes=25,
    sweep_realizations=8,
    sweep_periods=2,
    friction_realizations=10,
    transmission_realizations=10,
    both_realizations=40,
    robust_periods=2,
    repeats=4,
    experiments=24,
    noise_repeats=24,
    random_sets=2,
    agreement_realizations=60,
    record_repeats=8,
)
