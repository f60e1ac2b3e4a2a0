"""Writes the files of a diagnosis into a folder, all of them or none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from bla_analyzer.output import provenance
from controller_node.pd_filtered import CONTROLLER, from_description
from excitation_node.multisine import EXCITATION
from fjr_interface.experiment import Experiment
from fjr_interface.parameter_file import save_parameter_file
from fjr_interface.parameters import ParameterGroup
from fjr_kit.atomic import result_folder
from fjr_kit.figure_style import STYLE, save
from fjr_records.recorded import RecordedExperiment
from fjr_sim_node import effects, plant
from fjr_sim_node.simulation.simulator import SIMULATOR

from ..investigation import Investigation
from .gap_figures import draw_residual_torque, draw_sigma_lines, draw_sigma_maps
from .gap_plots import STAGES
from .gap_report import render_gap_report, stages

OWN_FILES = ("report.html", "diagnosis.json", "updated.yaml", "figures/*.p[nd][gf]")
"""What an earlier diagnosis may have left in a folder, as patterns."""

GROUPS: dict[str, ParameterGroup] = {
    "excitation": EXCITATION,
    "controller": CONTROLLER,
    "simulator": SIMULATOR,
}

Progress = Callable[[str], None]


def write_diagnosis(
    investigation: Investigation,
    out: Path | str,
    *,
    progress: Progress = lambda _: None,
    command: str | None = None,
    date: str | None = None,
) -> Path:
    """Write diagnosis.json, updated.yaml, figures/ and report.html into `out`.

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
            save_parameter_file(folder / "updated.yaml", updated_values(investigation), GROUPS)
        _write_figures(investigation, folder / "figures", progress)
        progress("writing report.html")
        text = render_gap_report(investigation, provenance(command, date))
        (folder / "report.html").write_text(text, encoding="utf-8")
    return Path(out) / "report.html"


def updated_values(investigation: Investigation) -> dict[str, dict[str, Any]]:
    """Return the parameters of the better simulation by node, as nodes and campaigns take them.

    Simulator: refitted base parameters and the named effect, without encoder noise. Controller and
    sample rate: the recorded ones. Excitation: grid, levels and periods of the record, so that a
    campaign plays the same kind of signal, with phases of its own.
    """
    recorded, diagnosis = investigation.recorded, investigation.diagnosis
    description = recorded.experiment
    rate = description.sample_rate_hz
    simulator = simulator_values({name: float(e.value) for name, e in diagnosis.parameters.items()})
    SIMULATOR.check(simulator, "updated.yaml")
    values: dict[str, dict[str, Any]] = {
        "simulator": {"sample_rate_hz": rate, **simulator},
        "excitation": {"sample_rate_hz": rate, **_excitation(recorded)},
    }
    if has_known_law(recorded):
        values["controller"] = from_description(description.controller or {}, rate)
    return values


def simulator_values(found: Mapping[str, float]) -> dict[str, float]:
    """Return the simulator's parameters from those of a diagnosis.

    What the bare plant lacked is in its own parameters then. A rigid axis is one body, whose
    inertia and friction are the motor's.
    """
    light = plant.PLANT["j"].low
    rigid = {"j": light, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0}
    own = plant.with_added({**(rigid if "k0" not in found else {}), **found})
    added = [e for e in effects.CATALOGUE if e.of_bare_plant]
    gone = {*plant.PLANT.names, *(name for effect in added for name in effect.names)}
    return {**own, **{name: value for name, value in found.items() if name not in gone}}


def has_known_law(recorded: RecordedExperiment) -> bool:
    """Tell whether the recorded controller is one that nodes and campaigns can run."""
    controller = recorded.experiment.controller
    return controller is not None and controller.get("kind") == "pd_filtered"


def _excitation(recorded: RecordedExperiment) -> dict[str, Any]:
    """Return what the excitation node needs to play such an experiment."""
    description = recorded.experiment
    harmonics = description.excited_harmonics + description.detection_harmonics
    f0 = description.base_frequency_hz
    counts = [sum(r.level == level for r in recorded.realizations) for level in recorded.levels]
    return {
        "base_frequency_hz": f0,
        "f_min_hz": min(harmonics) * f0,
        "f_max_hz": max(harmonics) * f0,
        "grid": _grid(description),
        "amplitudes_rad": tuple(_amplitude(recorded, level) for level in recorded.levels),
        "realizations": max(counts),
        "periods": description.periods,
        "transient_periods": description.transient_periods,
    }


def _amplitude(recorded: RecordedExperiment, level: int) -> float:
    """Return the amplitude of a level as it was set; the rms over lines if lines differ."""
    amplitudes = next(
        r.experiment.amplitudes_rad for r in recorded.realizations if r.level == level
    )
    return float(amplitudes[0] if np.ptp(amplitudes) == 0.0 else np.sqrt(np.mean(amplitudes**2)))


def _grid(description: Experiment) -> str:
    if any(harmonic % 2 == 0 for harmonic in description.excited_harmonics):
        return "full"
    return "odd_random" if description.detection_harmonics else "odd"


def _write_figures(investigation: Investigation, folder: Path, progress: Progress) -> None:
    """Draw the figures, each as PNG and PDF; none where nothing was simulated."""
    drawings = list(_figures(investigation))
    if not drawings:
        return
    folder.mkdir()
    with rc_context(STYLE):
        for name, draw in drawings:
            progress(f"drawing {name}")
            save(draw(), folder / name)


def _figures(investigation: Investigation) -> Iterator[tuple[str, Callable[[], Figure]]]:
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
