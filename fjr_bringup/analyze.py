"""`fjr analyze`: from bags to the report, with progress and a summary on the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from bla_analyzer.analysis import analyze
from bla_analyzer.metrics import ReferenceModel
from bla_analyzer.output import write_result
from bla_analyzer.plan import Override
from bla_analyzer.result import Method, Result
from bla_analyzer.summary import campaign, failed_checks, findings, headline, summarize
from fjr_interface.bag_reader import BagReader, SignalMap, find_bags
from fjr_interface.parameter_file import load_parameter_file
from fjr_interface.parameters import Value
from fjr_interface.resampling import Resampling
from fjr_sim_node.linear import DESCRIPTIONS, g0
from fjr_sim_node.plant import PLANT

from .invocation import call_date, command_line


def analyze_folder(
    folder: Path,
    out: Path | None,
    method: Method,
    signal_map: Sequence[str],
    nominal: str | None,
    override: Override,
    resampling: Resampling | None = None,
) -> Path:
    """Analyze bags, write the results and print a summary.

    Args:
        folder: experiment folder or bag.
        out: folder of the results; None for `analysis` in the experiment folder.
        method: robust or fast.
        signal_map: `signal=/topic:field[joint]` each.
        nominal: `paper`, `none`, a parameter file, or None: paper for bags of this rig only.
        override: what to take instead of the description.
        resampling: how to bring unevenly sampled bags onto an even grid.

    Returns:
        The path of the report.

    Raises:
        InputError: bad bags or options.
    """
    sources = SignalMap.parse(signal_map)
    bags = find_bags(folder)
    if out is None:
        is_bag = bags == [folder]
        out = (
            folder.with_name(f"{folder.resolve().name}-analysis") if is_bag else folder / "analysis"
        )
    models = reference_models(nominal, BagReader(bags[0], sources))
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("reading bags", total=len(bags))

        def read(done: int, total: int, name: str) -> None:
            progress.update(task, completed=done, total=total, description=f"read {name}")

        result = analyze(
            folder,
            method=method,
            signal_map=sources,
            models=models,
            override=override,
            resampling=resampling,
            progress=read,
        )
        task = progress.add_task("writing results", total=None)
        report = write_result(
            result,
            out,
            progress=lambda name: progress.update(task, description=f"writing {name}"),
            command=command_line(),
            date=call_date(),
        )
    print_summary(result, Console())
    return report


def reference_models(nominal: str | None, bag: BagReader) -> list[ReferenceModel]:
    """Return G0 in both versions for the parameters that `nominal` names (see `analyze_folder`)."""
    if nominal is None:
        experiment = bag.experiment
        is_rig = experiment is not None and "imported" not in (experiment.model_extra or {})
        nominal = "paper" if is_rig else "none"
    if nominal == "none":
        return []
    parameters, source = _nominal_parameters(nominal)
    return [
        ReferenceModel(
            f"G0_{damping}",
            f"{description}; {source}; zero-order-hold equivalent",
            partial(g0, parameters, damping=damping),
        )
        for damping, description in DESCRIPTIONS.items()
    ]


def _nominal_parameters(nominal: str) -> tuple[dict[str, Value], str]:
    if nominal == "paper":
        return PLANT.defaults(), "the paper's values"
    given = load_parameter_file(nominal).get("simulator", {})
    plant = {name: value for name, value in given.items() if name in PLANT}
    return PLANT.check(plant, nominal), f"values of {nominal}"


def print_summary(result: Result, console: Console) -> None:
    """Print the key numbers of each level, and every sentence that a reader must see."""
    console.print(campaign(result), headline(result), highlight=False)
    console.print(_table(result))
    several = len(result.levels) > 1
    for level in result.levels:
        for sentence in findings(level):
            prefix = f"Level {level.level}: " if several else ""
            console.print(f"{prefix}{sentence}", highlight=False, markup=False)
    for sentence in (*result.notes, *(check.sentence for check in failed_checks(result))):
        console.print(f"Note: {sentence}", highlight=False, markup=False)


def _table(result: Result) -> Table:
    """Return a row for each level: line counts, levels in dB re 1 rad, V of each model."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("level", no_wrap=True)
    models = [comparison.name for comparison in result.levels[0].comparisons]
    distances = [f"V\n{name.removeprefix('G0_')}\n[dB\N{SUPERSCRIPT TWO}]" for name in models]
    powers = [f"{name}\n[dB]" for name in ("linear", "odd", "even", "noise")]
    for heading in ("lines", "95 %\ndisc", *powers, *distances):
        table.add_column(escape(heading), justify="right")
    for level in result.levels:
        numbers = summarize(level)
        v = {comparison.name: comparison.v_mean for comparison in level.comparisons}
        in_db = (numbers.linear_db, numbers.odd_db, numbers.even_db, numbers.noise_db)
        table.add_row(
            numbers.name.removeprefix("Level "),
            str(numbers.lines),
            _cell(numbers.radius_percent, ".2g", " %"),
            *(_cell(value, ".1f") for value in in_db),
            *(_cell(v.get(name, math.nan), ".3g") for name in models),
        )
    return table


def _cell(value: float, form: str, unit: str = "") -> str:
    return "-" if math.isnan(value) else f"{value:{form}}{unit}"
