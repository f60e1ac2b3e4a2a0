"""The report of a blind check: Markdown and figures in one folder, every miss with its truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError

from .cases import NOMINAL, Answer
from .check import BlindCheck
from .figures import draw_all
from .files import case_name, read_json
from .outcome import ABSTAINING, CLEAR, NO_EFFECT, VISIBLE, Outcome
from .score import CONFIDENT, TARGETS, MethodScores, Score, all_scores, met

_TITLES = {
    "false_alarm": "effect named where there is none",
    "abstained_without_effect": "abstained where there is no effect",
    "first_right_clear": f"right effect first, above {CLEAR:g} x the detection limit",
    "first_right_clear_strict": "the same, without the equivalences known beforehand",
    "in_set_clear": "true effect in the reported set, same cases",
    "set_size_median": "median size of that set",
    "two_effects_f1": "two effects: F1 of the names",
    "outside_abstained": "outside the catalogue: abstained",
    "outside_confident_name": f"outside: named with confidence >= {CONFIDENT:g}",
    "nonstationary_found": "drift found",
    "gap_closed_median": "median of the gap closed, right effects",
    "calibration_error": "expected calibration error",
    "coverage_bare": "95 % intervals hold the bare parameters",
    "coverage_effect": "95 % intervals hold the effect's parameters",
    "verdict_right": "verdict right, all cases",
    "seconds_median": "median time of one case (s)",
}
_COUNTS = {"set_size_median", "seconds_median"}


def score_check(check: BlindCheck) -> Path:
    """Unseal the answers if that is still to be done; write scores and report; return the report.

    Raises:
        InputError: verdicts are missing, or something was changed.
    """
    answers = check.unseal()
    outcomes = [
        Outcome.of(answers[index], values) for (_, index), values in check.read_verdicts().items()
    ]
    seed = read_json(check.folder / "answers.json")["seed"]
    return _write(check, outcomes, seed, _report_folder(check))


def rehearse_report(check: BlindCheck) -> None:
    """Write the report of a check in which every method failed, to a place that is then removed.

    What would stop the real one after hours of diagnoses (a folder that cannot be written, a
    damaged manifest, figures that cannot be drawn) stops the check here, before they begin.

    Raises:
        InputError: the report's folder cannot be written, or the check's manifest is damaged.
    """
    nothing = Answer("none", [], NOMINAL, 0.0)
    outcomes = [
        Outcome(case_name(index), method, nothing, None, "not yet diagnosed", 0.0)
        for method in check.methods
        for index in range(check.count)
    ]
    folder = _report_folder(check)
    try:
        with TemporaryDirectory(prefix=".rehearsal-", dir=folder) as place:
            _write(check, outcomes, 0, Path(place))
    except OSError as error:
        raise InputError(
            f"{folder}, where the report will go, cannot be written: {error.strerror}; make room "
            "or choose another folder."
        ) from None


def _report_folder(check: BlindCheck) -> Path:
    folder = check.folder / "report"
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise InputError(
            f"{folder}, where the report will go, cannot be made: {error.strerror}; remove what "
            "is there or choose another folder."
        ) from None
    return folder


def _write(check: BlindCheck, outcomes: Sequence[Outcome], seed: int, folder: Path) -> Path:
    """Write scores, figures and text into a folder; return the text's path."""
    found = all_scores(outcomes, check.methods)
    write_whole(folder / "scores.json", found.to_json())
    scored = found.methods
    draw_all(scored, outcomes, folder)
    report = folder / "report.md"
    write_whole(report, _text(check, scored, outcomes, seed))
    return report


def _text(
    check: BlindCheck, scored: Mapping[str, MethodScores], outcomes: Sequence[Outcome], seed: int
) -> str:
    ours = [o for o in outcomes if o.method == check.methods[0]]
    parts = [
        "# Blind check",
        "",
        f"{check.count} {'case' if check.count == 1 else 'cases'}, seed {seed}, made by a second "
        f"plant that shares nothing with the simulated rig; version {check.version}. The "
        "SHA-256 of every answer was written down before the first diagnosis "
        "(`commitments.json`), that of every verdict before the first answer was unsealed "
        "(`verdicts.json`). Who knows the seed can make the cases again: the seal "
        "guards against accident and later change, not against a user who breaks it.",
        "",
        *_what_is_meant(),
        "## Scores",
        "",
        *_table(scored),
        "",
        "![accuracy over size](accuracy.png)",
        "",
        "## By size",
        "",
        *_sizes(scored),
        "",
        "## Calibration",
        "",
        "![calibration](calibration.png)",
        "",
        "## What was taken for what",
        "",
        f"Method {check.methods[0]}; single effects above their detection limit.",
        "",
        "![confusion](confusion.png)",
        "",
        *_misses(ours),
        *_failures(outcomes),
    ]
    return "\n".join(parts) + "\n"


def _what_is_meant() -> list[str]:
    return [
        "The detection limit of an effect is the size at which the steady position changes, after "
        "a refit of the bare parameters, by three times the floor (rms over the DFT "
        "lines up to the highest excited one, at the level where it shows best); the floor is the "
        "noise of the mean over periods and 0.1 % of the signal. Relative size is that change "
        "over the one at the detection limit. A verdict is right if it names the true effects "
        "and no other (an ambiguous one: if its sets hold them); without an effect, if it names "
        "none; outside the catalogue, if it abstains; for drift, if it says so. "
        f"Below {VISIBLE:g} x the detection limit it is also right to see no effect. A constant "
        "torque passes for asymmetric Coulomb friction, bias, or gravity at right angles; backlash "
        "passes for the piecewise stiffness that contains it. Intervals are of 95 %: "
        "Clopper-Pearson for shares of cases, else bootstrap over cases.",
        "",
    ]


def _table(scored: Mapping[str, MethodScores]) -> list[str]:
    lines = [
        "| | target | " + " | ".join(scored) + " |",
        "|---|---|" + "---|" * len(scored),
    ]
    for name, title in _TITLES.items():
        cells = [_cell(name, result.scores[name]) for result in scored.values()]
        lines.append(f"| {title} | {_target(name)} | " + " | ".join(cells) + " |")
    return lines


def _target(name: str) -> str:
    if name not in TARGETS:
        return ""
    sense, bound = TARGETS[name]
    if isinstance(bound, tuple):
        return f"{_number(name, bound[0])} .. {_number(name, bound[1])}"
    return f"{sense} {_number(name, bound)}"


def _number(name: str, value: float) -> str:
    return f"{value:.3g}" if name in _COUNTS else f"{100.0 * value:.3g} %"


def _cell(name: str, score: Score) -> str:
    if score.value is None or score.low is None or score.high is None:
        return "-"
    low, high = _number(name, score.low), _number(name, score.high)
    verdict = {True: " met", False: " **missed**", None: ""}[met(name, score.value)]
    return f"{_number(name, score.value)} [{low}, {high}] n={score.cases}{verdict}"


def _sizes(scored: Mapping[str, MethodScores]) -> list[str]:
    lines = ["| method | relative size | right first | wrong name | no effect seen | cases |",
             "|---|---|---|---|---|---|"]  # fmt: skip
    for method, result in scored.items():
        for row in result.by_size:
            if not row.first_right.cases:
                continue
            band = f"{row.low:g} .. {row.high:g}" if row.high else f"> {row.low:g}"
            cells = " | ".join(map(_share, (row.first_right, row.wrong_name, row.said_nothing)))
            lines.append(f"| {method} | {band} | {cells} | {row.first_right.cases} |")
    return lines


def _share(score: Score) -> str:
    value, low, high = np.array([score.value, score.low, score.high], float) * 100.0
    return f"{value:.0f} % [{low:.0f}, {high:.0f}]"


def _misses(outcomes: Sequence[Outcome]) -> list[str]:
    """Return every wrong verdict of the project's own method, and what is true instead."""
    wrong = [o for o in outcomes if not o.right]
    if not wrong:
        return [f"## Misses: none of {len(outcomes)}", ""]
    lines = [f"## Misses: {len(wrong)} of {len(outcomes)}", "",
             "| case | kind | true | relative size | noise (rad) | said | confidence | miss |",
             "|---|---|---|---|---|---|---|---|"]  # fmt: skip
    for outcome in wrong:
        answer = outcome.answer
        truth = " + ".join(f"{e.name} ({e.size:.3g})" for e in answer.effects) or "no effect"
        relative = ", ".join(f"{e.relative:.2g}" for e in answer.effects) or "-"
        said = outcome.verdict + (": " + " + ".join(outcome.named) if outcome.named else "")
        others = sorted(outcome.reported - set(outcome.named))
        said += f" (or {', '.join(others)})" if others else ""
        confidence = f"{outcome.diagnosis.confidence:.2f}" if outcome.diagnosis else "-"
        lines.append(
            f"| {outcome.case} | {outcome.kind} | {truth} | {relative} | {answer.noise_rad:.1e} | "
            f"{said} | {confidence} | {_sort(outcome)} |"
        )
    return [*lines, ""]


def _sort(outcome: Outcome) -> str:
    """Return in words what kind of miss it is."""
    if outcome.diagnosis is None:
        return "failed"
    if outcome.kind in ("none", "parameters"):
        return "false alarm" if outcome.named else "abstained without cause"
    if outcome.verdict in NO_EFFECT:
        return "not seen"
    if outcome.verdict in ABSTAINING:
        return "abstained" if outcome.kind != "nonstationary" else "drift not recognised"
    if outcome.kind in ("single", "two") and 0 < outcome.matches < max(
        len(outcome.named), len(outcome.truth)
    ):
        return "partly right"
    return "wrong name"


def _failures(outcomes: Sequence[Outcome]) -> list[str]:
    failed = [o for o in outcomes if o.diagnosis is None]
    if not failed:
        return []
    return ["## Failures", "", *(f"- {o.method} on {o.case}: {o.error}" for o in failed), ""]
