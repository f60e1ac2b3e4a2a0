"""A stiff loop that moves far and slowly: what its torque shows, the motion hardly does."""

from __future__ import annotations

import io
import math
from functools import cache

import numpy as np
import pytest
from rich.console import Console

from controller_node import pd_filtered
from fjr_cli.diagnosis_summary import print_summary
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.investigation import Investigation
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.report.gap_output import write_diagnosis

RATE, NOISE = 500.0, 2e-6
MASS, COULOMB, VISCOUS = 95.0, 20.0, 200.0
CARRIAGE = {
    "jm": MASS, "j": 0.0, "fs": 0.0, "fsm": COULOMB, "fv": 0.0, "fvm": VISCOUS, "k0": math.inf,
    "k1": 0.0,
}  # fmt: skip
BARE = {**CARRIAGE, "fsm": 0.0, "fvm": 0.0}
LOOKED_FOR = (
    "coulomb_friction", "viscous_friction", "quadratic_friction", "delay", "torque_bias",
)  # fmt: skip
CROSSOVER = 2.0 * math.pi * 12.0
LAW = pd_filtered.CONTROLLER.check(
    {"sample_rate_hz": RATE, "p": 0.5 * MASS * CROSSOVER**2, "d": MASS * CROSSOVER, "n": 200.0}
)


def moves() -> np.ndarray:
    """Return smooth moves of up to a quarter of a metre with rests between them, 16 s."""
    ends = [(0.5, 0.24, 2.0), (3.5, 0.05, 1.4), (6.0, 0.2, 1.0), (8.0, 0.0, 1.6),
            (10.5, 0.24, 1.2), (12.5, 0.1, 0.8), (14.0, 0.22, 0.9)]  # fmt: skip
    time, at = np.arange(int(16.0 * RATE)) / RATE, 0.0
    reference = np.zeros(time.size)
    for begin, end, seconds in ends:
        x = np.clip((time - begin) / seconds, 0.0, 1.0)
        reference += (end - at) * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        at = end
    return reference


@cache
def carriage() -> RecordSet:
    """Return two runs of a carriage whose controller nobody knows."""
    rng, made = np.random.default_rng(3), []
    for run in range(2):
        signals = simulate(
            moves(),
            RATE,
            coefficients(CARRIAGE),
            pd_filtered.coefficients(LAW),
            NOISE * rng.standard_normal(int(16.0 * RATE)),
        )
        description = RecordDescription.of(
            "test", sample_rate_hz=RATE, realization=run, realizations=2, axis="linear"
        )
        made.append(Record(f"run_{run}", description, None, signals.torque, signals.position, None))
    return RecordSet("test", RATE, tuple(made))


def test_the_simulation_errs_by_a_share_of_the_torque_not_of_a_motion_that_is_held():
    evidence = Evidence(carriage(), BARE)
    parts = evidence.parts_for("fit")
    floor = np.sqrt(evidence.floor(parts))
    motion = np.sqrt(evidence.mean_squares(evidence.measured(parts), parts))
    assert floor[0] < 1e-4 * motion[0]  # slow: held
    assert np.all(floor <= 1.01 * np.hypot(1e-3 * motion, evidence.noise.std_rad))


@cache
def named() -> Investigation:
    """Return what a diagnosis of the carriage finds."""
    return investigate(carriage(), BARE, effects=LOOKED_FOR)


def test_a_diagnosis_of_a_linear_axis_says_its_units_in_every_file(tmp_path):
    found = named()
    assert found.diagnosis.linear
    write_diagnosis(found, tmp_path)
    randomised, updated, report = (
        (tmp_path / name).read_text(encoding="utf-8")
        for name in ("randomisation.yaml", "updated.yaml", "report.html")
    )
    for text in (randomised, updated, report):
        assert "N m" not in text and "kg m2" not in text
    for unit in ("kg", "N", "N s/m"):
        assert f"}}  # {unit}\n" in randomised and f"[{unit}]; range" in updated
    assert "fjr export takes this file with --linear" in updated
    shown = report.split('id="plots"')[0]
    assert "N s/m" in shown and "y (m)" in report and " rad" not in updated.replace("in rad", "")
    console = Console(file=io.StringIO(), width=100)
    print_summary(found.diagnosis, console, tmp_path, runs=False)
    told = console.file.getvalue()
    assert "N s/m" in told and "N m" not in told and "fjr export --linear" in told


def test_friction_of_a_carriage_is_named_though_its_loop_is_not_known():
    diagnosis = named().diagnosis
    assert {cause.effect for cause in diagnosis.causes} == {"coulomb_friction", "viscous_friction"}
    found = diagnosis.parameters
    assert found["coulomb_friction.motor_nm"].value == pytest.approx(COULOMB, rel=0.1)
    assert found["viscous_friction.motor_nm_s_rad"].value == pytest.approx(VISCOUS, rel=0.1)
