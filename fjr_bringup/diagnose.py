"""What `fjr diagnose` does: from bags and a nominal to the verdict, with progress and a summary."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

import typer
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from fjr_interface.bag_reader import SignalMap
from fjr_interface.resampling import Resampling
from gap_diagnosis.diagnosis import Diagnosis, Gap
from gap_diagnosis.gap_output import has_known_law, write_diagnosis
from gap_diagnosis.investigation import investigate
from gap_diagnosis.nominal import read_nominal, refuse_wrong_units
from gap_diagnosis.records import read_experiment
from gap_diagnosis.verdict_words import WORDS, explanation, headline, summaries, unit_of

from .invocation import call_date, command_line
from .progress import ProgressLine

RANKED = 5
"""How many explanations the summary on the terminal shows."""


class StageProgress(ProgressLine):
    """Shows the stage under way, as lines without a terminal."""

    def __init__(self) -> None:
        """Show on stderr."""
        super().__init__(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            TimeElapsedColumn(),
            transient=True,
            total=None,
        )

    def describe(self, stage: str) -> None:
        """Say what is being done."""
        self._bar.update(self._task, description=stage)
        if not self._console.is_terminal:
            self.say(stage)

    def say(self, sentence: str) -> None:
        """Print a sentence above the line; one that is long stays one line in a log."""
        self._console.print(sentence, highlight=False, markup=False, soft_wrap=True)


def diagnose_folder(
    folder: Path,
    nominal: str,
    out: Path | None,
    tolerance: float,
    signal_map: Sequence[str],
    resampling: Resampling | None = None,
) -> Path:
    """Diagnose bags, write the results and print a summary.

    Args:
        folder: experiment folder of the rig's bags.
        nominal: `paper` or a parameter file.
        out: folder of the results; None for `diagnosis` in the experiment folder.
        tolerance: how far a nominal value may be off, relative.
        signal_map: `signal=/topic:field[joint]` each.
        resampling: how to bring unevenly sampled bags onto an even grid.

    Returns:
        The path of the report.

    Raises:
        InputError: bad bags, options or nominal file.
    """
    values = read_nominal(nominal)
    sources = SignalMap.parse(signal_map)
    with StageProgress() as progress:
        progress.describe("reading bags")
        recorded = read_experiment(folder, sources, resampling)
        warning = refuse_wrong_units(recorded, values, nominal)
        if warning:
            progress.say(f"Warning: {warning}")
        found = investigate(recorded, values, tolerance=tolerance, progress=progress.describe)
        report = write_diagnosis(
            found,
            out or folder / "diagnosis",
            progress=progress.describe,
            command=command_line(),
            date=call_date(),
        )
    print_summary(found.diagnosis, Console(), report.parent)
    if found.diagnosis.parameters and not has_known_law(recorded):
        typer.echo(
            "Note: updated.yaml holds no controller, since the recorded one is unknown or no "
            "pd_filtered law; fjr simulate would take the paper's."
        )
    return report


def print_summary(diagnosis: Diagnosis, console: Console, out: Path) -> None:
    """Print verdict, what it means, effects with parameters, gap and what a reader must see."""
    words = WORDS[diagnosis.verdict]
    sure = f"(verdict: {diagnosis.verdict}, confidence {diagnosis.confidence:.0%})"
    _say(console, f"{headline(diagnosis)} {sure}")
    _say(console, f"{words.meaning} {words.action}")
    for sentence in summaries(diagnosis):
        _say(console, sentence)
    if diagnosis.effects:
        console.print(_parameters(diagnosis))
    if diagnosis.gap.nominal is not None:
        console.print(_gaps(diagnosis))
    if diagnosis.ranking and diagnosis.verdict in ("ambiguous", "unexplained"):
        console.print(_ranking(diagnosis))
    if diagnosis.next_experiment is not None:
        _say(console, f"Next experiment: {diagnosis.next_experiment.description}")
    for note in diagnosis.notes:
        _say(console, f"Note: {note}")
    _say(console, f"When not to believe it: {words.doubt}")
    if diagnosis.parameters:
        _say(console, f"Better simulation: fjr simulate --rig {shlex.quote(str(out))}/updated.yaml")


def _say(console: Console, sentence: str) -> None:
    console.print(sentence, highlight=False, markup=False)


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column(headings[0], no_wrap=True)
    for heading in headings[1:]:
        table.add_column(heading, justify="right")
    return table


def _parameters(diagnosis: Diagnosis) -> Table:
    """Return the parameters of the named effects with their 95 % intervals."""
    table = _table("parameter", "value", "95 % interval", "unit")
    for name, e in diagnosis.parameters.items():
        if "." in name:
            table.add_row(name, f"{e.value:.4g}", f"{e.low:.4g} to {e.high:.4g}", unit_of(name))
    return table


def _gaps(diagnosis: Diagnosis) -> Table:
    """Return the held-out gap at each stage."""
    table = _table("held-out gap", "position [%]", "torque [%]", "misfit/dof")
    stages: dict[str, Gap | None] = {
        "nominal": diagnosis.gap.nominal,
        "refit": diagnosis.gap.refit,
    }
    if diagnosis.gap_closed is not None:
        name = explanation(diagnosis.effects) if diagnosis.effects else "best explanation"
        stages[f"with {name}" if diagnosis.effects else name] = diagnosis.gap.explained
    stages["noise floor"] = diagnosis.gap.noise_floor
    for name, gap in stages.items():
        if gap is not None:
            table.add_row(
                name,
                _percent(gap.nrmse_position),
                _percent(gap.nrmse_torque),
                _number(gap.chi2_per_dof),
            )
    if diagnosis.gap_closed is not None:
        figures = diagnosis.gap_figures
        closed = figures.position.closed if figures else None
        sure = f" (95 %: {closed.low:.1%} to {closed.high:.1%})" if closed and closed.low else ""
        table.caption = f"{diagnosis.gap_closed:.1%} of what the refit left is closed{sure}."
    return table


def _ranking(diagnosis: Diagnosis) -> Table:
    table = _table("explanation", "held-out misfit/dof", "converged")
    for candidate in diagnosis.ranking[:RANKED]:
        converged = "yes" if candidate.converged else "no"
        table.add_row(explanation(candidate.effects), _number(candidate.held_out_chi2), converged)
    return table


def _percent(value: float | None) -> str:
    return _number(None if value is None else 100.0 * value)


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.3g}"
