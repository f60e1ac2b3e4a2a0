"""Records so slow that inertia moves nothing are compared by their torque over the angle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import PLANT, coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.investigation import Investigation, Order, investigate_runs
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.quasi_static import stations
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.outcome.verdict_words import LOST
from gap_diagnosis.report.gap_output import write_diagnosis

RATE, KEPT = 1000.0, 20
NOMINAL = {name: float(value) for name, value in PLANT.defaults().items()}
SMOOTH = {**NOMINAL, "fs": 0.0, "fsm": 0.0}
SPEED = 0.1
RIPPLE = {
    "cogging.amplitude_nm": 4.0,
    "cogging.cycles_per_turn": 24.0,
    "cogging.phase_rad": 0.7,
}
LAWS = {
    "none": {},
    "cogging": RIPPLE,
    "gravity": {"gravity.torque_nm": 6.0, "gravity.angle_rad": 0.4},
    "spring": {"external_spring.stiffness_nm_rad": 5.0, "external_spring.rest_rad": 0.3},
    "bias": {"torque_bias.torque_nm": 2.0},
    "position friction": {
        "position_friction.amplitude_nm": 2.0,
        "position_friction.cycles_per_turn": 9.0,
    },
    "ripple of the constant": {
        "torque_constant_ripple.amplitude": 0.1,
        "torque_constant_ripple.cycles_per_turn": 15.0,
    },
    "load friction": {"load_friction.coefficient": 0.2},
    "asymmetry": {"asymmetric_friction.coulomb_nm": 1.5},
    "drag": {"quadratic_friction.motor_nm_s2_rad2": 200.0},
}


def slow_record(effects, *, plant=NOMINAL, speed=SPEED, turns=0.5, every=KEPT) -> RecordSet:
    """Return slow sweeps to and fro, at two speeds, that a loop held; sampled slowly."""
    samples = int(RATE * 2.0 * np.pi * turns / speed)
    there = speed / RATE * np.arange(samples)
    slowly = 0.5 * speed / RATE * np.arange(2 * samples)
    reference = np.concatenate([there, there[::-1], slowly, slowly[::-1]])
    law = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE, "p": 3000.0, "d": 150.0})
    run = simulate(
        reference, RATE, coefficients(plant), pd_filtered.coefficients(law),
        1e-6 * np.random.default_rng(3).standard_normal(reference.size), fx.coefficients(effects),
    )  # fmt: skip
    kept = slice(0, None, every)
    description = RecordDescription.of(
        "test", sample_rate_hz=RATE / every, level=0, levels=1, realization=0, realizations=1
    )
    record = Record("sweep", description, None, run.torque[kept], run.position[kept], None)
    return RecordSet("test", RATE / every, (record,))


@pytest.mark.parametrize("name", LAWS)
def test_the_torque_along_a_slow_motion_is_that_of_the_simulated_rig(name):
    found = stations(slow_record(LAWS[name]), NOMINAL)
    simulator = Evidence(found.records, NOMINAL, found).simulator
    (missing,) = simulator.missing_torque(Model(NOMINAL, LAWS[name]), [0])
    torque = np.std(found.records.records[0].torque)
    assert np.quantile(np.abs(missing), 0.97) < 0.04 * torque  # not where it turns round
    if LAWS[name]:
        (bare,) = simulator.missing_torque(Model(NOMINAL, {}), [0])
        assert np.quantile(np.abs(bare), 0.97) > 0.08 * torque


@pytest.mark.parametrize("loss", [
    {"load_friction.coefficient": 0.3},
    {"directional_loss.forward": 0.4, "directional_loss.backward": 0.1},
], ids=["load friction", "directional loss"])  # fmt: skip
def test_the_torque_along_a_slow_motion_holds_what_the_gear_of_a_rigid_axis_loses(loss):
    rigid, law = NOMINAL | {"k0": np.inf}, LAWS["gravity"] | loss
    found = stations(slow_record(law, plant=rigid), rigid)
    simulator = Evidence(found.records, rigid, found).simulator
    (missing,) = simulator.missing_torque(Model(Model.nominal(rigid).plant, law), [0])
    torque = np.std(found.records.records[0].torque)
    assert np.quantile(np.abs(missing), 0.97) < 0.04 * torque
    (without,) = simulator.missing_torque(Model(Model.nominal(rigid).plant, LAWS["gravity"]), [0])
    assert np.quantile(np.abs(without), 0.97) > 0.08 * torque


@pytest.fixture(scope="module")
def found() -> Investigation:
    return investigate(slow_record(RIPPLE), SMOOTH)


def test_cogging_and_the_friction_that_a_datasheet_lacks_are_named(found):
    diagnosis = found.diagnosis
    assert {"cogging", "coulomb_friction"} == set(diagnosis.effects)
    sizes = diagnosis.parameters
    assert sizes["cogging.cycles_per_turn"].value == pytest.approx(24.0, abs=0.1)
    assert sizes["cogging.amplitude_nm"].value == pytest.approx(4.0, rel=0.03)
    friction = [sizes[f"coulomb_friction.{side}_nm"].value for side in ("motor", "link")]
    assert sum(friction) == pytest.approx(NOMINAL["fs"] + NOMINAL["fsm"], rel=0.03)


def test_it_says_that_torques_were_compared(found, tmp_path):
    diagnosis = found.diagnosis
    assert diagnosis.compared == "torque" and diagnosis.steps[-1].nrmse_position is None
    assert diagnosis.steps[-1].nrmse_torque < 0.1 < diagnosis.steps[0].nrmse_torque
    page = write_diagnosis(found, tmp_path).read_text(encoding="utf-8")
    assert "no motion was simulated" in page and "rms error of the torque" in page
    assert "sample_rate_hz" not in (tmp_path / "updated.yaml").read_text(encoding="utf-8")


def test_a_known_loop_is_played_first(found):
    assert found.fitted.evidence.slow
    records = slow_record(RIPPLE, every=1, turns=0.1)
    law = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE, "p": 3000.0, "d": 150.0})
    (record,) = records.records
    description = record.description.model_copy(
        update={"controller": pd_filtered.describe(law), "sample_rate_hz": RATE}
    )
    reference = record.position + record.torque / 3000.0
    known = replace(record, description=description, reference=reference)
    told: list[str] = []
    investigate(
        replace(records, records=(known,)), NOMINAL, effects=("cogging",), progress=told.append
    )
    assert told[0] == "windows and noise"


def test_what_inertia_moves_is_no_slow_motion():
    assert stations(slow_record({}), NOMINAL) is not None
    assert stations(slow_record({}, speed=20.0, every=1, turns=20.0), NOMINAL) is None


def test_a_model_that_misses_more_than_the_motion_names_nothing(monkeypatch):
    monkeypatch.setattr("gap_diagnosis.investigation.misses", lambda *_, **__: 9.0)
    records = slow_record(RIPPLE)
    slow = stations(records, SMOOTH)
    diagnosis = investigate_runs(records, Order(SMOOTH), slow).diagnosis
    assert diagnosis.verdict == "unexplained" and not diagnosis.causes
    assert LOST in diagnosis.notes


ROTOR = {**{name: 0.0 for name in NOMINAL}, "jm": 0.01, "k0": np.inf}


def held_record(position, rate, law, torque_noise, resolution=0.0) -> RecordSet:
    """Return a motion with the torque that a law asks for along it, both with noise."""
    rng = np.random.default_rng(1)
    velocity = uniform_filter1d(np.gradient(position) * rate, 5)
    torque = law(position, velocity) + torque_noise * rng.standard_normal(position.size)
    seen = position + 1e-6 * rng.standard_normal(position.size)
    if resolution:
        seen = np.round(seen / resolution) * resolution
    description = RecordDescription.of(
        "test", sample_rate_hz=rate, level=0, levels=1, realization=0, realizations=1
    )
    return RecordSet("test", rate, (Record("run", description, None, torque, seen, None),))


def there_and_back(speeds, span, rate) -> np.ndarray:
    """Return sweeps of a span, one at each speed."""
    up = [v / rate * np.arange(int(span / v * rate)) - span / 2 for v in speeds]
    return np.concatenate([sweep for one in up for sweep in (one, one[::-1])])


def test_friction_and_gravity_of_a_stranger_show_only_together():
    position = there_and_back((0.1, 0.3), 1.5, 1000.0)
    records = held_record(
        position, 1000.0,
        lambda y, v: 30.0 * np.sin(y + 0.4) + 8.0 * np.sign(v) + 12.0 * v, 0.5, 1e-5,
    )  # fmt: skip
    diagnosis = investigate(records, {**ROTOR, "jm": 2.0}).diagnosis
    sizes = {name: found.value for name, found in diagnosis.parameters.items()}
    assert sizes["gravity.torque_nm"] == pytest.approx(30.0, rel=0.02)
    assert sizes["coulomb_friction.motor_nm"] == pytest.approx(8.0, rel=0.06)
    assert sizes["viscous_friction.motor_nm_s_rad"] == pytest.approx(12.0, rel=0.09)
    assert set(diagnosis.effects) == {"gravity", "coulomb_friction", "viscous_friction"}


def test_one_speed_one_way_does_not_tell_frictions_apart():
    position = 0.1 / 50.0 * np.arange(6000)
    records = held_record(position, 50.0, lambda y, v: 2.0 * np.sign(v), 0.05)
    (cause,) = investigate(records, ROTOR).diagnosis.causes
    alike = {"coulomb_friction", "viscous_friction", "torque_bias"}
    assert alike <= {cause.effect, *cause.others}


def test_a_friction_of_no_catalogue_is_not_named():
    position = there_and_back((0.05, 0.15), 6.0, 50.0)
    known = {**ROTOR, "jm": 0.05, "fsm": 2.0, "fvm": 0.5}

    def worn(y, v):
        return np.sign(v) * (2.0 + 1.5 * np.exp(-(((y - 1.0) / 0.3) ** 2))) + 0.5 * v

    diagnosis = investigate(held_record(position, 50.0, worn, 0.02), known).diagnosis
    assert diagnosis.verdict == "unexplained" and not diagnosis.causes


def test_torque_quicker_than_what_noise_hides_is_no_slow_motion():
    rate, time = 1000.0, np.arange(16000) / 1000.0
    noise = 5e-3 * np.random.default_rng(2).standard_normal(time.size)
    records = held_record(
        5.0 * time + noise, rate, lambda y, v: 0.1 + 0.2 * np.sin(2 * np.pi * 60.0 * time), 0.02
    )
    assert stations(records, {**ROTOR, "jm": 2e-4}) is None


@pytest.mark.parametrize("swing_rad", [0.0, 1e-3])
def test_an_axis_that_swings_at_ripples_is_not_slow_for_its_coarse_encoder(swing_rad):
    """Averaged as long as its noise calls for, the swings are gone; a loop hardly feels them."""
    rate, time = 1000.0, np.arange(10000) / 1000.0
    noise = 4e-4 * np.random.default_rng(2).standard_normal(time.size)
    position = 10.0 * time + swing_rad * np.sin(84.0 * 10.0 * time) + noise
    records = held_record(position, rate, lambda y, v: 0.3 * np.sign(v), 0.01)
    assert (stations(records, {**ROTOR, "jm": 4e-4}) is None) == (swing_rad > 0.0)


def test_where_inertia_takes_torque_between_two_speeds_nothing_is_compared():
    rate, jm = 100.0, 2e-3
    speed = np.repeat([0.5, -0.5, 2.0, -2.0, 1.0, -1.0], int(8.0 * rate))
    speed = uniform_filter1d(speed, 31)
    torque = 0.05 * np.sign(speed) + 0.01 * speed
    accelerating = jm * np.gradient(speed) * rate
    assert np.abs(accelerating).max() > 0.3 * np.abs(torque).max()
    description = RecordDescription.of(
        "test", sample_rate_hz=rate, level=0, levels=1, realization=0, realizations=1,
        controller=None,
    )  # fmt: skip
    position = np.cumsum(speed) / rate
    runs = RecordSet(
        "test", rate, (Record("run", description, None, torque + accelerating, position, None),)
    )
    found = stations(runs, {**NOMINAL, "jm": jm, "j": 0.0, "k0": np.inf})
    assert found is not None
    (record,), (of_speed,), (way,) = found.records.records, found.speeds, found.directions
    left = record.torque - 0.05 * way - 0.01 * of_speed
    assert np.mean(np.abs(left) > 0.05 * np.abs(torque).max()) < 0.01
