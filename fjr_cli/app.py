"""The `fjr` command: a module for each command, named like it, all by one pattern.

Two modules have other names: `import_records` is `fjr import`, and `by_hand` holds the eight
commands of running nodes. A module holds the options of its command and a thin body, which imports
what it needs when it is called, so that `fjr --help` is quick, and prints what came of it. Errors
become one sentence by `cli_errors`. Options that several commands have stand in `campaign_options`,
`described_runs`, `graph_options`, `record_options`, `result_options`, `search_options` and
`worker_options`; where commands have a whole group of them, as a dataclass that `option_groups`
unfolds. Modules that end in `_summary` print results.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable
from typing import Annotated

import typer

from fjr_kit.output_pipe import outlive_readers

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


def _reflowed(command: Command) -> str:
    """Return the docstring of a command, which the terminal breaks at its own width."""
    paragraphs = inspect.cleandoc(command.__doc__ or "").split("\n\n")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


app.command(help=_reflowed(analyze))(analyze)
app.command(help=_reflowed(fit))(fit)
app.command("import", help=_reflowed(import_records))(import_records)
for command in COMMANDS:
    app.command(help=_reflowed(command))(command)
for command in BY_HAND:
    app.command(help=_reflowed(command), rich_help_panel="A rig started by hand")(command)
app.add_typer(blind, name="blind")


def main() -> None:
    """Run the command line, with one thread of BLAS unless the environment asks for more.

    Its matrices are small, so that the threads of BLAS take time from the simulations beside them.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")  # read where numpy is imported, which is later
    outlive_readers()
    app(prog_name="fjr")
