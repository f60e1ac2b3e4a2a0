"""The judgement on records: causes that are present, the gap step by step, and the remainder."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .how_far.record_ledger import Ledger
from .model.evidence import Evidence
from .model.simulated_rig import Model
from .outcome.diagnosis import (
    Bags,
    Candidate,
    Cause,
    Diagnosis,
    Estimate,
    EvidenceKind,
    Figure,
    Gap,
    Gaps,
    Step,
    Verdict,
)
from .which.cell_fits import CellFit, CellFitter
from .which.gains import Gain, closed, fall, gain
from .which.presence import (
    LEAST_INVARIANCE_P,
    SAME_WORTH,
    Invariance,
    at_its_bound,
    beyond_zero,
    cell_estimates,
    invariance,
    where_it_acts,
)
from .which.ripples_passed import doubt_of_shape, ripples_passed
from .which.stepwise import NOTHING_LEFT, Found

PLAIN = 4.0
"""The same for the refit where no effect gains anything."""
FEWEST_PARTS = 6
"""Parts that select, below which the evidence is too thin for any name."""

LEAST_PRESENT = 0.5
"""A cause that is there less often than not is not called present."""
LEAST_IN_BAND = 0.8
"""Of what is left in its best band, what a cause must close if its share of all is not certain."""
_UNCERTAIN = 0.5  # of what a cause whose size is not certain would be present
_DOUBTED = 0.7  # over what remains: a cause that closes such a share is there as often as not
_LITTLE = 0.2  # of what it closes and what is left: less is there less often than its band says
_IF_NOTHING = 0.75  # of what a cause would be present, where all of that is left

THIN = (
    "The records are too short or too few to hold anything out of the fits, so nothing is named: "
    "record more or longer runs."
)


@dataclass(frozen=True)
class Tested:
    """A cause and what its tests say.

    Attributes:
        effect: its identifier.
        gain: what leaving it out loses on unseen parts.
        without: the fit that lacks it.
        invariance_p: see `Invariance`; None with one level.
        own_sizes: how much a size of its own at each level would close beyond, of what it closes,
            on unseen parts; 0 where chance explains that sizes differ.
        certain: whether the interval of its size lacks zero.
        bounded: whether a parameter lies where the fit may go no further.
        share: how much of what the refit left comes back without it, on unseen parts that select.
        left: how much of that is left with it and all others.
        in_band: how much of what is left without it, it closes where it gains most; see `closed`.
        ripples: how many of its ripples the motion passes; infinite for what has none.
    """

    effect: str
    gain: Gain
    without: CellFit
    invariance_p: float | None
    certain: bool
    bounded: bool
    share: Figure
    left: float
    in_band: float
    ripples: float = math.inf
    own_sizes: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether the cause is called present."""
        return self.certain and self.passes_beside_size

    @property
    def passes_beside_size(self) -> bool:
        """Whether it passes all tests but that of its own size, which another cause may blur."""
        closes = self._closes
        least = LEAST_PRESENT if self.certain else _UNCERTAIN * LEAST_PRESENT
        there = self.gain.present and closes and not self.bounded
        return there and self.invariant and self.present >= least

    @property
    def invariant(self) -> bool:
        """Whether its size may be the same at all levels, or differs by what closes no more."""
        chance = self.invariance_p is None or self.invariance_p >= LEAST_INVARIANCE_P
        return chance or self.own_sizes <= SAME_WORTH

    @property
    def _closes(self) -> bool:
        """Whether some of the gap comes back without it; where one part decides, in its best band.

        Where friction stops a motor is chance, and a few such places hold most of a squared error.
        """
        low, high = self.share.low, self.share.high
        if low is None or not low <= 0.0:  # NaN: one part says nothing
            return True
        return high is not None and high > 0.0 and self.in_band >= LEAST_IN_BAND

    @property
    def present(self) -> float:
        """Probability that it is there.

        A cause that closes little of the gap, and little even in the band where it gains most, may
        be a part of what no effect explains. Of 11 causes of the blind checks 307 to 311 that
        closed less than a quarter of what was left, 6 were right, stated at 0.79 in the mean.
        """
        sure = (1.0 - min(1.0, 5.0 * self.gain.p)) * min(1.0, self.gain.share + 0.1)
        of_all = self.share.low if self.share.low is not None and self.share.low > 0.0 else 0.0
        closed = max(self.in_band, of_all, 0.0)
        sure *= closed / (closed + _DOUBTED * (1.0 - closed))
        share = max(0.0, self.share.value)
        beside_left = share / max(share + self.left, 1e-300)
        sure *= _IF_NOTHING + (1.0 - _IF_NOTHING) * min(beside_left / _LITTLE, 1.0)
        sure *= doubt_of_shape(self.ripples)
        if not self.certain or self.bounded:
            sure *= _UNCERTAIN
        if not self.invariant:
            sure *= 0.5
        return min(sure, 0.99)


def tested_causes(
    fitter: CellFitter, fit: CellFit, refit: CellFit, scatter: Mapping[str, float]
) -> list[Tested]:
    """Return every cause of a fit with its tests, all others fitted anew without it.

    Args:
        fitter: of the search.
        fit: with the causes.
        refit: of the base parameters alone.
        scatter: of parameters from run to run, see `moved_by_scatter`.
    """
    ledger = Ledger(fitter.evidence, fitter.select_parts)
    fewer = {effect: fitter.without(fit, effect) for effect in fit.effects}
    estimates = cell_estimates(fit, fitter, scatter, fewer)
    squares = [float(ledger.squares(each.model).sum()) for each in (fit, refit)]
    left = squares[0] / max(squares[1], 1e-300)
    found = []
    for effect, without in fewer.items():
        sizes = invariance(fitter, fit, effect, scatter)
        found.append(
            Tested(
                effect,
                gain(fitter, fit, without, fitter.acted(fit, effect)),
                without,
                None if sizes is None else sizes.p,
                beyond_zero(effect, estimates, fall(fitter, fit, without)),
                at_its_bound(fit, effect),
                ledger.share(without.model, fit.model, refit.model),
                left,
                closed(fitter, fit, without),
                ripples_passed(fit.model, effect, fitter.scales),
                _own_sizes(ledger, fit, without, sizes),
            )
        )
    return found


def _own_sizes(ledger: Ledger, fit: CellFit, without: CellFit, sizes: Invariance | None) -> float:
    """Return what `Tested.own_sizes` is."""
    if sizes is None or sizes.p >= LEAST_INVARIANCE_P:
        return 0.0
    common, bare = ledger.squares(fit.model), ledger.squares(without.model)
    level = np.array([ledger.evidence.parts[p].level for p in ledger.parts])
    beyond = 0.0
    for one, model in sizes.own.items():
        beyond += float((common - ledger.squares(model))[level == one].sum())
    return beyond / max(float((bare - common).sum()), 1e-300)


def judge_records(
    fitter: CellFitter,
    nominal: Model,
    found: Found,
    tested: Sequence[Tested],
    alternatives: dict[str, list[str]],
    bags: Bags | None,
    scatter: Mapping[str, float],
    notes: Sequence[str],
) -> Diagnosis:
    """Return the diagnosis of records whose search has ended.

    Args:
        fitter: of the search.
        nominal: the datasheet's model.
        found: the steps of the search; its last fit holds the causes that are kept.
        tested: these causes with their tests.
        alternatives: for each of them what does as well in its place.
        bags: how far parameters scatter from run to run; None where that cannot be seen.
        scatter: the same, or what is assumed instead, see `moved_by_scatter`.
        notes: sentences on the records.
    """
    evidence, best, refit = fitter.evidence, found.best, found.steps[0]
    ledger = Ledger(evidence)
    thin = len(evidence.parts_for("select")) < FEWEST_PARTS
    estimates = cell_estimates(best, fitter, scatter, {t.effect: t.without for t in tested})
    causes = (
        [] if thin else [_cause(t, fitter, ledger, found, alternatives, estimates) for t in tested]
    )
    causes.sort(key=lambda c: -(c.share.value if c.share else 0.0))
    steps = [
        ledger.step(nominal, None, "nominal"),
        ledger.step(refit.model, None, "refit"),
        *(ledger.step(fit.model, fit.effects[-1], "cause") for fit in found.steps[1:]),
    ]
    verdict = _verdict(causes, steps, evidence, thin)
    ends = {"nominal": steps[0], "refit": steps[1], "explained": steps[-1]}
    gaps = {
        name: Gap(
            nrmse_position=s.nrmse_position,
            nrmse_torque=s.nrmse_torque,
            chi2_per_dof=s.chi2_per_dof,
        )
        for name, s in ends.items()
    }
    return Diagnosis(
        verdict=verdict,
        effects=[cause.effect for cause in causes],
        equivalent=[[cause.effect, *cause.others] for cause in causes],
        confidence=min((c.present for c in causes), default=0.5),
        evidence=EvidenceKind(
            noise=evidence.noise.source,
            reported_on=evidence.reported_on,
            controller=evidence.simulator.loop.kind,
            excitation="record",
            compared="torque" if evidence.slow else "motion",
        ),
        causes=causes,
        steps=steps,
        remainder=ledger.remainder(best.model, refit.model),
        gap=Gaps(**gaps, noise_floor=ledger.noise()),
        gap_closed=_closed(ledger, refit.model, best.model) if causes else None,
        where=ledger.places_of_error(refit.model),
        bags=bags,
        ranking=_ranking(fitter, found),
        parameters=estimates,
        notes=[*([THIN] if thin else []), *notes],
    )


def _closed(ledger: Ledger, refit: Model, best: Model) -> float:
    return 1.0 - float(ledger.squares(best).sum() / max(ledger.squares(refit).sum(), 1e-300))


def _cause(
    tested: Tested,
    fitter: CellFitter,
    ledger: Ledger,
    found: Found,
    alternatives: dict[str, list[str]],
    estimates: dict[str, Estimate],
) -> Cause:
    parameters = {n: e for n, e in estimates.items() if n.startswith(f"{tested.effect}.")}
    moved = where_it_acts(fitter, found.best, tested.without, ledger.parts)
    return Cause(
        effect=tested.effect,
        others=alternatives.get(tested.effect, []),
        present=tested.present,
        share=ledger.share(tested.without.model, found.best.model, found.steps[0].model),
        invariance_p=tested.invariance_p,
        where=ledger.places(moved),
        parameters=parameters,
    )


def _verdict(
    causes: Sequence[Cause], steps: Sequence[Step], evidence: Evidence, thin: bool
) -> Verdict:
    known = evidence.noise.known
    left = steps[-1].chi2_per_dof
    if causes:
        if known and left is not None and left < NOTHING_LEFT:
            return "ambiguous" if any(cause.others for cause in causes) else "effect"
        return "partly_explained"
    if known and not thin:
        if steps[0].chi2_per_dof is not None and steps[0].chi2_per_dof < NOTHING_LEFT:
            return "no_gap"
        if steps[1].chi2_per_dof is not None and steps[1].chi2_per_dof < PLAIN:
            return "parameters_only"
    return "unexplained"


def _ranking(fitter: CellFitter, found: Found) -> list[Candidate]:
    ranked = []
    for count, fits in found.rivals.items():
        parent = found.steps[min(count, len(found.steps)) - 1]
        for fit in fits:
            ranked.append(
                Candidate(
                    effects=list(fit.effects),
                    held_out_chi2=None,
                    delta=gain(fitter, fit, parent).mean,
                    converged=fit.solution.converged,
                    parameters={
                        n: {"value": fit.model.effects[n], "low": math.nan, "high": math.nan}
                        for n in fit.space.effects
                    },
                )
            )
    return ranked
