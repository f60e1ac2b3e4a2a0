"""Options of the commands whose work is spread over processes."""

from __future__ import annotations

from typing import Annotated

import typer

Workers = Annotated[
    int | None,
    typer.Option(min=1, help="Worker processes on this machine; default: one for each core."),
]
Dask = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Dask scheduler, such as tcp://host:8786, whose workers compute instead; they need "
        "this package installed and must see the same folder.",
    ),
]
