"""Verdicts in plain words: meaning, next step, and when not to believe them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fjr_sim_node.simulation.simulator import SIMULATOR

from .diagnosis import Diagnosis, ReportedOn, Verdict

ROUNDING = "encoder_quantization"
"""The effect that acts like noise in a loop, and is judged by its statistics."""
OUT_OF_TIME = "The time budget ended the search before all effects were tried."
"""Note of a diagnosis whose search was cut."""
SWINGS_FREE = (
    "No run has a torque, so that all sizes show only as ratios to the inertia: that of the motor "
    "is taken from the datasheet, and all other sizes are off as far as it is."
)

LOST = (
    "The best explanation still misses half of the squared motion or more, so it predicts little "
    "and none of its causes is named: check the datasheet, the factor of the torque, whether the "
    "runs are sampled fast enough for the rig, and whether another axis moved beside this one: no "
    "model of a single axis has the torques of others."
)
BACKWARDS = (
    "In most runs the torque goes against the acceleration, as if it moved a negative mass, so no "
    "cause is named: import the records with the sign of torque or position turned."
)
TWISTS = (
    "The link has an encoder, so the twist of the transmission is compared beside the motion, less "
    "what two encoders differ by: zero, scale, and time between their samples."
)
_CUT = (
    "A gap remains after the refit, and the time budget ended the search for its cause. That is "
    "no proof that no effect of the catalogue explains it: give a greater --budget, or --effects."
)
_NO_EXPERIMENT = (
    "No experiment was found that would tell them apart within the recorded torques; updated.yaml "
    "holds the first."
)
_NOT_SEARCHED = (
    "No experiment that would tell them apart was looked for: that is done for steady periods of "
    "a known loop only. Of an experiment that you plan, fjr plan --effects {members} says which "
    "of them it would not tell apart. Until then updated.yaml holds the first."
)
_WORSE = (
    "Use the nominal parameters as they are: those of updated.yaml, which were fitted, come no "
    "nearer to the rig{on}. Longer or stronger records may mend the fit."
)
_MIXED = (
    "Choose by what counts for you: than the nominal parameters the fitted ones, in updated.yaml, "
    "come nearer to the rig{on} by {nearer}, but are farther off by {farther}."
)
_OF_A_GATE: tuple[Verdict, ...] = ("bad_data", "nonstationary")
_LOOK = (
    "Look at where the gap lies below. Check mounting, encoder and logging before looking for a "
    "law of friction."
)
_ALIKE = 1.01
"""Ratio of two errors, or misfits, of which neither counts as greater."""


@dataclass(frozen=True)
class Words:
    """A verdict for a person.

    Attributes:
        headline: a few words.
        meaning: what it says about rig and simulation; {on} stands for `ON`.
        action: what to do next.
        doubt: when not to believe it.
    """

    headline: str
    meaning: str
    action: str
    doubt: str


WORDS: dict[Verdict, Words] = {
    "no_gap": Words(
        "No gap",
        "Rig and nominal simulation agree within the noise at all levels.",
        "Use the nominal parameters as they are: updated.yaml holds the refit, which noise does "
        "not tell from them.",
        "Loud noise hides small effects: look at the noise floor. Amplitudes and frequencies that "
        "were not played are not covered.",
    ),
    "parameters_only": Words(
        "Parameters only",
        "Refitted parameters of the bare plant explain the gap; no further effect is needed.",
        "Go on with updated.yaml.",
        "A torque-constant error looks exactly like all parameters scaled by one factor. An effect "
        "that needs another amplitude, a DC offset or a higher band to show is not excluded.",
    ),
    "effect": Words(
        "An effect is missing",
        "After the refit a gap remained; one explanation of the catalogue closes it{on}, and none "
        "of the others comes near.",
        "Go on with updated.yaml, which switches the effect on.",
        "Outside the recorded amplitudes and band the effect is extrapolated. A cause that is not "
        "in the catalogue but acts like this effect there gets its name. Don't believe it if the "
        "refitted parameters lie at their bounds, or if the explained misfit is far above 1 and "
        "the maps still show bands.",
    ),
    "ambiguous": Words(
        "An effect is missing, several explain it",
        "After the refit a gap remained; each explanation of the set closes it, and these data "
        "rule none of them out.",
        "Run the next experiment, which says what it tells apart; until then updated.yaml holds "
        "the first.",
        "The true one is in the set only if it is in the catalogue. Outside the recorded "
        "amplitudes and band the members of the set part.",
    ),
    "partly_explained": Words(
        "Partly explained",
        "The named causes are there, by tests on data that no fit has seen; beyond them a gap "
        "remains of which no effect of the catalogue surely is the cause.",
        "Go on with updated.yaml, which switches the named causes on, and look at what the "
        "remainder looks like before you look for a further cause.",
        "A cause stands for its law at the recorded amplitudes and in the recorded band only. The "
        "remainder can hide weaker causes, and shifts what is named if it is the greater part.",
    ),
    "unexplained": Words(
        "Unexplained",
        "A gap remains after the refit, and no explanation of the catalogue closes it.",
        f"updated.yaml holds the refit. {_LOOK}",
        "{more} can end here too.",
    ),
    "nonstationary": Words(
        "The rig changes while it is recorded",
        "The response drifts along a trend between periods or bags, which no time-invariant model "
        "explains.",
        "Let the rig warm up, record levels interleaved, and diagnose again.",
        "One disturbed bag can look like a drift: see which one stands out.",
    ),
    "bad_data": Words(
        "The data do not allow a diagnosis",
        "A gate failed: something other than the plant explains a difference, so no cause is "
        "named.",
        "Mend what the gate names, and record again if need be.",
        "The gate's limit and value are in the table; the other gates were tested too.",
    ),
}
"""The words of every verdict."""


ON: dict[ReportedOn, str] = {
    "records": " on data that its fit has not seen",
    "blocks": " on blocks of the records that its fit has not seen",
    "none": " on the data that it was fitted to (nothing was held out: no prediction was tested)",
}
"""On which data an explanation closes the gap."""

HELD_OUT: dict[ReportedOn, str] = {"records": "held-out", "blocks": "held-out", "none": "fitted"}
"""What the data are called that all figures were computed on."""


def meaning(diagnosis: Diagnosis) -> str:
    """Return what the verdict says about rig and simulation."""
    if diagnosis.verdict == "unexplained" and OUT_OF_TIME in diagnosis.notes:
        return _CUT
    return WORDS[diagnosis.verdict].meaning.format(on=ON[diagnosis.reported_on])


def action(diagnosis: Diagnosis) -> str:
    """Return what to do next."""
    verdict, on = diagnosis.verdict, ON[diagnosis.reported_on]
    if verdict == "no_gap" or verdict in _OF_A_GATE:
        return WORDS[verdict].action
    nearer, farther = changes(diagnosis)
    if farther or not nearer:
        either = _MIXED if nearer else _WORSE
        told = either.format(nearer=" and ".join(nearer), farther=" and ".join(farther), on=on)
        return f"{told} {_LOOK}" if verdict == "unexplained" else told
    if verdict == "ambiguous" and diagnosis.next_experiment is None:
        members = [name for names in diagnosis.equivalent if len(names) > 1 for name in names]
        return (_NO_EXPERIMENT if _searched(diagnosis) else _NOT_SEARCHED).format(
            members=",".join(members)
        )
    return WORDS[verdict].action


def doubt(diagnosis: Diagnosis) -> str:
    """Return when not to believe the verdict."""
    more = "More than two effects at once"
    if not all(candidate.converged for candidate in diagnosis.ranking):
        more += ", or fits that did not converge (see what was tried),"
    return WORDS[diagnosis.verdict].doubt.format(more=more)


def _searched(diagnosis: Diagnosis) -> bool:
    """Tell whether an experiment was looked for that separates what is tied."""
    found = diagnosis.evidence
    return found is None or (found.excitation == "periodic" and found.controller != "unknown")


def is_better(diagnosis: Diagnosis) -> bool:
    """Tell whether updated.yaml comes nearer to the rig than the nominal parameters.

    It does if of its error and its misfit one is less and none is greater. Noise does not tell it
    from them where there is no gap.
    """
    nearer, farther = changes(diagnosis)
    return diagnosis.verdict != "no_gap" and bool(nearer) and not farther


def changes(diagnosis: Diagnosis) -> tuple[list[str], list[str]]:
    """Return by which figures updated.yaml is nearer to the rig than the nominal, and farther.

    A simulation that diverges is farther than any other.
    """
    before, after = diagnosis.gap.nominal, diagnosis.gap.explained or diagnosis.gap.refit
    what = "position" if diagnosis.compared == "motion" else "torque"
    names = f"the error of the {what}", "the misfit"
    if before is None:
        return [*names], []
    olds, news = (
        [math.inf if figure is None else figure for figure in ends]
        for ends in (
            (diagnosis.missed(before), before.chi2_per_dof),
            (diagnosis.missed(after), None if after is None else after.chi2_per_dof),
        )
    )
    ends = [*zip(names, olds, news, strict=True)]
    nearer = [name for name, old, new in ends if new < old]
    return nearer, [name for name, old, new in ends if new > _ALIKE * old]


def closed(diagnosis: Diagnosis) -> str:
    """Return which share of the gap is closed, or that none can be stated; empty without effect."""
    if diagnosis.gap_closed is None:
        if not explains(diagnosis):
            return ""
        why = (
            "rounding acts like noise in a loop, so that a simulation meets it in size but not "
            "sample by sample; see the note on its statistics"
            if diagnosis.effects == [ROUNDING]
            else "by the rms error of the position the refit leaves nothing beyond noise, or the "
            "explanation brings the simulation no nearer to the rig"
        )
        return f"No share of the gap is stated: {why}."
    figures = diagnosis.gap_figures
    main = None if figures is None else figures.position or figures.torque
    share = None if main is None else main.closed
    sure = ""
    if share is not None and share.low is not None and share.high is not None:
        sure = f" (95 %: {share.low:.1%} to {share.high:.1%})"
    where = " on the data that were fitted" if diagnosis.reported_on == "none" else ""
    return f"{diagnosis.gap_closed:.1%} of what the refit left is closed{where}{sure}."


def explains(diagnosis: Diagnosis) -> bool:
    """Tell whether there is an explanation beyond the refit whose gap can be shown."""
    explained = diagnosis.gap.explained
    return explained is not None and explained != diagnosis.gap.refit


def explanation(effects: list[str]) -> str:
    """Return effects as shown to a person, such as 'backlash + delay'."""
    return " + ".join(name.replace("_", " ") for name in effects) or "bare plant"


def headline(diagnosis: Diagnosis) -> str:
    """Return the verdict in one line."""
    words = WORDS[diagnosis.verdict].headline
    if not diagnosis.effects:
        return words
    if diagnosis.verdict == "ambiguous":
        one = len(diagnosis.equivalent) == 1
        return f"{'An effect is' if one else 'Effects are'} missing: {_sets(diagnosis)}"
    if diagnosis.verdict == "partly_explained":
        return f"Missing: {_sets(diagnosis)}; a remainder stays"
    return f"Missing: {explanation(diagnosis.effects)}"


def _sets(diagnosis: Diagnosis) -> str:
    return "; ".join(
        " or ".join(explanation([name]) for name in members) for members in diagnosis.equivalent
    )


def unit_of(name: str, *, linear: bool) -> str:
    """Return the unit of a base parameter or of an effect's parameter on such an axis."""
    parameter = SIMULATOR[name]
    return (parameter.of_linear_axis() if linear else parameter).unit
