"""Options of the commands that turn bags or parameters into results: where to, and about what."""

from __future__ import annotations

from typing import Any

import typer


def results_folder(default: str) -> Any:
    """Return the option --out of a command that fills a folder; `default` says which one else."""
    return typer.Option(metavar="FOLDER", help=f"Folder of the results; default: {default}.")


def effect_names(said: str, panel: str | None = None) -> Any:
    """Return an option that takes names of effects, for `names_in`; `said` is its help."""
    return typer.Option(metavar="NAME,NAME,...", help=said, rich_help_panel=panel)


def datasheet_tolerance(panel: str | None = None) -> Any:
    """Return the option --tolerance."""
    return typer.Option(
        min=0.001,
        max=0.5,
        help="Relative error that a datasheet value may have, such as 0.1 for 10 %.",
        rich_help_panel=panel,
    )


def names_in(given: list[str] | None) -> list[str] | None:
    """Return the names of an option, given once with commas or several times; None if it is not."""
    return [name.strip() for text in given for name in text.split(",")] if given else None
