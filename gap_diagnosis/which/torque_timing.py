"""Where the recorded torque drives the model: was it held from sample to sample, or a signal?

Both differ by half a sample, as a delay does. Which of them it was shows in the end: while causes
are missing, a delay does in part what they would, and half a sample of it may decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from fjr_kit.telling import Progress
from fjr_records.records import RecordSet

from ..fits.cell_fits import CellFitter
from ..fits.comparison import CellFit
from ..fits.gains import gain, stands_for
from ..model.evidence import Evidence
from ..model.record_torque import CONTINUOUS, with_continuous_torque
from ..model.rig_model import Model

_IS_HELD = 0.2
"""Of a sample: how far from half a sample may lie what comes late of a signal that is held."""
_LATE = {"delay": "delay.time_s", "actuator_lag": "actuator_lag.time_constant_s"}


@dataclass(frozen=True)
class Timing:
    """What a search begins with.

    Attributes:
        fitter: of the records, their torque being held or a signal.
        refit: fit of the base parameters alone.
        notes: sentences on it.
        held: whether the torque is held from sample to sample.
        other: the same with a torque that acts in the other way; None where a loop makes it, or
            that is out of the question.
        late_s: by how much it was brought forward, s.
    """

    fitter: CellFitter
    refit: CellFit
    notes: tuple[str, ...] = ()
    held: bool = True
    other: Timing | None = None
    late_s: float = 0.0

    def other_if_better(self, best: CellFit, sought: Sequence[str]) -> Timing | None:
        """Return the other way, if what was found speaks for it.

        A signal that was found to come half a sample late is one that is held; a torque that was
        held while causes were missing may do clearly better as a signal beside them, and so may a
        signal as a torque that is held, where no delay was sought.

        Args:
            best: what was found.
            sought: identifiers of the effects that were looked for.
        """
        other = self.other
        if other is None:
            return None
        rate = self.fitter.evidence.records.sample_rate_hz
        late = [e for e in best.effects if e in _LATE and _half(best.model, e, rate)]
        if self.held or not {*sought} & {*_LATE}:
            in_the_other = other.fitter.taken_over(best)
            return other if gain(self.fitter, in_the_other, best).present else None
        if not late:
            return None
        (effect,) = late[:1]
        worth = gain(self.fitter, best, self.fitter.without(best, effect)).mean
        held = other.fitter.without(best, effect)
        return other if stands_for(self.fitter, held, best, worth) else None


def _half(model: Model, effect: str, rate: float) -> bool:
    return abs(model.effects[_LATE[effect]] * rate - 0.5) < _IS_HELD


def timed(
    records: RecordSet, nominal: Mapping[str, float], tolerance: float, progress: Progress
) -> Timing:
    """Return the fit of the base parameters, with a torque that acts as unseen parts call for.

    Where no loop makes it, the recorded torque drives the model: held, unless it is no command and
    does clearly better as a signal. Both may come late, so that half a sample of delay decides
    nothing. A signal that comes half a sample late is one that is held.
    """
    plant = Model.nominal(nominal).plant
    progress("refit of the base parameters")
    fitter = CellFitter(Evidence(records, nominal), plant, tolerance)
    refit, loop = fitter.refit(), fitter.evidence.simulator.loop
    held = Timing(fitter, refit)
    if None not in loop.laws or loop.commanded:
        return held
    progress("refit with a torque that is not held")
    other = fitter.with_runs(with_continuous_torque(records, loop))
    again = other.refit()
    late = _late(other, again)
    if "delay" in late.effects and _half(late.model, "delay", records.sample_rate_hz):
        return held
    signal = Timing(other, again, (CONTINUOUS,), held=False)
    if gain(fitter, late, _late(fitter, refit)).present:
        return replace(signal, other=held)
    return replace(held, other=signal)


def _late(fitter: CellFitter, refit: CellFit) -> CellFit:
    """Return a fit with a delay, taken to its end, where that gains."""
    proposals = fitter.screening(refit, "delay").proposals()
    delayed = fitter.add(refit, "delay", proposals) if proposals else None
    if delayed is None or fitter.gains(delayed, refit).sum() <= 0.0:
        return refit
    return delayed if delayed.solution.converged else fitter.further(delayed)
