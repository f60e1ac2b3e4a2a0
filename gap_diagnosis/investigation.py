"""One diagnosis: from recorded runs to causes and a remainder, stage after stage."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from fjr_kit.telling import Progress
from fjr_records.periodic import RecordedExperiment, RecordedRealization
from fjr_records.records import Record, RecordSet

from .by_turns import judged
from .fits.cell_fits import DRIFT, CellFitter
from .fits.comparison import NOTHING_LEFT, CellFit
from .fits.estimates import moved_by_scatter, relative_scatter
from .fits.unseen_friction import SCATTER
from .gates.bag_deviations import GROUPS
from .gates.bags_gate import as_bags, drift_of_runs, run_changes, scattering
from .gates.by_run import seen_by_run
from .gates.run_inertias import different_inertias, inertias_differ
from .gates.run_loads import different_loads, loads_differ
from .how_far.steady_view import SteadyView
from .model.evidence import Evidence
from .model.quasi_static import NOTE as QUASI_STATIC
from .model.quasi_static import Stations
from .model.record_length import within
from .model.rig_model import Model
from .model.steady_runs import SteadyRuns
from .outcome.cause import LEAST_PRESENT
from .outcome.diagnosis import Bags, Diagnosis
from .outcome.verdict_words import BACKWARDS, LOST, ROUNDING
from .searching import at_its_time, misses
from .starts.catalogue import catalogue
from .starts.search_space import TOLERANCE
from .verdict.between_regressions import reaching_to_torques
from .verdict.coarse_encoder import with_coarse_encoder
from .verdict.contenders import contenders
from .verdict.judgement import driven_backwards, judge, reproduced
from .verdict.noisy_torque import beside_the_noise, unfelt_noise
from .verdict.notes import of_fit, of_records, yielding
from .verdict.tested_causes import Tested, octaves_left
from .which.found import Found
from .which.late_torque import is_late
from .which.narrow_band import narrow
from .which.rounding import beside_rounding
from .which.torque_timing import Timing, timed

ASSUMED = (
    "How far friction scatters from run to run cannot be seen in these runs; the intervals allow "
    f"for {100 * SCATTER:.0f} %. Two runs more than levels that all move enough show it."
)

_HOPELESS = 5.0
"""Times the motion: where the refit misses more, nothing is searched, for no effect mends that but
friction where the datasheet has none at all, so that a torque drives the axis away."""
_SEARCH_SHARE = 0.6
"""Of the budget for the search; the tests of what it found take about as long as one more step."""


@dataclass(frozen=True)
class Fitted:
    """What was fitted to the runs, and what the tests of presence say of it.

    Attributes:
        fitter: fits explanations to the runs.
        found: the steps of the search.
        tested: the causes with their tests.
        tied: fits in which another effect does as well in place of one of the causes.
    """

    fitter: CellFitter
    found: Found
    tested: tuple[Tested, ...]
    tied: tuple[CellFit, ...]

    @property
    def evidence(self) -> Evidence:
        """The runs in windows, and what plays them."""
        return self.fitter.evidence

    @property
    def models(self) -> dict[str, Model]:
        """The model of each step by name: refit, then each cause that was added."""
        refit, *causes = self.found.steps
        return {"refit": refit.model, **{" + ".join(fit.effects): fit.model for fit in causes}}


@dataclass(frozen=True)
class Investigation:
    """Everything that a diagnosis rests on.

    Attributes:
        recorded: the experiment of steady periods, or the records.
        nominal: the nominal model.
        diagnosis: the outcome.
        fitted: what was fitted; None where a gate forbids it.
        steady: what only steady periods show; None for records.
    """

    recorded: RecordedExperiment | RecordSet
    nominal: Model
    diagnosis: Diagnosis
    fitted: Fitted | None
    steady: SteadyView | None = None

    @property
    def runs(self) -> Sequence[RecordedRealization | Record]:
        """All runs that were recorded."""
        if isinstance(self.recorded, RecordedExperiment):
            return self.recorded.realizations
        return self.recorded.records


@dataclass(frozen=True)
class Order:
    """What is asked of a diagnosis.

    Attributes:
        nominal: datasheet values by the names of PLANT.
        tolerance: how far one may be off, relative.
        effects: identifiers to look for; None for all.
        budget_s: time for search and tests together, from here on; what is begun is ended.
        progress: told what is done.
        begun: when it was given (s, `time.monotonic`).
        drift: whether friction that drifts is one of all, where runs tell when they began.
    """

    nominal: Mapping[str, float]
    tolerance: float = TOLERANCE
    effects: Sequence[str] | None = None
    budget_s: float = math.inf
    progress: Progress = lambda _: None
    begun: float = field(default_factory=time.monotonic)
    drift: bool = False

    @property
    def search_ends(self) -> float:
        """When the search may begin nothing new (s, `time.monotonic`)."""
        now = time.monotonic()
        return now + _SEARCH_SHARE * max(self.begun + self.budget_s - now, 0.0)


def investigate_runs(
    records: RecordSet, order: Order, slow: Stations | None = None
) -> Investigation:
    """Diagnose the gap between recorded runs and the nominal simulation.

    Args:
        records: from `read_records`, or `steady_runs` of an experiment.
        order: what is asked.
        slow: stations of the records, where they are to be compared by torque alone.

    Raises:
        InputError: records too short for any window, a controller that is described badly, or an
            effect of an unknown name.
    """
    nominal, tolerance, progress, until = (
        order.nominal, order.tolerance, order.progress, order.search_ends,
    )  # fmt: skip
    model = Model.nominal(nominal)
    names = catalogue(
        model.plant, order.effects, linear_axis=records.linear, swings_free=records.swings_free
    )
    if order.drift and order.effects is None:
        names.append(DRIFT)
    if slow is None:
        records, cut = within(records)
        progress("windows and noise")
        timing = timed(records, nominal, tolerance, progress)
        fitter, begun_with = beside_rounding(timing.fitter, Found([timing.refit]), progress)
        timing = replace(timing, fitter=fitter, refit=begun_with.best)
    else:
        cut = []
        progress("torque of the slow motion")
        fitter = CellFitter(Evidence(records, nominal, slow), model.plant, tolerance)
        timing = Timing(fitter, fitter.refit(), (QUASI_STATIC,))
    resists = any(model.plant.get(name) for name in GROUPS["friction"])
    if misses(timing.fitter, timing.refit) > _HOPELESS and resists:
        names = []
    timing, found = at_its_time(timing, names, progress, until)
    fitter = timing.fitter
    if found.best.effects:
        fitter, found = beside_rounding(fitter, found, progress)
    evidence, heard = fitter.evidence, [*timing.notes]
    heard += [is_late(timing.late_s)] if timing.late_s else []
    progress("scatter from run to run")
    bags, scatter, said = _run_scatter(fitter, found.best)
    heard += said
    found, tested, tied = judged(fitter, found, scatter, names, progress, until)
    backwards = driven_backwards(evidence)
    lost = reproduced(fitter, found.best) < LEAST_PRESENT
    if backwards or ((tested or not names) and lost):
        found, tested, tied = replace(found, steps=found.steps[:1]), [], {}
        heard.append(BACKWARDS if backwards else LOST)
    named = [t.effect for t in tested]
    heard += yielding(named, fitter.misfit(found.best))
    heard += narrow(named, octaves_left(fitter, found.best))
    alternatives = {effect: [fit.effects[-1] for fit in fits] for effect, fits in tied.items()}
    progress("judgement")
    notes = [*records.notes, *cut, *heard, *of_records(evidence, nominal), *of_fit(found)]
    fitted, unfelt = fitter, unfelt_noise(fitter, found.best)
    if unfelt is not None:
        fitter, notes = copy.copy(fitter), [*notes, unfelt.note]
        fitter.evidence = unfelt.counted(evidence)
    diagnosis = judge(fitter, model, found, tested, alternatives, bags, scatter, notes)
    rivals = tuple(fit for fits in tied.values() for fit in fits)
    if unfelt is not None:
        diagnosis = beside_the_noise(diagnosis, fitted, found.best, unfelt)
    else:
        diagnosis = reaching_to_torques(diagnosis, fitted, found.best)
    chosen_of = {"contenders": contenders(fitter, found, rivals)}
    diagnosis = diagnosis.model_copy(update=chosen_of)
    if order.effects is None or ROUNDING in order.effects:
        fitter, found, diagnosis = with_coarse_encoder(fitter, model, found, diagnosis)
    return Investigation(records, model, diagnosis, Fitted(fitter, found, tuple(tested), rivals))


def _run_scatter(
    fitter: CellFitter, best: CellFit
) -> tuple[Bags | None, dict[str, float], list[str]]:
    """Return how far parameters scatter from run to run, seen or assumed, and sentences on it.

    Where inertia or load of runs differs, their friction only seems to scatter: that is not known.
    """
    evidence = fitter.evidence
    changes = run_changes(evidence, best.variance, best.model)
    seen = seen_by_run(evidence, best.model)
    inertias, loads = different_inertias(evidence, seen), different_loads(evidence, seen)
    if inertias or loads:
        linear = evidence.records.linear
        told = [inertias_differ(inertias, linear)] if inertias else []
        told += [loads_differ(loads, linear)] if loads else []
        bags = None if changes is None else as_bags(changes, evidence)
        if bags is not None:
            bags = bags.model_copy(update={"scatter_known": False})
        return bags, relative_scatter(bags), told
    if changes is None and fitter.misfit(best) < NOTHING_LEFT:
        return None, {}, []  # what scatters would be left on runs that no fit has seen
    if changes is None:
        scatter = dict.fromkeys(GROUPS["friction"], SCATTER)
        if not moved_by_scatter(best, fitter.runs, scatter).any():
            return None, {}, []
        return None, scatter, [ASSUMED]
    bags = as_bags(changes, evidence, fitter.misfit(best) < NOTHING_LEFT)
    drift = "" if isinstance(evidence.records, SteadyRuns) else drift_of_runs(bags)
    said = [sentence for sentence in (scattering(bags), drift) if sentence]
    return bags, relative_scatter(bags), said
