"""Figures of the gap: what is drawn is what was found, on one scale, as PNG and PDF."""

from __future__ import annotations

import json

import numpy as np
import pytest
from gap_cases import simulate_case
from matplotlib import rc_context

from bla_analyzer.figure_style import STYLE, save
from gap_diagnosis.gap_figures import (
    SIGMA_RANGE,
    draw_residual_torque,
    draw_sigma_lines,
    draw_sigma_maps,
    sigma_data,
    torque_data,
)
from gap_diagnosis.model import Simulator
from gap_diagnosis.noise import noise_levels
from gap_diagnosis.residual_map import residual_map
from gap_diagnosis.residual_torque import residual_torque


@pytest.fixture(scope="module")
def found():
    case = simulate_case({"backlash.half_gap_rad": 1.5e-3}, seed=1)
    noise, simulator = noise_levels(case.recorded), Simulator(case.recorded)
    maps = {
        title: residual_map(case.recorded, noise, *simulator.signals(model))
        for title, model in (("before", case.bare), ("after", case.truth))
    }
    torque = [residual_torque(case.recorded, model, noise) for model in (case.bare, case.truth)]
    return maps, torque


def test_maps_show_the_sigma_of_each_line_on_one_scale(found):
    figure = draw_sigma_maps(found[0])
    meshes = [m for axis in figure.axes for m in axis.collections if m.get_array() is not None]
    meshes = [m for m in meshes if m.get_array().shape[0] == 3]
    assert len(meshes) == 8
    assert all((m.norm.vmin, m.norm.vmax) == SIGMA_RANGE for m in meshes)
    before = found[0]["before"]
    drawn = sorted(np.asarray(m.get_array()).sum() for m in meshes)
    sigma = before.signals["position"].sigma
    assert max(drawn) == pytest.approx(sigma[:, before.kinds == "excited"].sum())


def test_lines_are_filled_where_discovered(found):
    before = found[0]["before"]
    figure = draw_sigma_lines(before)
    lines = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    counts = {line.get_markerfacecolor() == "none": line.get_xdata().size for line in lines}
    excited = before.signals["position"].significant[0, before.kinds == "excited"]
    assert counts == {False: excited.sum(), True: (~excited).sum()}


def test_the_data_of_the_report_are_plain_and_complete(found):
    maps, (before, _) = found
    data = json.loads(json.dumps(sigma_data(maps["before"]), allow_nan=False))
    assert np.shape(data["signals"]["torque"]["sigma"]) == (3, len(data["frequency_hz"]))
    curves = json.loads(json.dumps(torque_data(before), allow_nan=False))
    assert [len(curves[c]) for c in ("velocity", "position", "deflection")] == [3, 6, 6]
    assert len(curves["position"][0]["torque"]) == 40


def test_figures_are_written(found, tmp_path):
    maps, torque = found
    with rc_context(STYLE):
        figures = (draw_sigma_maps(maps, "torque"), draw_sigma_lines(maps["after"]))
        for i, figure in enumerate((*figures, draw_residual_torque(*torque))):
            save(figure, tmp_path / f"figure_{i}")
    assert all(path.stat().st_size > 5000 for path in tmp_path.iterdir())
    assert len(list(tmp_path.iterdir())) == 6
