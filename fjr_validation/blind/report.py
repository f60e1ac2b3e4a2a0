"""The report of a blind check, from its raw verdicts and answers: Markdown, scores, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError

from .answers import Answer
from .check import BlindCheck
from .check_documents import Unsealed
from .figures import draw_all
from .frozen import frozen_digest
from .outcome import Outcome
from .report_text import Source, report_text
from .rivals import side_by_side
from .score import all_scores


def score_check(check: BlindCheck, *, unfinished: bool = False) -> Path:
    """Unseal the answers if that is still to be done; write scores and report; return the report.

    Raises:
        InputError: verdicts are missing, or something was changed.
    """
    methods = check.manifest.methods
    source, lines, outcomes = _scored(check, methods, unfinished=unfinished)
    return _write([source], methods, lines, outcomes, _report_folder(check))


def score_together(checks: Sequence[BlindCheck], folder: Path) -> Path:
    """Write one report of several checks, whose answers are unsealed; return it.

    A thousand cases take longer than one machine may have: each check has its own seed, key and
    version, and the report names them all. It has the methods that all of them compare: those of
    others are slow, so that some checks are of this diagnosis alone.

    Args:
        checks: of one method at least that all of them compare.
        folder: where the report goes.

    Raises:
        InputError: a check is still sealed, two are the same or share no method, or something was
            changed.
    """
    compared = [check.manifest.methods for check in checks]
    shared = tuple(method for method in compared[0] if all(method in each for each in compared))
    if len({check.manifest.check for check in checks}) < len(checks):
        raise InputError("The folders hold the same check twice; name each check once.")
    for check in checks:
        if not check.unsealed:
            raise InputError(
                f"{check.folder} is still sealed; end it first with "
                f"`fjr blind score {check.folder}`."
            )
    if not shared:
        each = " and ".join(f"{c.folder} {', '.join(c.manifest.methods)}" for c in checks)
        raise InputError(f"No method is compared in all of these checks: {each}.")
    sources, lines, outcomes = [], [], []
    for check in checks:
        source, own, found = _scored(check, shared)
        sources.append(source)
        lines += [{**line, "case": f"{source.seed} {line['case']}"} for line in own]
        outcomes += [replace(one, case=f"{source.seed} {one.case}") for one in found]
    folder.mkdir(parents=True, exist_ok=True)
    return _write(sources, shared, lines, outcomes, folder)


def _scored(
    check: BlindCheck, methods: Sequence[str], *, unfinished: bool = False
) -> tuple[Source, list[dict[str, Any]], list[Outcome]]:
    """Return where the outcomes of methods come from, their raw verdicts and these outcomes."""
    answers = dict(check.unseal(unfinished=unfinished))
    lines = [
        line for line in check.verdicts() if line["case"] in answers and line["method"] in methods
    ]
    outcomes = [Outcome.of(answers[line["case"]], line) for line in lines]
    opened = Unsealed.read(check.folder / "unsealed.json")
    seen = len({line["case"] for line in lines})
    return Source(str(opened.seed), check.manifest, len(check.cases), seen), lines, outcomes


def rehearse_report(check: BlindCheck) -> None:
    """Write the report of a check in which every method failed, to a place that is then removed.

    What would stop the real one after hours of diagnoses (a folder that cannot be written, a
    damaged manifest, figures that cannot be drawn) stops the check here, before they begin.

    Raises:
        InputError: the report's folder cannot be written, or the check's manifest is damaged.
    """
    nothing = {"plant": {"k0": 1.0}, "nominal": {}, "settings": {}, "facts": {}}
    truth = {"causes": [], "weak": [], "laws": [], "noise_rad": 0.0, "scatter": 0.0,
             "remainder": 0.0, "excitation": "none", "controller_known": True}  # fmt: skip
    outcomes = [
        Outcome(
            case.name,
            method,
            Answer.from_json({**nothing, **truth, "world": case.world, "kind": "none"}),
            "failed",
            (),
            "not yet diagnosed",
            0.0,
        )
        for method in check.manifest.methods
        for case in check.cases[:10]
    ]
    folder = _report_folder(check)
    try:
        with TemporaryDirectory(prefix=".rehearsal-", dir=folder) as place:
            source = Source("a rehearsal", check.manifest, len(check.cases), len(check.cases))
            _write([source], check.manifest.methods, [], outcomes, Path(place))
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


def _write(
    sources: Sequence[Source],
    methods: Sequence[str],
    lines: Sequence[Mapping[str, Any]],
    outcomes: Sequence[Outcome],
    folder: Path,
) -> Path:
    """Write scores, figures and text into a folder; return the text's path."""
    found = all_scores(outcomes, methods, frozen_digest())
    write_whole(folder / "scores.json", found.to_json())
    ours = [o for o in outcomes if o.method == methods[0]]
    draw_all(ours, folder)
    report = folder / "report.md"
    text = report_text(sources, found, outcomes, ours, side_by_side(lines, outcomes, methods))
    write_whole(report, "\n".join(text) + "\n")
    return report
