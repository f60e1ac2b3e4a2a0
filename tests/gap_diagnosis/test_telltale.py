"""The telltale of every effect: over the quantity of its entry, data follow the right law alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_rig import axis, moderate
from test_evidence import LAW, NOISE, NOMINAL, RATE, reference
from test_quasi_static import NOMINAL as SLOW_NOMINAL
from test_quasi_static import slow_record

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.quasi_static import stations
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.report.telltales import drawn
from gap_diagnosis.where.telltale import Shown, shown, why_not

SAMPLES = 2000
IN_THE_NOISE = {"stribeck_friction_link", "encoder_quantization", "encoder_eccentricity"}
"""Effects whose moderate size adds less than noise makes, on this record."""

SLOWER = {"torque_slew_limit.limit_nm_s": 4e3}
"""What a record at this rate reaches."""


def of_effect(*identifiers: str) -> Model:
    """Return the paper's rig with effects of moderate size."""
    model = Model.nominal({**NOMINAL, **axis(*identifiers)}).with_effects(moderate(*identifiers))
    return replace(
        model, effects=model.effects | {n: v for n, v in SLOWER.items() if n in model.effects}
    )


def recorded(model: Model) -> RecordSet:
    """Return a short run of a model in its loop, with noise."""
    run = simulate(
        reference(3, SAMPLES, 0.04), RATE, model.plant_coefficients,
        pd_filtered.coefficients(LAW), NOISE * np.random.default_rng(4).standard_normal(SAMPLES),
        model.effect_coefficients,
    )  # fmt: skip
    description = RecordDescription.of(
        "test", sample_rate_hz=RATE, controller=pd_filtered.describe(LAW)
    )
    record = Record("run", description, run.reference, run.torque, run.position, None)
    return RecordSet("test", RATE, (record,))


def seen(effect: str, model: Model) -> Shown:
    """Return what shows an effect of the rig that a model is."""
    evidence = Evidence(recorded(model), {**NOMINAL, **axis(effect)})
    assert not why_not(evidence, effect)
    found = shown(evidence, effect, model)
    assert found is not None
    return found


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_every_quantity_is_that_of_some_effect_and_has_a_name_and_a_unit():
    telltales = [effect.telltale for effect in fx.CATALOGUE]
    assert {told.over for told in telltales} == set(fx.QUANTITIES)
    assert {told.along for told in telltales} - {""} < set(fx.QUANTITIES)


@pytest.mark.parametrize("effect", fx.EFFECTS)
def test_data_of_a_rig_with_an_effect_follow_its_law_over_its_quantity(effect):
    found = seen(effect, of_effect(effect))
    if effect not in IN_THE_NOISE:
        assert rms(found.left) < 0.2 * rms(found.without)
        assert rms(found.added - found.without) < 0.4 * rms(found.without)
    frequency = fx.EFFECTS[effect].telltale.over == "frequency"
    plot = drawn(found, effect)
    assert len(plot["data"]) == 4 - frequency and plot.get("linked", False) == frequency
    assert all(
        np.isfinite(np.array(trace["x"] + trace["y"], float)).all() for trace in plot["data"]
    )
    assert len(str(plot)) < 20_000


def test_a_law_of_another_form_leaves_the_curve():
    """Drag with the square of velocity, taken for drag in proportion to it."""
    true = of_effect("quadratic_friction")
    evidence = Evidence(recorded(true), NOMINAL)
    linear = Model(true.plant, {"viscous_friction.motor_nm_s_rad": 3.0})
    found = shown(evidence, "viscous_friction", linear)
    assert found is not None and rms(found.left) > 0.25 * rms(found.added)


def test_the_curve_is_the_law_in_newton_metres():
    """A bias adds its torque at every angle; a dead band takes no more than its half width."""
    bias = seen("torque_bias", of_effect("torque_bias"))
    assert np.allclose(bias.added, 1.0, atol=0.02)
    band = seen("dead_band", of_effect("dead_band"))
    assert np.abs(band.added).max() < moderate("dead_band")["dead_band.width_nm"]
    assert np.mean(band.added * np.sign(band.center)) < 0.0


def test_slow_records_show_what_acts_over_angle_and_speed_and_say_why_not_the_rest():
    law = {"viscous_friction.motor_nm_s_rad": 40.0}
    records = slow_record(law)
    slow = stations(records, SLOW_NOMINAL)
    evidence = Evidence(slow.records, SLOW_NOMINAL, slow)
    found = shown(evidence, "viscous_friction", Model.nominal(SLOW_NOMINAL).with_effects(law))
    assert found is not None
    assert np.allclose(found.added, -40.0 * found.center, rtol=0.05, atol=0.05)
    assert "so slow" in why_not(evidence, "backlash") and "so slow" in why_not(evidence, "delay")
    assert not why_not(evidence, "load_friction")


def test_a_rig_that_swings_free_has_no_plot_over_a_torque():
    model = of_effect("gravity")
    whole = recorded(model)
    free = replace(whole, records=(replace(whole.records[0], torque=np.zeros(SAMPLES)),))
    evidence = Evidence(free, NOMINAL)
    assert why_not(evidence, "torque_gain") == "no torque was recorded"
    assert not why_not(evidence, "gravity")
    assert shown(evidence, "gravity", model) is not None
