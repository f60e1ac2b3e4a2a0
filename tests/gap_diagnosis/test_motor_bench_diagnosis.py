"""The statements of docs/motor_bench_diagnosis.md on the records themselves."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace

import pytest
from motor_bench import NEEDS_RECORDS, imported
from paths import DOCS

from fjr_records.periodic import RecordedExperiment, read_experiment

SCRIPT = DOCS / "motor_bench" / "diagnose.py"

pytestmark = NEEDS_RECORDS


def script():
    """Return the page's script as a module."""
    spec = importlib.util.spec_from_file_location("bench_diagnosis", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("bench"), script()
    a, b = (read_experiment(imported(folder, record)).realizations[0] for record in "AB")
    a, b = (replace(r, torque=made.held(r.torque)) for r in (a, b))
    return made.prepare(a, b, made.nominal(a, RecordedExperiment("a", (a,)).lines))


@pytest.fixture(scope="module")
def refit(bench):
    return bench.fitter.refit()


def with_effect(bench, refit, effect):
    return bench.fitter.add(refit, effect, bench.fitter.screening(refit, effect).proposals())


def test_the_bench_is_predicted_from_its_current_with_both_encoders(bench):
    assert not bench.recorded.repeatable and bench.recorded.has_link


def test_the_inertias_are_equal_and_the_stiffness_is_found(refit):
    plant = refit.model.plant
    assert plant["jm"] == pytest.approx(plant["j"], rel=0.01)
    assert plant["k0"] == pytest.approx(548.0, rel=0.005)


def test_a_delay_halves_what_the_refit_leaves_on_the_held_out_record(bench, refit):
    delay = with_effect(bench, refit, "delay")
    assert delay.converged
    assert delay.model.effects["delay.time_s"] == pytest.approx(0.107e-3, rel=0.03)
    assert delay.held_chi2 < 0.7 * refit.held_chi2
    lag = with_effect(bench, refit, "actuator_lag")
    assert lag.held_chi2 == pytest.approx(delay.held_chi2, rel=0.05)


@pytest.mark.parametrize("effect", ["backlash", "piecewise_stiffness", "presliding_friction"])
def test_what_the_records_do_not_call_for_gains_nothing(bench, refit, effect):
    assert with_effect(bench, refit, effect).held_chi2 > 0.9 * refit.held_chi2
