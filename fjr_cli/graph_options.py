"""Option of the commands that join a graph: where on it the rig is."""

from __future__ import annotations

from typing import Annotated

import typer

RIG = "/rig"
"""`fjr_interface.topics.NAMESPACE`, which takes long to import: `fjr --help` shows it."""

Namespace = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        envvar="FJR_NAMESPACE",
        help="Namespace of the rig's nodes and topics on the graph. Bags and parameter files have "
        "/rig whatever it is.",
    ),
]
