"""Figures of the gap: what is drawn is what was found, on one scale, as PNG and PDF."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import simulate_case
from matplotlib import rc_context
from matplotlib.image import imread

from fjr_kit.figure_style import STYLE, save
from fjr_records.noise import noise_levels
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.report.gap_figures import (
    SIGMA_RANGE,
    draw_residual_torque,
    draw_sigma_lines,
    draw_sigma_maps,
)
from gap_diagnosis.where.residual_map import residual_map
from gap_diagnosis.where.residual_torque import residual_torque


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


def test_written_figures_show_what_is_drawn_and_are_the_same_again(found, tmp_path):
    maps, torque = found
    for name in ("first", "again"):
        with rc_context(STYLE):
            save(draw_sigma_maps(maps, "torque"), tmp_path / f"maps_{name}")
            save(draw_sigma_lines(maps["after"]), tmp_path / f"lines_{name}")
            save(draw_residual_torque(*torque), tmp_path / f"torque_{name}")
            save(draw_residual_torque(torque[1]), tmp_path / f"other_{name}")
    images = {}
    for what in ("maps", "lines", "torque", "other"):
        for kind in ("png", "pdf"):
            first, again = (tmp_path / f"{what}_{name}.{kind}" for name in ("first", "again"))
            assert first.read_bytes() == again.read_bytes()
        images[what] = imread(tmp_path / f"{what}_first.png")
        left, right = np.array_split(images[what][..., :3], 2, axis=1)
        assert min(half.std() for half in (left, right)) > 0.02  # neither is left white
    assert not np.array_equal(images["torque"], images["other"])
