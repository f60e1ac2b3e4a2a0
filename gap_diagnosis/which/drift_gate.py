"""Does friction drift while the rig is recorded? By a model of the whole runs.

Lines without excitation tell a drift from a transient without a model (`stationarity`); where all
lines are excited a model must: runs are played from their true start, so that a transient is in
the model as it is in the record, and a drift of friction is what it still lacks.
"""

from __future__ import annotations

from dataclasses import replace

from fjr_records.records import RecordSet

from ..fits.cell_fits import DRIFT, CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import MOST_P, Gain, closed, gain
from ..gates.gate_checks import Gate
from .stepwise import LEAST_CLOSED

_NAME = f"{DRIFT}.friction_per_s"


def drift_gate(fitter: CellFitter, refit: CellFit) -> Gate:
    """Test whether a drift of friction within runs is seen in parts that no fit has seen.

    It goes on from run to run, or begins anew in each: what gains more counts.

    Args:
        fitter: of the runs.
        refit: fit of the base parameters alone.
    """
    anew = fitter.with_runs(_anew(fitter.evidence.records))
    tried = [_drift(fitter, refit), _drift(anew, anew.refit())]
    found, change = max(tried, key=lambda one: one[0].mean)
    drifts = found.present and change != 0.0
    sentence = "unseen parts of the runs do not show that friction drifts within a run."
    if drifts:
        sentence = (
            f"friction drifts within runs, by {change:+.2g} % per second of what it is at the "
            f"start (parts that no fit has seen gain {found.mean:.2g} nats by it; chance does so "
            f"in {found.p:.1g} of rigs); let the rig warm up before recording."
        )
    return Gate(
        name="stationary within runs",
        passed=not drifts,
        value=found.p,
        limit=MOST_P,
        sentence=sentence,
        hint="nonstationary",
        of_periods=True,
    )


def _drift(fitter: CellFitter, refit: CellFit) -> tuple[Gain, float]:
    """Return what a drift gains on unseen parts, and its size in percent per second."""
    fit = fitter.add(refit, DRIFT, fitter.screening(refit, DRIFT).proposals())
    if fit is None or closed(fitter, fit, refit) < LEAST_CLOSED:
        return Gain(0.0, 0.0, 0.0, 1.0), 0.0
    return gain(fitter, fit, refit), 100.0 * fit.model.effects[_NAME]


def _anew(records: RecordSet) -> RecordSet:
    """Return runs each of which starts as cold as the first."""
    return replace(records, records=tuple(replace(r, elapsed_s=0.0) for r in records.records))
