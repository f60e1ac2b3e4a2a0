"""The words and tables of a blind check's report, Markdown line by line."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from .answers import WORLDS, World
from .check_documents import Manifest
from .outcome import CLEAR, CONFIDENT, Outcome
from .score import TARGETS, Score, Scores, met, rate

_TITLES = {
    "wrong_name": f"wrong name at present >= {CONFIDENT:g}, per case",
    "dominant_named": f"dominant cause named or in its set, above {CLEAR:g} x limit or remainder",
    "two_causes_f1": "two causes: F1",
    "nothing_named": "nothing named where no dominant cause is",
    "outside_not_named": "nothing named where the dominant cause is in no catalogue",
    "interval_holds": "effect's 95 % interval holds the truth",
    "auroc_present": "AUROC of present, right against wrong",
    "verdict_right": "exactly the dominant causes named",
    "failed": "failed",
    "seconds_median": "median processor time of one case (s)",
}
_PLAIN = {"seconds_median", "auroc_present"}

_MEANT = (
    f"Relative to its *detection limit* a cause shows as much as its change of the position leaves "
    "after a linear refit of the bare parameters, over three times the floor (rms over the DFT "
    "lines up to the highest excited, at the level where it shows best); the floor is the noise of "
    "what was averaged and 0.1 % of the signal. Over the *remainder* it shows as much as the "
    "change that leaving it out makes, beside all else, over the change that leaving all of the "
    f"remainder out makes, both after the same refit. A closed world's cause is asked for above "
    f"{CLEAR:g} x its detection limit, the other worlds' above {CLEAR:g} x the remainder. A name "
    "is *wrong* if neither it nor its set holds a true cause, weak ones of the remainder "
    "included. In the F1 true weak causes that are named count neither way. A constant torque "
    "passes for asymmetric Coulomb friction, bias, or gravity at right angles; backlash for the "
    "piecewise stiffness that contains it, presliding friction for the LuGre friction that "
    "contains it; gravity on a rigid axis for cogging. Damping of the transmission is there "
    "where backlash is, whose shaft is damped. A diagnosis that fails is a miss of all that is "
    "asked. Intervals are of 95 %: Clopper-Pearson for shares of cases, else bootstrap "
    "over cases."
)


@dataclass(frozen=True)
class Source:
    """A check whose verdicts a report is made of.

    Attributes:
        seed: of its cases, or what stands for it.
        manifest: what it is.
        planned: number of its cases.
        seen: how many of them have verdicts.
    """

    seed: str
    manifest: Manifest
    planned: int
    seen: int


def report_text(
    sources: Sequence[Source],
    found: Scores,
    outcomes: Sequence[Outcome],
    ours: Sequence[Outcome],
    beside: Sequence[str],
) -> list[str]:
    """Return the lines of a report.

    Args:
        sources: the checks that it is made of.
        found: the scores of all methods.
        outcomes: of all methods.
        ours: those of the first method, whose misses are listed.
        beside: lines that set the methods side by side.
    """
    many = "" if len(sources) == 1 else f" of {len(sources)} checks"
    return [
        "# Blind check",
        "",
        f"{len(ours)} {'case' if len(ours) == 1 else 'cases'}{many}, made by a second plant that "
        "shares nothing with the simulated rig. "
        + " ".join(_origin(source, found) for source in sources)
        + " The SHA-256 "
        "of every answer was written down before the case was diagnosed, that of all verdicts "
        "before the first answer was unsealed. Who knows the seed can make the cases again: the "
        "seal guards against accident and later change, not against a user who breaks it.",
        "",
        _MEANT,
        "",
        *(line for world in WORLDS for line in _world(world, found)),
        *beside,
        "![named over size](named.png)",
        "",
        "![is what is said to be present there?](present.png)",
        "",
        *_shares("By cause", ours, lambda o: [cause.name for cause in o.asked]),
        *_shares("By excitation", ours, lambda o: [f"{o.answer.world}, {o.answer.excitation}"]),
        *_shares(
            "By what is known of the controller",
            [o for o in ours if o.answer.world == "records"],
            lambda o: ["known" if o.answer.controller_known else "unknown"],
        ),
        *_misses(ours),
        *_failures(outcomes),
    ]


def _origin(source: Source, found: Scores) -> str:
    """Return in words which check it was: its seed, cases, version and what was frozen."""
    manifest = source.manifest
    changed = "" if found.frozen == manifest.frozen else (
        f" **The sources that score are others now: {found.frozen[:16]}.**"
    )  # fmt: skip
    ended = "" if source.seen == source.planned else (
        f" The check was ended after {source.seen} of {source.planned} cases."
    )  # fmt: skip
    return (
        f"Seed {source.seed}: {source.seen} {'case' if source.seen == 1 else 'cases'}, version "
        f"{manifest.version}.{ended} How cases are made and scored was frozen as "
        f"{manifest.frozen[:16]} before the first.{changed}"
    )


def _world(world: World, found: Scores) -> list[str]:
    """Return the table of one world: scores as rows, methods as columns."""
    methods = {name: worlds[world] for name, worlds in found.methods.items() if world in worlds}
    if not methods:
        return []
    lines = [
        f"## World: {world}",
        "",
        "| | target | " + " | ".join(methods) + " |",
        "|---|---|" + "---|" * len(methods),
    ]
    for name, title in _TITLES.items():
        if any(scores[name].cases for scores in methods.values()):
            cells = [_cell(name, world, scores[name]) for scores in methods.values()]
            lines.append(f"| {title} | {_target(name, world)} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _target(name: str, world: World) -> str:
    target = TARGETS.get(name, {}).get(world)
    if target is None:
        return ""
    sense, bound = target
    if isinstance(bound, tuple):
        return f"{_number(name, bound[0])} .. {_number(name, bound[1])}"
    return f"{sense} {_number(name, bound)}"


def _cell(name: str, world: World, score: Score) -> str:
    if score.value is None:
        return "-"
    numbers = [_number(name, part) for part in (score.value, score.low, score.high)]
    verdict = {True: " met", False: " **missed**", None: ""}[met(name, world, score.value)]
    return f"{numbers[0]} [{numbers[1]}, {numbers[2]}] n={score.cases}{verdict}"


def _number(name: str, value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if name in _PLAIN else f"{100.0 * value:.3g} %"


def _shares(
    title: str, outcomes: Sequence[Outcome], groups: Callable[[Outcome], Iterable[str]]
) -> list[str]:
    """Return how many clear causes were found in each group of cases, and its wrong names."""
    asked: dict[str, list[bool]] = {}
    wrong: Counter[str] = Counter()
    for outcome in outcomes:
        for name in dict.fromkeys(groups(outcome)):
            wrong[name] += bool(outcome.wrong_names)
            causes = [c for c in outcome.asked if title != "By cause" or c.name == name]
            found = [outcome.found(cause) for cause in causes] if outcome.clear else []
            asked.setdefault(name, []).extend(found)
    if not asked:
        return []
    lines = [f"## {title}", "", "| | clear causes found | wrong names |", "|---|---|---|"]
    for name, hits in sorted(asked.items()):
        share = rate(hits)
        said = f"{sum(hits)} of {len(hits)}" + (
            f" [{100.0 * (share.low or 0.0):.0f}, {100.0 * (share.high or 0.0):.0f}] %"
            if hits
            else ""
        )
        lines.append(f"| {name} | {said} | {wrong[name]} |")
    return [*lines, ""]


def _misses(outcomes: Sequence[Outcome]) -> list[str]:
    """Return a table of the cases that count against a target."""
    missed = [(o, sort) for o in outcomes if (sort := _sort(o))]
    if not missed:
        return [f"## Misses: none of {len(outcomes)}", ""]
    lines = [f"## Misses: {len(missed)} of {len(outcomes)}", "",
             "| case | true | shows | noise, remainder | said | miss |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    lines += [_miss(outcome, sort) for outcome, sort in missed]
    return [*lines, ""]


def _miss(outcome: Outcome, sort: str) -> str:
    answer = outcome.answer
    truth = " + ".join(cause.name for cause in answer.causes) or "no dominant cause"
    beside = [*(cause.name for cause in answer.weak), *answer.laws]
    truth += f" (beside {', '.join(beside)})" if beside else ""
    shown = [c.relative if c.over_remainder is None else c.over_remainder for c in answer.causes]
    said = "; ".join(
        f"{claim.effect} {claim.present:.2f}{'' if claim.named else ' (not named)'}"
        for claim in outcome.claims
        if claim.named or claim.present >= CONFIDENT
    )
    noise = answer.facts.get("noise_db", 0.0)
    return (
        f"| {outcome.case} | {truth} | {', '.join(f'{s:.2g} x' for s in shown) or '-'} | "
        f"{noise:.0f} dB, {100.0 * answer.remainder:.2g} % | "
        f"{outcome.verdict}{': ' if said else ''}{said} | {sort} |"
    )


def _sort(outcome: Outcome) -> str:
    """Return in words what kind of miss it is; empty for none."""
    if outcome.failed:
        return "failed"
    if outcome.wrong_names:
        return "wrong name"
    if not outcome.asked:
        return "named, not surely" if outcome.said else ""
    if outcome.clear and not all(outcome.found(cause) for cause in outcome.asked):
        return "partly found" if outcome.matches else "not found"
    return ""


def _failures(outcomes: Sequence[Outcome]) -> list[str]:
    failed: dict[tuple[str, str], list[str]] = {}
    for outcome in outcomes:
        if outcome.failed:
            failed.setdefault((outcome.method, outcome.error), []).append(outcome.case)
    if not failed:
        return []
    lines = [
        f"- {method}, {len(cases)} cases ({', '.join(cases[:3])}{', ...' if len(cases) > 3 else ''}"
        f"): {error}"
        for (method, error), cases in failed.items()
    ]
    return ["## Failures", "", *lines, ""]
