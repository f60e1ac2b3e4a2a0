"""From bags to a model and its files: simulated rigs, one and two outputs, and the motor bench."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from drawn_bla import LINEAR
from html_page import Page
from motor_bench import NEEDS_RECORDS, imported
from scipy.io import loadmat

from bla_analyzer import Fit, Result, analyze, fit_bla, load_result, to_control, write_fit
from bla_analyzer.fit.fit_words import pairs
from bla_analyzer.output import write_result
from controller_node import CONTROLLER, pd_filtered
from excitation_node import EXCITATION, describe, reference
from fjr_interface.bags.writer import BagWriter
from fjr_interface.topics import LINK_POSITION, SIGNALS
from fjr_kit.errors import InputError
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis import read_nominal

RATE = 500.0


def record(folder: Path, values: dict, amplitudes: tuple[float, ...] = (0.01,)) -> Path:
    """Record realizations of a rig with two encoders, each with noise of its own."""
    excitation = EXCITATION.check(
        {
            "sample_rate_hz": RATE,
            "base_frequency_hz": 0.5,
            "f_min_hz": 0.5,
            "f_max_hz": 30.0,
            "amplitudes_rad": amplitudes,
            "realizations": 4,
            "periods": 2,
            "transient_periods": 2,
        }
    )
    law = CONTROLLER.check({"sample_rate_hz": RATE})
    rng = np.random.default_rng(11)
    for level in range(len(amplitudes)):
        for realization in range(4):
            experiment = describe(excitation, level, realization)
            r = np.tile(reference(experiment), 4)[: experiment.samples]
            noise = 2e-6 * rng.standard_normal((2, r.size))
            run = simulate(r, RATE, coefficients(values), pd_filtered.coefficients(law), noise[0])
            link = run.motor if np.isinf(values["k0"]) else run.link
            with BagWriter(
                folder / f"l{level}r{realization}", experiment, signals=(*SIGNALS, LINK_POSITION)
            ) as bag:
                bag.write_arrays(r=r, u=run.torque, y=run.position, q=link + noise[1])
    return folder


@pytest.fixture(scope="module")
def linear(tmp_path_factory) -> Result:
    return analyze(record(tmp_path_factory.mktemp("linear"), LINEAR))


@pytest.fixture(scope="module")
def both(linear) -> Fit:
    return fit_bla(linear, model="two-inertia")


def test_two_outputs_of_simulated_bags_give_back_the_rig(both):
    (level,) = both.levels
    assert [one.output for one in level.outputs] == ["motor_position", "link_position"]
    held = {name: one.holds(LINEAR[name]) for name, one in level.parameters.items()}
    assert sum(held.values()) >= 4, held  # five intervals of 95 %
    for name, one in level.parameters.items():
        assert one.value == pytest.approx(LINEAR[name], rel=0.02)
    assert level.test.passed
    assert level.whiteness.p_value > 1e-3
    (resonance,) = pairs(level.poles)
    expected = np.sqrt(LINEAR["k0"] * (1 / LINEAR["j"] + 1 / LINEAR["jm"])) / (2 * np.pi)
    assert resonance.frequency_hz.value == pytest.approx(expected, rel=1e-3)


def test_one_denominator_serves_both_outputs_of_a_rational_model(linear, both):
    fit = fit_bla(linear, order=(2, 4))
    (level,) = fit.levels
    assert len(level.outputs) == 2 and len(level.poles) == 4 and level.test.name == "2/4"
    (resonance,) = pairs(level.poles)
    assert resonance.frequency_hz.value == pytest.approx(
        pairs(both.levels[0].poles)[0].frequency_hz.value, rel=1e-3
    )
    assert level.test.parameters == 2 * 3 + 4
    one = fit_bla(linear, order=(2, 4), link=False).levels[0]
    assert len(one.outputs) == 1 and one.test.parameters == 3 + 4


def test_the_order_is_found(linear):
    (level,) = fit_bla(linear, link=False).levels
    assert level.test == min(level.orders, key=lambda test: test.mdl)
    assert level.test.name == "2/4"
    assert {"0/2", "2/4"} <= {test.name for test in level.orders}


def test_a_discrete_model_has_the_same_poles(linear, both):
    (level,) = fit_bla(linear, order=(3, 4), domain="z", link=False).levels
    (found,), (expected,) = pairs(level.poles), pairs(both.levels[0].poles)
    assert found.frequency_hz.value == pytest.approx(expected.frequency_hz.value, rel=1e-3)
    assert found.damping_ratio.value == pytest.approx(expected.damping_ratio.value, rel=0.05)
    assert abs(complex(found.re, found.im)) < 1.0


def test_all_files_come_and_read_back(both, linear, tmp_path):
    page = write_fit(both, tmp_path / "fit")
    folder = page.parent
    text = page.read_text("utf-8")
    assert page.name == "fit.html" and "Two-inertia model" in text
    assert [plots["fit"]["linked"] for plots in Page(text).data()["levels"]] == [True]
    assert ("nav", {"class": "switches", "aria-label": "Frequency axis"}) in Page(text).tags
    assert Fit.read(folder / "fit.json").to_json() == both.to_json()
    assert (folder / "figures" / "level_0_fit.png").stat().st_size > 10_000
    level = loadmat(folder / "fit.mat", squeeze_me=True)["fit"]["level"].item()
    k0 = both.levels[0].parameters["k0"].value
    assert level["parameters"].item()["k0"].item()["value"].item() == k0
    nominal = read_nominal(folder / "nominal_level_0.yaml")
    assert nominal["k0"] == pytest.approx(k0) and nominal["fs"] == nominal["k1"] == 0.0
    write_result(linear, tmp_path / "analysis", figures=False, report=False)
    again = load_result(tmp_path / "analysis" / "result.json")
    assert fit_bla(again, model="two-inertia").to_json() == both.to_json()
    header = (tmp_path / "analysis" / "frf.csv").read_text().splitlines()[0]
    assert header.endswith("link_cov_total_im_rad2_per_nm2")


def test_the_model_for_python_control_is_that_of_the_plant(both):
    pytest.importorskip("control", reason="python-control is optional and not installed here")
    plant = to_control(both, level=0)
    s = 2j * np.pi * 7.0
    p = {name: one.value for name, one in both.levels[0].parameters.items()}
    held = p["j"] * s**2 + p["fv"] * s + p["k0"]
    below = (p["jm"] * s**2 + p["fvm"] * s + p["k0"]) * held - p["k0"] ** 2
    np.testing.assert_allclose(plant(s)[:, 0], [held / below, p["k0"] / below], rtol=1e-9)


def test_a_rigid_model_of_a_flexible_joint_is_refused_by_its_test(linear):
    (level,) = fit_bla(linear, model="rigid").levels
    assert not level.test.passed and level.widening > 3.0
    assert any("does not explain" in sentence for sentence in level.findings)


def test_a_rigid_rig_is_found_rigid(tmp_path):
    rigid = LINEAR | {"k0": np.inf, "j": 0.3}
    (level,) = fit_bla(analyze(record(tmp_path / "rigid", rigid)), model="rigid").levels
    assert level.parameters["jm"].value == pytest.approx(0.5, rel=0.01)


def test_levels_of_a_stiffening_spring_are_told_apart(tmp_path):
    rig = LINEAR | {"k1": 3e3, "fv": 4.0, "fvm": 2.0}
    fit = fit_bla(analyze(record(tmp_path / "stiff", rig, (0.002, 0.01))), model="two-inertia")
    k0 = [level.parameters["k0"] for level in fit.levels]
    assert k0[1].low > k0[0].high
    assert "k0" in fit.between_levels[0] and "nonlinear" in fit.between_levels[0]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"order": (4, 4)}, "order 4/4"),
        ({"order": (1, 2), "model": "rigid"}, "model rigid"),
        ({"level": 3}, "Level 3"),
        ({"model": "three-inertia"}, "three-inertia"),
        ({"delay": float("nan")}, "delay"),
        ({"order": (18, 20), "link": False}, "lower order"),
    ],
)
def test_options_that_do_not_fit_are_refused_in_a_sentence(linear, options, words):
    if options.get("order") == (18, 20):
        bla = linear.levels[0].bla
        few = {n: v[:12] for n, v in bla if isinstance(v, np.ndarray)} | {"link": None}
        level = linear.levels[0].model_copy(
            update={"bla": bla.model_copy(update=few), "comparisons": ()}
        )
        linear = linear.model_copy(update={"levels": (level,)})
    with pytest.raises(InputError, match=words):
        fit_bla(linear, **options)


def test_the_command_prints_intervals_and_the_page_last(run, linear, tmp_path):
    analysis = tmp_path / "analysis"
    write_result(linear, analysis, figures=False, report=False)
    done = run("fit", analysis, "--model", "two-inertia", "--no-report")
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines()[-1] == str(analysis / "fit" / "fit.json")
    assert "k0, stiffness (N m/rad)" in done.stdout and "explains the BLA" in done.stdout
    made = json.loads((analysis / "fit" / "fit.json").read_text())
    assert made["schema"] == "fjr_rig/fit/1"
    for arguments, words in (
        (("--order", "2-4"), "--order 2-4"),
        (("--delay", "late"), "--delay late"),
        (("--order", "5/4"), "order 5/4"),
        (("--periods", "1"), "analyzed already"),
    ):
        bad = run("fit", analysis, *arguments, "--no-report", "--out", tmp_path / "none")
        assert bad.exit_code == 2 and words in bad.stderr, bad.output
        assert not (tmp_path / "none").exists()


@NEEDS_RECORDS
def test_the_two_masses_of_the_motor_bench(tmp_path):
    """The page gives 53 and 77 Hz to one line of the grid, 4 Hz in this record."""
    result = analyze(imported(tmp_path, "B").parent, method="fast")
    options = {"model": "two-inertia", "hold": "none", "delay": "free"}
    for link in (True, False):
        (level,) = fit_bla(result, **options, link=link).levels
        (resonance,), (anti,) = pairs(level.poles), pairs(level.outputs[0].zeros)
        assert abs(resonance.frequency_hz.value - 77.0) < 1.0
        assert abs(anti.frequency_hz.value - 53.0) < 1.5
    assert not level.test.passed  # friction: see the page
