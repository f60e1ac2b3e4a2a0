"""Runs of other inertia or load are told apart from scatter of friction and from sprung masses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.gates.by_run import RunValue, seen_by_run
from gap_diagnosis.gates.run_inertias import different_inertias, inertias_differ
from gap_diagnosis.gates.run_loads import RunLoad, different_loads, loads_differ
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.seen_inertia import SeenInertia

RATE, SECONDS, RIGS = 200.0, 10.0, 30
FRICTIONS = ("coulomb_friction", "viscous_friction")


def wave(rng: np.random.Generator, top_hz: float) -> np.ndarray:
    samples = int(RATE * SECONDS)
    lines = np.fft.rfftfreq(samples, 1.0 / RATE)
    turned = np.exp(2j * np.pi * rng.uniform(size=lines.size))
    wanted = np.fft.irfft(np.where((lines > 0.15) & (lines < top_hz), turned, 0.0), samples)
    return wanted / wanted.std() * np.minimum(1.0, np.arange(samples) / RATE)


def recorded(
    seed: int, factors: tuple[float, ...], hz: float = 0.0, loads: tuple[float, ...] = ()
) -> RecordSet:
    """Return runs of a random axis of 1 kg m2 at most, whose friction scatters by 2 to 5 %.

    Its friction falls from breakaway and yields before it slides. Amplitude and band are others in
    each run.

    Args:
        seed: of all that is random.
        factors: of the inertia in each run.
        hz: frequency of a load on a spring, half of the inertia; 0 for a rigid axis.
        loads: constant torque against the motor in each run, over its usual torque; none if empty.
    """
    rng = np.random.default_rng(seed)
    total, amplitude = 10.0 ** rng.uniform(-3.0, 0.0), rng.uniform(0.1, 0.6)
    usual, scatter = total * amplitude * 150.0, rng.uniform(0.02, 0.05)
    level, drag = usual * rng.uniform(0.03, 0.2), usual / amplitude / 10.0 * rng.uniform(0.03, 0.3)
    weight = usual * rng.choice([0.0, 0.5])
    law = pd_filtered.CONTROLLER.check(
        {"sample_rate_hz": RATE, "p": 100.0 * total, "d": 14.0 * total, "n": 120.0}
    )
    runs = []
    for number, factor in enumerate(factors):
        coulomb, viscous = (1.0 + scatter * rng.standard_normal(2)) * (level, drag)
        effects = {
            "stribeck_friction_motor.torque_nm": 0.3 * coulomb,
            "stribeck_friction_motor.velocity_rad_s": 0.3 * amplitude,
            "presliding_friction.motor_rad": 2e-3 * amplitude,
            "gravity.torque_nm": weight,
            "torque_bias.torque_nm": -usual * loads[number] if loads else 0.0,
        }
        if hz:
            stiffness = 0.5 * total * (2.0 * np.pi * hz) ** 2
            effects |= {
                "transmission_stiffness.compliance_rad_nm": 1.0 / stiffness,
                "transmission_stiffness.link_inertia_share": 0.5,
                "transmission_stiffness.link_coulomb_share": 0.0,
                "transmission_stiffness.link_viscous_share": 0.5,
            }
        model = Model({"jm": factor * total, "fsm": coulomb, "fvm": viscous}, effects)
        wanted = amplitude * rng.uniform(0.4, 1.0) * wave(rng, rng.uniform(1.5, 5.0))
        signals = simulate(
            wanted, RATE, model.plant_coefficients, pd_filtered.coefficients(law),
            1e-4 * amplitude * rng.standard_normal(wanted.size), model.effect_coefficients,
        )  # fmt: skip
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=number,
            realizations=len(factors),
        )  # fmt: skip
        name = f"run_{number}"
        runs.append(Record(name, described, None, signals.torque, signals.position, None))
    return RecordSet("test", RATE, tuple(runs))


def as_linear(runs: RecordSet) -> RecordSet:
    """Return the same runs as those of a linear axis, on which no load goes with the angle."""
    described = [r.description.model_copy(update={"axis": "linear"}) for r in runs.records]
    each = zip(runs.records, described, strict=True)
    return replace(runs, records=tuple(replace(r, description=d) for r, d in each))


def fitted(runs: RecordSet, seed: int, frictions: bool) -> tuple[Evidence, Model]:
    """Return the evidence and the refit, or one with plain frictions."""
    total = 10.0 ** np.random.default_rng(seed).uniform(-3.0, 0.0)
    nominal = datasheet({"jm": 1.05 * total}, "test")
    fitter = CellFitter(Evidence(runs, nominal), Model.nominal(nominal).plant, 0.1)
    fit = fitter.refit()
    for effect in FRICTIONS if frictions else ():
        fit = fitter.add(fit, effect, fitter.screening(fit, effect).proposals()) or fit
    return fitter.evidence, fit.model


def seen(runs: RecordSet, seed: int, frictions: bool) -> tuple[Evidence, Mapping[str, SeenInertia]]:
    """Return the evidence, and what each run shows beside such a fit."""
    evidence, model = fitted(runs, seed, frictions)
    return evidence, seen_by_run(evidence, model)


def told(runs: RecordSet, seed: int, frictions: bool) -> list[RunValue]:
    """Return the different inertias beside such a fit, over that of the rig."""
    total = 10.0 ** np.random.default_rng(seed).uniform(-3.0, 0.0)
    return [
        RunValue(run.name, run.value / total, run.error / total)
        for run in different_inertias(*seen(runs, seed, frictions))
    ]


def test_friction_that_scatters_is_never_told_as_inertia_or_load():
    alarms = []
    for seed in range(RIGS):
        evidence, model = fitted(recorded(seed, (1.0,) * 4), seed, bool(seed % 2))
        shown = seen_by_run(evidence, model)
        alarms += different_inertias(evidence, shown) + different_loads(evidence, shown)
        evidence.records = as_linear(evidence.records)
        alarms += different_loads(evidence, seen_by_run(evidence, model))
    assert alarms == []


def test_a_load_in_half_of_the_runs_is_told_with_its_value():
    """Of a fifth of the usual torque, on linear axes: gravity of an angle may look like it."""
    missed = 0
    for seed in range(10):
        runs = recorded(seed, (1.0,) * 4, loads=(0.0, 0.2, 0.0, 0.2))
        assert different_loads(*seen(runs, seed, bool(seed % 2))) == []
        found = different_loads(*seen(as_linear(runs), seed, bool(seed % 2)))
        rng = np.random.default_rng(seed)
        usual = 10.0 ** rng.uniform(-3.0, 0.0) * rng.uniform(0.1, 0.6) * 150.0
        missed += not found
        values = [run.value / usual for run in found]
        assert not found or np.diff(values) == pytest.approx([0.2, -0.2, 0.2], rel=0.15)
    assert missed <= 1


def test_a_payload_in_half_of_the_runs_is_told_with_its_values():
    factors = (1.0, 1.0, 1.4, 1.4)
    found = [told(recorded(seed, factors), seed, bool(seed % 2)) for seed in range(8)]
    assert all(found)
    for run in (run for runs in found for run in runs):
        assert run.value == pytest.approx(factors[int(run.name[-1])], rel=0.1)


@pytest.mark.parametrize("hz", [0.8, 2.0, 4.0])
def test_a_load_on_a_spring_is_not_told_as_another_inertia_in_each_run(hz):
    """It is of another inertia at each frequency, and the runs are of different bands."""
    for seed in range(6):
        evidence, shown = seen(recorded(seed, (1.0,) * 4, hz), seed, frictions=True)
        assert different_inertias(evidence, shown) == different_loads(evidence, shown) == []


def test_the_sentence_names_runs_and_stands_in_place_of_scatter():
    seed, factors = 1, (1.0, 1.0, 1.5, 1.5, 1.0, 1.5)
    total = 10.0 ** np.random.default_rng(seed).uniform(-3.0, 0.0)
    nominal = datasheet({"jm": 1.2 * total}, "test")
    diagnosis = investigate(recorded(seed, factors), nominal, effects=FRICTIONS).diagnosis
    (note,) = [note for note in diagnosis.notes if "differs from run to run" in note]
    assert all(f"in run_{number}" in note for number in range(len(factors)))
    assert not any("scatters from run to run" in note for note in diagnosis.notes)
    assert diagnosis.bags is None or not diagnosis.bags.scatter_known


def test_of_many_runs_the_least_and_the_greatest_are_told():
    found = [RunValue(f"run_{k}", 1.0 + 0.1 * k, 0.001) for k in range(12)]
    note = inertias_differ(found, linear=True)
    assert "mass" in note and "kg," in note and "kg m2" not in note
    assert "1 in run_0, 2.1 in run_11" in note and "of 12 runs" in note
    assert "run_5" not in note


def test_the_sentence_on_loads_counts_from_the_least():
    found = [RunLoad(f"run_{k}", value, 0.1, 1.0) for k, value in enumerate((3.0, -1.0, 39.0))]
    note = loads_differ(found, linear=True)
    assert "beyond run_1 need run_0 4, run_2 40 N (" in note and "force" in note
