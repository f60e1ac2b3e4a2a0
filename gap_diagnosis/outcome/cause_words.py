"""Causes, remainder and evidence of a diagnosis in words, and numbers with the digits they bear."""

from __future__ import annotations

import math
from collections.abc import Sequence

from fjr_interface.linear_axis import pitch_m
from fjr_kit.number_text import unsigned_zero
from fjr_sim_node import effects as fx

from .cause import MOST_SHARE, Cause, Place
from .diagnosis import Diagnosis, EvidenceKind
from .gap_size import Estimate, Figure
from .verdict_words import explanation

NOISE: dict[str, str] = {
    "repeats": "The noise is known from what repeats.",
    "standstill": "The noise is known from a standstill of the axis.",
    "residual": "The noise is known from the highest frequencies, where nothing else is left.",
    "none": "The noise is not known, so nothing is said of significance.",
}
REPORTED: dict[str, str] = {
    "records": "All figures are of whole records that no fit has seen.",
    "blocks": "All figures are of blocks of the records that no fit has seen.",
    "none": "All figures are of the data that were fitted: nothing was held out.",
}
CONTROLLER: dict[str, str] = {
    "known": "The controller is known, so the closed loop was simulated.",
    "gains_fitted": "The controller is known but for its gains, which were fitted.",
    "unknown": "The controller is not known, so the recorded torque drove the model.",
}
EXCITATION: dict[str, str] = {
    "periodic": "Steady periods were compared.",
    "record": "The records were compared as they came, in windows.",
}
TORQUE = (
    "Inertia takes next to none of the torque, so no motion was simulated: the torque that a model "
    "needs along the recorded motion was compared with the recorded one."
)
LEAST_PERCENT = 1e-3
"""A smaller share is shown as less than that: its digits mean nothing to a reader."""
NO_SHARE = "none seen"
"""What stands for a share that may be zero or less."""
_MOST_DIGITS = 6
_AS_NOISE = 1.5  # times what noise leaves: a remainder no greater than that has no look of its own


def evidence_sentences(evidence: EvidenceKind) -> list[str]:
    """Return what the diagnosis rests on, a sentence for each kind of evidence."""
    how = [EXCITATION[evidence.excitation], CONTROLLER[evidence.controller]]
    if evidence.compared == "torque":
        how = [TORQUE]
    return [*how, NOISE[evidence.noise], REPORTED[evidence.reported_on]]


def remainder_sentences(diagnosis: Diagnosis) -> list[str]:
    """Return how large the remainder is, what it looks like and where it lies; empty if none."""
    left = diagnosis.remainder
    if left is None:
        return []
    said = []
    floor = diagnosis.gap.noise_floor
    noise = None if floor is None else floor.nrmse_position
    missed = left.nrmse_position
    if diagnosis.compared == "torque" and diagnosis.steps:
        missed = diagnosis.missed(diagnosis.steps[-1])
    if missed is not None and noise and missed < _AS_NOISE * noise:
        return [f"{percent(missed)} of the motion remains, which noise explains."]
    if missed is not None:
        share = "" if left.share is None else f", {percent(left.share)} of the refit's squared gap"
        said.append(f"{percent(missed)} of the {diagnosis.compared} remains{share}.")
    if left.looks_like:
        said.append(f"The torque that is still missing goes with {'; '.join(left.looks_like)}.")
    elif left.where:
        said.append("The torque that is still missing goes with no quantity that was tried.")
    if left.where:
        said.append(f"It is strongest at {'; '.join(map(place_words, left.where))}.")
    return said


def place_words(place: Place) -> str:
    """Return a place as shown to a person, such as 'level 1, 3.1 to 16 Hz (4.4 sigma)'."""
    low, high = map(two_digits, place.band_hz)
    band = f"0 to {high} Hz" if place.lines == "slow" else f"{low} to {high} Hz"
    kind = "" if place.lines in ("all", "slow") else f", {place.lines} lines"
    sigma = (
        f" ({two_digits(place.sigma)} \N{GREEK SMALL LETTER SIGMA})" if known(place.sigma) else ""
    )
    twist = " of the twist" if place.signal == "twist" else ""
    return f"level {place.level}, {band}{twist}{kind}{sigma}"


def contender_names(diagnosis: Diagnosis) -> list[str]:
    """Return the explanations that the verdict chose among, by what they have instead."""
    if not diagnosis.contenders:
        return []
    chosen = diagnosis.contenders[0].effects
    names = ["as named" if chosen else "refit"]
    for other in diagnosis.contenders[1:]:
        own = explanation([e for e in other.effects if e not in chosen])
        gone = [e for e in chosen if e not in other.effects]
        names.append(f"{own} for {explanation(gone)}" if gone else own)
    return names


def choice_sentences(diagnosis: Diagnosis) -> list[str]:
    """Return what the numbers of these explanations are, and whether one does better."""
    other = "" if diagnosis.reported_on == "none" else "; the figures above are of other data"
    said = [
        "Misfit and gain (log-likelihood of a block over the first row) are of the data that "
        f"select among explanations{other}."
    ]
    better = [
        other
        for chosen in diagnosis.contenders[:1]
        for other in diagnosis.contenders[1:]
        if other.better and (other.held_out_chi2 or 0.0) <= (chosen.held_out_chi2 or math.inf)
    ]
    if better and diagnosis.effects:
        names = ",".join(better[0].effects)
        said.append(
            "An explanation of the set predicts better than the one that is named and stands in "
            f"updated.yaml: diagnose again with --effects {names}."
        )
    return said


def summaries(diagnosis: Diagnosis) -> list[str]:
    """Return a sentence about each named effect, and each that may stand in its place."""
    pitch = pitches(diagnosis)
    return [
        f"{explanation([name])}: {fx.EFFECTS[name].summary} {pitch.get(name, '')}".rstrip()
        for name in _named(diagnosis)
    ]


def summaries_with_telltales(diagnosis: Diagnosis) -> list[str]:
    """Return the same with how each shows in the data."""
    told = zip(summaries(diagnosis), _named(diagnosis), strict=True)
    return [f"{what} Telltale: {fx.EFFECTS[name].telltale.words}." for what, name in told]


def _named(diagnosis: Diagnosis) -> list[str]:
    return list(dict.fromkeys(name for members in diagnosis.equivalent for name in members))


def pitches(diagnosis: Diagnosis) -> dict[str, str]:
    """Return a sentence on the pitch of each ripple by its effect; none for a rotary axis."""
    found = diagnosis.parameters if diagnosis.linear else {}
    return {
        name.split(".")[0]: _sentence(estimate)
        for name, estimate in found.items()
        if "." in name and fx.parameter(name).role == "cycles"
    }


def _sentence(cycles: Estimate) -> str:
    ends = (1e3 * pitch_m(count) for count in (cycles.value, cycles.high, cycles.low))
    pitch, low, high = digits(Estimate(**dict(zip(("value", "low", "high"), ends, strict=True))))
    return f"Its pitch is {pitch} mm ({low} to {high} mm)."


def cause_name(cause: Cause) -> str:
    """Return a cause with what cannot be told from it, such as 'gravity or torque bias'."""
    return " or ".join(explanation([name]) for name in (cause.effect, *cause.others))


def share_words(figure: Figure | None) -> str:
    """Return a share with its interval, in percent; a dash where there is none.

    A share that does not differ from nothing is said to be none, and one of a model that runs away
    without the cause has an end: their digits mean nothing.
    """
    if figure is None or not known(figure.value):
        return "-"
    if figure.value >= MOST_SHARE:
        return f"{percent(MOST_SHARE)} or more"
    if not closes(figure):
        return NO_SHARE
    if figure.low is None or figure.high is None:
        return percent(figure.value)
    return f"{percent(figure.value)} ({percent(figure.low)[:-1]} to {percent(figure.high)})"


def closes(share: Figure) -> bool:
    """Tell whether a share of the gap lies above zero, its interval too."""
    return (share.value if share.low is None else min(share.value, share.low)) > 0.0


def share_sentences(diagnosis: Diagnosis) -> list[str]:
    """Return what each cause does that closes no share of the gap: to the torque, or to nothing.

    A loop that integrates takes a constant torque away from the position; its torque shows it.
    """
    shares = [(cause, cause.share) for cause in diagnosis.causes]
    return [
        f"{cause_name(cause)}: {_beside_share(cause, diagnosis)}"
        for cause, share in shares
        if share is not None and not closes(share)
    ]


def _beside_share(cause: Cause, diagnosis: Diagnosis) -> str:
    of = "position" if diagnosis.compared == "motion" else "torque"
    added = [step.added for step in diagnosis.steps]
    at = added.index(cause.effect) if cause.effect in added else 0
    if at and of == "position":
        before, after = (diagnosis.steps[i].nrmse_torque for i in (at - 1, at))
        falls = before is not None and after is not None and after < before
        if falls and percent(after) != percent(before):
            return (
                "no share of the position's error is seen to go with it; the torque's error falls "
                f"from {percent(before)} to {percent(after)} by it."
            )
    where = "; ".join(map(place_words, cause.where))
    shows = f"it shows at {where} only" if where else "only tests of single bands show it"
    return f"it closes no part of the {of}'s rms error on these runs; {shows}."


def tells(
    pairs: Sequence[tuple[int, int]],
    told: Sequence[tuple[int, int]],
    explanations: Sequence[Sequence[str]],
) -> str:
    """Return which explanations an experiment tells apart, and which not.

    Args:
        pairs: of explanations, by their places.
        told: those that it tells apart.
        explanations: effects of each; those that all of them have are not said.
    """
    common = set.intersection(*map(set, explanations))
    own = [[e for e in effects if e not in common] or [*effects] for effects in explanations]
    names = [explanation(effects) for effects in own]
    left = [pair for pair in pairs if pair not in told]
    said = (("It will tell", told), ("It will not tell", left))
    return " ".join(
        f"{begins} {', '.join(f'{names[a]} from {names[b]}' for a, b in chosen)}."
        for begins, chosen in said
        if chosen
    )


def percent(ratio: float | None) -> str:
    """Return a ratio in percent, with two digits below ten; a dash where it is not known.

    What is smaller than `LEAST_PERCENT` is said to be so, and is zero where it is negative.
    """
    if ratio is None or not known(ratio):
        return "-"
    value = 100.0 * ratio
    size = abs(value)
    if size < LEAST_PERCENT:
        return f"<{LEAST_PERCENT:g}%" if value > 0.0 else "0%"
    if size >= 9.95:
        return f"{value:.0f}%"
    return f"{value:.{max(1 - math.floor(math.log10(size)), 1)}f}%"


def two_digits(value: float) -> str:
    """Return a frequency or a ratio with two digits below a hundred, whole above."""
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def digits(estimate: Estimate) -> tuple[str, str, str]:
    """Return value, low and high end, to a tenth of half the interval's width."""
    values = estimate.value, estimate.low, estimate.high
    width = 0.5 * (estimate.high - estimate.low)
    greatest = max(map(abs, values))
    if not math.isfinite(width) or width <= 0.0 or not math.isfinite(greatest):
        return tuple(f"{v:.4g}" if known(v) else "-" for v in values)  # type: ignore[return-value]
    last = math.floor(math.log10(width)) - 1
    last = max(last, math.floor(math.log10(greatest)) - _MOST_DIGITS + 1)
    if 1e-6 <= greatest < 1e6:
        fixed = [unsigned_zero(f"{v:.{max(-last, 0)}f}") for v in values]
        return fixed[0], fixed[1], fixed[2]
    shown = max(math.floor(math.log10(greatest)) - last, 0)
    return tuple(f"{v:.{shown}e}" for v in values)  # type: ignore[return-value]


def known(value: float | None) -> bool:
    """Tell whether a figure is a finite number."""
    return value is not None and math.isfinite(value)
