"""Writes the files of a diagnosis into a folder, all of them or none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from bla_analyzer.output import provenance
from controller_node.pd_filtered import CONTROLLER
from excitation_node.multisine import EXCITATION
from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.parameters import ParameterGroup
from fjr_kit.atomic import result_folder, write_whole
from fjr_kit.figure_style import STYLE, save
from fjr_sim_node.simulation.simulator import SIMULATOR

from ..investigation import Investigation
from ..outcome.diagnosis import Diagnosis
from ..record_investigation import RecordInvestigation
from .gap_figures import draw_residual_torque, draw_sigma_lines, draw_sigma_maps
from .gap_plots import STAGES
from .gap_report import render_gap_report, stages
from .randomisation import randomisation_yaml, ranges
from .record_figures import record_figures
from .record_report import compared, render_record_report
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

Progress = Callable[[str], None]
Drawing = Callable[[], Figure]


def write_diagnosis(
    investigation: Investigation | RecordInvestigation,
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
            progress("writing updated.yaml")
            values = updated_values(investigation.recorded, investigation.diagnosis)
            save_parameter_file(folder / "updated.yaml", values, GROUPS)
            progress("writing randomisation.yaml")
            found = ranges(investigation.diagnosis.parameters, investigation.diagnosis.bags)
            write_whole(folder / "randomisation.yaml", randomisation_yaml(found))
        made = provenance(command, date)
        if isinstance(investigation, RecordInvestigation):
            compare = compared(investigation)
            drawings = record_figures(compare, known=investigation.evidence.noise.known)
            text = render_record_report(investigation, compare, made)
        else:
            drawings = dict(_figures(investigation))
            text = render_gap_report(investigation, made)
        drawings = {**_waterfall(investigation.diagnosis), **drawings}
        _write_figures(drawings, folder / "figures", progress)
        progress("writing report.html")
        (folder / "report.html").write_text(text, encoding="utf-8")
    return Path(out) / "report.html"


def _write_figures(drawings: Mapping[str, Drawing], folder: Path, progress: Progress) -> None:
    """Draw figures by their names, each as PNG and PDF; none where nothing was simulated."""
    if not drawings:
        return
    folder.mkdir()
    with rc_context(STYLE):
        for name, draw in drawings.items():
            progress(f"drawing {name}")
            save(draw(), folder / name)


def _waterfall(diagnosis: Diagnosis) -> dict[str, Drawing]:
    return {"waterfall": partial(draw_waterfall, diagnosis)} if bars(diagnosis) else {}


def _figures(investigation: Investigation) -> Iterator[tuple[str, Drawing]]:
    models = stages(investigation)
    if not models:
        return
    maps = {STAGES[name]: investigation.maps[name] for name in models}
    if investigation.noise is not None and all(_finite(found) for found in maps.values()):
        yield "where_position", partial(draw_sigma_maps, maps, "position")
        yield "where_torque", partial(draw_sigma_maps, maps, "torque")
        yield "sigma_refit", partial(draw_sigma_lines, maps[STAGES["refit"]])
    torques = investigation.residual_torques
    before, after = torques["refit"], torques.get("explained")
    yield "residual_torque", partial(draw_residual_torque, before, after)


def _finite(found: Any) -> bool:
    return all(np.isfinite(part.sigma).all() for part in found.signals.values())
