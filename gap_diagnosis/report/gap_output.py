"""Writes the files of a diagnosis into a folder, all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.text import Text

from controller_node.pd_filtered import CONTROLLER
from excitation_node.multisine import EXCITATION
from fjr_interface.linear_axis import as_linear
from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.parameters import ParameterGroup
from fjr_kit.atomic import result_folder, write_whole
from fjr_kit.figure_style import STYLE, save
from fjr_kit.invocation import provenance
from fjr_kit.telling import Progress
from fjr_sim_node.simulation.simulator import SIMULATOR

from ..how_far.run_comparison import RunComparison
from ..how_far.steady_view import SteadyView
from ..investigation import Investigation
from ..outcome.linear_words import linear_head
from .gap_figures import draw_residual_torque, draw_sigma_lines, draw_sigma_maps
from .gap_plots import STAGES
from .gap_report import compared, render_gap_report
from .randomisation import randomisation_yaml, ranges
from .run_figures import run_figures
from .updated_parameters import updated_values
from .waterfall import bars, draw_waterfall

OWN_FILES = (
    "report.html", "diagnosis.json", "updated.yaml", "randomisation.yaml", "figures/*.p[nd][gf]",
)  # fmt: skip
"""What an earlier diagnosis may have left in a folder, as patterns."""

GROUPS: dict[str, ParameterGroup] = {
    "excitation": EXCITATION,
    "controller": CONTROLLER,
    "simulator": SIMULATOR,
}

Drawing = Callable[[], Figure]


def write_diagnosis(
    investigation: Investigation,
    out: Path | str,
    *,
    progress: Progress = lambda _: None,
    command: str | None = None,
    date: str | None = None,
) -> Path:
    """Write diagnosis.json, updated.yaml, randomisation.yaml, figures/ and report.html into `out`.

    Everything is written to a temporary folder first and moved when whole; files of an earlier
    diagnosis are replaced, other files in `out` stay.

    Args:
        investigation: the diagnosis with its evidence.
        out: the folder; made if it is absent.
        progress: called with what is being written.
        command: the command line, for the report.
        date: the date, for the report.

    Returns:
        The path of report.html.

    Raises:
        InputError: `out` cannot be written.
    """
    with result_folder(Path(out), OWN_FILES) as folder:
        progress("writing diagnosis.json")
        (folder / "diagnosis.json").write_text(investigation.diagnosis.to_json(), encoding="utf-8")
        if investigation.diagnosis.parameters:
            progress("writing updated.yaml and randomisation.yaml")
            _write_parameters(investigation, folder)
        runs = compared(investigation)
        text = render_gap_report(investigation, runs, provenance(command, date))
        _write_figures(
            _drawings(investigation, runs),
            folder / "figures",
            progress,
            linear=investigation.diagnosis.linear,
        )
        progress("writing report.html")
        (folder / "report.html").write_text(text, encoding="utf-8")
    return Path(out) / "report.html"


def _write_parameters(investigation: Investigation, folder: Path) -> None:
    diagnosis, groups, head = investigation.diagnosis, GROUPS, []
    if diagnosis.linear:
        groups = {node: group.of_linear_axis() for node, group in GROUPS.items()}
        head = linear_head(diagnosis)
    values = updated_values(investigation.recorded, diagnosis)
    save_parameter_file(folder / "updated.yaml", values, groups, head=head)
    found = ranges(diagnosis.parameters, diagnosis.bags)
    text = randomisation_yaml(found, groups["simulator"])
    write_whole(folder / "randomisation.yaml", text)


def _write_figures(
    drawings: Mapping[str, Drawing], folder: Path, progress: Progress, *, linear: bool
) -> None:
    """Draw figures by their names, each as PNG and PDF; none where nothing was simulated."""
    if not drawings:
        return
    folder.mkdir()
    with rc_context(STYLE):
        for name, draw in drawings.items():
            progress(f"drawing {name}")
            figure = draw()
            for text in figure.findobj(Text) if linear else ():
                text.set_text(as_linear(text.get_text()))
            save(figure, folder / name)


def _drawings(investigation: Investigation, found: Sequence[RunComparison]) -> dict[str, Drawing]:
    """Return what draws each figure by its name."""
    drawings: dict[str, Drawing] = {}
    if bars(investigation.diagnosis):
        drawings["waterfall"] = partial(draw_waterfall, investigation.diagnosis)
    if investigation.fitted is not None:
        drawings |= run_figures(found, known=investigation.fitted.evidence.noise.known)
    if investigation.steady is not None and investigation.steady.models:
        drawings |= dict(_steady_figures(investigation.steady))
    return drawings


def _steady_figures(view: SteadyView) -> Iterator[tuple[str, Drawing]]:
    maps = {STAGES[name]: found for name, found in view.maps.items()}
    if view.noise is not None and all(_finite(found) for found in maps.values()):
        yield "where_position", partial(draw_sigma_maps, maps, "position")
        yield "where_torque", partial(draw_sigma_maps, maps, "torque")
        yield "sigma_refit", partial(draw_sigma_lines, maps[STAGES["refit"]])
    torques = view.residual_torques
    yield (
        "residual_torque",
        partial(draw_residual_torque, torques["refit"], torques["explained"]),
    )


def _finite(found: Any) -> bool:
    return all(np.isfinite(part.sigma).all() for part in found.signals.values())
