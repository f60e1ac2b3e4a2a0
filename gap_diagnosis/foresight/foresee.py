"""What a diagnosis could show of a rig by an experiment: parameters and effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fjr_kit.telling import CountedProgress
from fjr_records.periodic import RecordedExperiment
from fjr_records.records import RecordSet
from fjr_sim_node import effects as fx

from ..gates.gate_checks import check_gates
from ..model.nominal import refuse_too_stiff
from ..model.rig_model import Model
from ..model.steady_runs import steady_runs
from ..starts.catalogue import catalogue
from ..starts.scales import Scales
from ..starts.search_space import TOLERANCE
from .bare_parameters import bare_refit, parameters
from .effect_limits import EffectLimits
from .foreseen import ForeseenEffect, Foresight
from .sight import Sight

NOISE_UNKNOWN = (
    "The noise is not known, so limits count only what the simulation itself may be off by, 0.1 %; "
    "give the encoder's noise (--set simulator.noise_std_rad=...), or record two periods or more."
)
GATE_FAILS = "A gate of the diagnosis would fail, so that these limits would not hold: {}"
BESIDE_A_REMAINDER = (
    "Records: limits hold for a rig that the nominal describes but for the effect; beside a "
    "remainder more is needed."
)


def foresee(
    recorded: RecordedExperiment | RecordSet,
    nominal: Mapping[str, float],
    *,
    realizations: int | None = None,
    tolerance: float = TOLERANCE,
    effects: Sequence[str] | None = None,
    showing: float = 1.0,
    progress: CountedProgress = lambda *_: None,
) -> Foresight:
    """Say which parameters and effects a diagnosis of an experiment could show.

    Args:
        recorded: bags of a rig, or what a plan is expected to record
            (`planned_record` of `fjr_bringup`); the nominal plays the rig in both.
        nominal: values of the bare plant's parameters in SI units, as for `diagnose`.
        realizations: how many each level will have, where `recorded` holds a few that stand for
            all; None for those that are there.
        tolerance: how far a datasheet value may be off, relative: a parameter counts as
            identifiable if its standard error is below.
        effects: identifiers to look at; None for the catalogue.
        showing: sizes at which an effect shows so many times what a diagnosis needs, in place of
            detection limits.
        progress: told which effect is looked at.

    Raises:
        InputError: an effect of an unknown name, a controller of an unknown kind, or a nominal
            that moves too fast to be simulated at the rate of the samples, or diverges.
    """
    refuse_too_stiff(nominal, recorded.sample_rate_hz, "nominal")
    bare = Model.nominal(nominal)
    names = catalogue(bare.plant, effects)
    if effects is None or "nonstationary" in effects:
        names = [*names, "nonstationary"]
    runs: RecordSet
    if isinstance(recorded, RecordedExperiment):
        levels = [f"{1e3 * amplitude:.3g} mrad" for amplitude in recorded.amplitudes_rad]
        kind, runs = "periodic", steady_runs(recorded)
    else:
        kind, runs, levels = "records", recorded, [f"level {level}" for level in recorded.levels]
    sight = Sight(runs, bare, levels, realizations)
    refit = bare_refit(sight, bare)
    limits = EffectLimits(sight, bare, refit, showing)
    found = []
    for number, name in enumerate(names):
        progress(number, len(names), name)
        found.append(limits.find(name))
    told = [
        one.model_copy(update={"not_told_from": limits.not_told_from(one.effect)}) for one in found
    ]
    notes = [] if sight.noise_known else [NOISE_UNKNOWN]
    if isinstance(recorded, RecordedExperiment):
        failures = check_gates(recorded, bare).failures
        notes = [GATE_FAILS.format(gate.sentence) for gate in failures] + notes
    return Foresight(
        source=recorded.source,
        kind=kind,
        levels=levels,
        tolerance=tolerance,
        parameters=parameters(sight, refit, tolerance),
        effects=sorted(told, key=lambda one: _rank(one, sight.scales)),
        notes=notes + ([BESIDE_A_REMAINDER] if kind == "records" else []),
    )


def _rank(one: ForeseenEffect, scales: Scales) -> tuple[bool, int]:
    """Order: those with a limit first, as in the catalogue."""
    return one.limit is None, list(fx.EFFECTS).index(one.effect)
