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

        A signal that was found to come half a sample late is one that is held, unless unseen parts
        surely say otherwise; one that comes late by another time may do clearly better as a held
        torque behind a delay or a lag: its means over samples lag too. A torque that was held while
        causes were missing may do clearly better as a signal beside them, and so may a signal as a
        held torque, where no delay was sought.

        Args:
            best: what was found.
            sought: identifiers of the effects that were looked for.
        """
        other = self.other
        if other is None:
            return None
        if self.held or not {*sought} & {*_LATE}:
            in_the_other = other.fitter.taken_over(best)
            return other if gain(self.fitter, in_the_other, best).present else None
        late = next((effect for effect in best.effects if effect in _LATE), None)
        if late is None:
            return None
        held = other.fitter.without(best, late)
        if _half(best.model, late, self.fitter.evidence.records.sample_rate_hz):
            worth = gain(self.fitter, best, self.fitter.without(best, late)).mean
            if stands_for(self.fitter, held, best, worth, near=True):
                return other
        tried = [_with(other.fitter, held, effect) for effect in _LATE]
        return other if any(gain(self.fitter, fit, best).present for fit in tried) else None


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
    late = _with(other, again, "delay")
    if "delay" in late.effects and _half(late.model, "delay", records.sample_rate_hz):
        return held
    signal = Timing(other, again, (CONTINUOUS,), held=False)
    if gain(fitter, late, _with(fitter, refit, "delay")).present:
        return replace(signal, other=held)
    return replace(held, other=signal)


def _with(fitter: CellFitter, fit: CellFit, effect: str) -> CellFit:
    """Return a fit with an effect, taken to its end, where that gains."""
    proposals = fitter.screening(fit, effect).proposals()
    more = fitter.add(fit, effect, proposals) if proposals else None
    if more is None or fitter.gains(more, fit).sum() <= 0.0:
        return fit
    return more if more.solution.converged else fitter.further(more)
