"""A coarse encoder as a cause of records: named where it and noise explain all that is left.

Every recorded position is a multiple of the step then, so that the step needs no fit, and that the
encoder counts needs no test. What is asked is whether that matters: the best explanation must leave
on unseen parts no more than noise and rounding explain, while by the noise that is seen from repeat
to repeat, or at a standstill, much is left. Where no such noise is seen nothing is named: what the
highest lines of rounded positions show is the rounding itself.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..fits.cell_fits import CellFitter
from ..fits.comparison import NOTHING_LEFT, CellFit
from ..how_far.ledger import Ledger
from ..model.evidence import Evidence
from ..model.rig_model import Model
from ..outcome.cause import Cause
from ..outcome.diagnosis import Diagnosis, Step
from ..outcome.gap_size import Estimate, GapFigures
from ..outcome.verdict_words import ROUNDING
from ..which.found import Found
from ..which.rounding import STEP, step_of, with_step
from .judgement import FEWEST_PARTS, PLAIN, gaps_of, verdict_of
from .notes import rounding

_CERTAIN = 60.0
"""Least fall of the chi-square of unseen parts, whatever its share."""
_ALONE, _BESIDE = 1.25, 2.0
"""Least ratio of the misfit by noise alone to that by noise and rounding: where nothing else is
named, and beside other causes."""
_BY_CHANCE = {False: 1.0, True: 0.5}
"""Misfit that noise and rounding leave by chance, at the least: where rounding is simulated, the
noise that is seen is in part made by the same counts, and stands twice in their variance."""
_OFF = 1e-3  # of the step, which is known better than that
_LEAST_PRESENT, _MOST_PRESENT = 0.5, 0.99


@dataclass(frozen=True)
class _Misfits:
    """What the best explanation leaves on unseen parts, mean square over variances.

    Attributes:
        by_noise: over the noise that is seen without rounding.
        by_both: over noise and rounding; at least what that leaves by chance.
        apart: the same beside friction that scatters from run to run, as the search counts.
        numbers: how many errors there are.
    """

    by_noise: float
    by_both: float
    apart: float
    numbers: int

    def present(self, beside: bool) -> float:
        """Return the probability that rounding is what is left; 0 where it is not named.

        Args:
            beside: whether other causes are named.
        """
        ratio = self.by_noise / self.by_both
        much = self.by_noise >= NOTHING_LEFT and self.apart < PLAIN
        certain = (self.by_noise - self.by_both) * self.numbers >= _CERTAIN
        if not much or not certain or ratio < (_BESIDE if beside else _ALONE):
            return 0.0
        found = (1.0 - 0.5 / ratio) * min(NOTHING_LEFT / self.apart, 1.0)
        return min(found, _MOST_PRESENT) if found >= _LEAST_PRESENT else 0.0


def with_coarse_encoder(
    fitter: CellFitter, nominal: Model, found: Found, diagnosis: Diagnosis
) -> tuple[CellFitter, Found, Diagnosis]:
    """Return what names the rounding of the encoder as the last cause, if it is what is left.

    The fitter that is returned plays a model that rounds by what rounding does to it on the
    average, and all others as they are.

    Args:
        fitter: of the search, for which rounding is noise.
        nominal: the datasheet's model.
        found: the steps of the search; its last fit holds the causes that are named.
        diagnosis: without the rounding.
    """
    evidence, noise, best = fitter.evidence, fitter.evidence.noise, found.best
    few = len(evidence.parts_for("select")) < FEWEST_PARTS
    if few or evidence.slow or not noise.rounds or math.isnan(noise.seen_rad):
        return fitter, found, diagnosis
    present = _misfits(fitter, best).present(bool(best.effects))
    if not present:
        return fitter, found, diagnosis
    named = copy.copy(fitter)
    named.evidence = evidence.played_by(evidence.player.naming(), evidence.noise_power)
    rounded = _with_step(best, step_of(evidence))
    told = _told(named.evidence, nominal, [*found.steps, rounded], diagnosis, present)
    return named, replace(found, steps=[*found.steps, rounded]), told


def _by_noise_alone(evidence: Evidence) -> Evidence:
    """Return the same runs as if nothing were rounded, beside the noise that is seen."""
    seen = evidence.power_beside_twist(np.array(evidence.noise.seen_rad**2))
    return evidence.played_by(evidence.player.adding(None), seen)


def _misfits(fitter: CellFitter, best: CellFit) -> _Misfits:
    evidence, parts = fitter.evidence, fitter.select_parts

    def left(evidence: Evidence) -> float:
        return Ledger(evidence, parts).step(best.model, None, "refit").chi2_per_dof or 0.0

    least = _BY_CHANCE[evidence.player.adds]
    both = max(left(evidence), least)
    numbers = int(fitter.weights.counts.sum())
    return _Misfits(left(_by_noise_alone(evidence)), both, fitter.misfit(best), numbers)


def _with_step(fit: CellFit, step: float) -> CellFit:
    """Return a fit with the step of the encoder (rad), which is known and not fitted."""
    space, solution = fit.space, fit.solution
    return replace(
        fit,
        effects=(*fit.effects, ROUNDING),
        model=with_step(fit.model, step),
        space=replace(space, effects=(*space.effects, STEP), units=(*space.units, step)),
        solution=replace(
            solution,
            x=np.append(solution.x, 1.0),
            jacobian=np.hstack([solution.jacobian, np.zeros((solution.residuals.size, 1))]),
        ),
    )


def _told(
    evidence: Evidence,
    nominal: Model,
    fits: Sequence[CellFit],
    diagnosis: Diagnosis,
    present: float,
) -> Diagnosis:
    """Return a diagnosis with the rounding as a cause more.

    Steps before it count by the noise alone, so that its own shows what it explains. Where rounding
    acts as white noise it closes nothing of the gap, so that no share is stated.

    Args:
        evidence: that plays models with rounding by what that does on the average.
        nominal: the datasheet's model.
        fits: refit, causes, and the last of these with the rounding.
        diagnosis: without it.
        present: probability that it is there.
    """
    refit, best, rounded = fits[0].model, fits[-2].model, fits[-1].model
    ledger, alone = Ledger(evidence), Ledger(_by_noise_alone(evidence))
    moves = evidence.player.adds
    cause = Cause(
        effect=ROUNDING,
        present=present,
        share=ledger.share(best, rounded, refit) if moves else None,
        where=alone.places_of_error(best),
        parameters=_known(rounded),
    )
    causes = sorted([*diagnosis.causes, cause], key=lambda c: -(c.share.value if c.share else 0.0))
    steps = [
        alone.step(nominal, None, "nominal"),
        alone.step(refit, None, "refit"),
        *(alone.step(fit.model, fit.effects[-1], "cause") for fit in fits[1:-1]),
        ledger.step(rounded, ROUNDING, "cause"),
    ]
    models = {"nominal": nominal, "refit": refit, "explained": rounded}
    figures = GapFigures(**ledger.figures(models, closes=bool(diagnosis.causes)))
    closed = None if figures.position is None else figures.position.closed
    told = {
        "verdict": verdict_of(causes, steps, evidence, thin=False),
        "effects": [one.effect for one in causes],
        "equivalent": [[one.effect, *one.others] for one in causes],
        "confidence": min(one.present for one in causes),
        "causes": causes,
        "steps": steps,
        "remainder": ledger.remainder(rounded, refit),
        "gap": gaps_of(steps, ledger.noise()),
        "gap_closed": None if closed is None else closed.value,
        "gap_figures": figures,
        "where": alone.places_of_error(refit),
        "parameters": diagnosis.parameters | _known(rounded),
        "notes": [*diagnosis.notes, _note(ledger, fits[-2], rounded, steps)],
    }
    return diagnosis.model_copy(update=told)


def _known(rounded: Model) -> dict[str, Estimate]:
    """Return the step of the encoder, which the record shows as it is."""
    step = rounded.effects[STEP]
    return {STEP: Estimate(value=step, low=(1.0 - _OFF) * step, high=(1.0 + _OFF) * step)}


def _note(ledger: Ledger, best: CellFit, rounded: Model, steps: Sequence[Step]) -> str:
    """Return the note on what all else leaves beside what rounding makes."""
    played = ledger.evidence.player.adding(None).run([rounded, best.model], ledger.runs)
    records = [ledger.evidence.records.records[index] for index in ledger.runs]
    made = [
        np.mean((counted[0] - smooth[0]) ** 2) / np.var(record.position)
        for counted, smooth, record in zip(*played, records, strict=True)
    ]
    before, last = steps[-2:]
    return rounding(
        rounded.effects[STEP],
        before.nrmse_position or 0.0,
        float(np.sqrt(np.mean(made))),
        (before.chi2_per_dof or 0.0, last.chi2_per_dof or 0.0),
        best.effects,
    )
