"""The `fjr` command: a module for each command, named like it, all by one pattern.

A module holds the options of its command and a thin body, which imports what it needs when it is
called, so that `fjr --help` is quick, and prints what came of it. Errors become one sentence by
`cli_errors`. Options that several commands have stand in `campaign_options`, `described_runs`,
`record_options`, `result_options`, `search_options` and `worker_options`; where commands have a
whole group of them, as a dataclass that `option_groups` unfolds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import typer

from .amplitude import amplitude
from .analyze import analyze
from .blind import blind
from .bridge import bridge
from .by_hand import estop, pause, play, reset, speed, status, step, stop
from .check import check
from .compare import compare
from .demo import demo
from .diagnose import diagnose
from .example import example
from .export import export
from .fit import fit
from .import_records import import_records
from .output_pipe import outlive_readers
from .paper import paper
from .plan import plan
from .record import record
from .rehearse import rehearse
from .replay import replay
from .run import run
from .shape import shape
from .simulate import simulate

Command = Callable[..., None]
COMMANDS: tuple[Command, ...] = (
    *(run, simulate, demo, example, rehearse, amplitude, shape, plan),
    *(paper, diagnose, export, compare, bridge, replay, record, check),
)
BY_HAND: tuple[Command, ...] = (status, pause, play, step, reset, speed, stop, estop)

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from fjr_kit.installed import product_version

        typer.echo(f"fjr {product_version()}")
        raise typer.Exit


@app.callback()
def options(
    _: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and end."
        ),
    ] = False,
) -> None:
    """Run, rehearse and analyze identification experiments on a flexible-joint rig."""


app.command()(analyze)
app.command()(fit)
app.command("import")(import_records)
for command in COMMANDS:
    app.command()(command)
for command in BY_HAND:
    app.command(rich_help_panel="A rig started by hand")(command)
app.add_typer(blind, name="blind")


def main() -> None:
    """Run the command line."""
    outlive_readers()
    app(prog_name="fjr")
