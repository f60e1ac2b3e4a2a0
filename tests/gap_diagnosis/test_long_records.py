"""A record too long to be played whole, whose friction falls: all of it counts, and the fall shows.

Of random rigid axes, which a loop takes from place to place for a quarter of an hour.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.record_noise import record_noise
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.any_record import investigate
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.record_length import within
from gap_diagnosis.model.record_rig import RecordSimulator
from gap_diagnosis.model.rig_model import Model

RATE, SECONDS = 100.0, 900.0
FALLS = 0.35
NAMES = ("coulomb_friction", "viscous_friction")


def moves(rng: np.random.Generator) -> np.ndarray:
    """Return smooth ways from place to place with rests between, (samples,) in rad."""
    parts, place = [np.zeros(50)], 0.0
    while sum(map(len, parts)) < RATE * SECONDS:
        way = rng.choice([-1.2, -0.7, 0.0, 0.5, 1.0]) - place
        t = np.linspace(0.0, 1.0, int(RATE * (0.3 + rng.uniform(0.3, 0.8) * abs(way))))
        parts += [place + way * t**2 * (3.0 - 2.0 * t), np.full(rng.integers(10, 40), place + way)]
        place += way
    return np.concatenate(parts)[: int(RATE * SECONDS)]


def long_record(
    seed: int, known: bool, falls: float = FALLS
) -> tuple[RecordSet, dict[str, float], float]:
    """Return a record, the friction at its beginning, and a datasheet's inertia."""
    rng = np.random.default_rng(seed)
    inertia = float(np.exp(rng.uniform(-2.0, 2.0)))
    axis = {"jm": inertia, "j": 0.0, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0}
    axis |= {"fsm": inertia * rng.uniform(3.0, 12.0), "fvm": inertia * rng.uniform(1.0, 6.0)}
    law = pd_filtered.CONTROLLER.check(
        {"p": 200.0 * inertia, "d": 15.0 * inertia, "n": 100.0, "sample_rate_hz": RATE}
    )
    reference = moves(rng)
    run = simulate(
        reference, RATE, coefficients(axis), pd_filtered.coefficients(law),
        1e-5 * rng.standard_normal(reference.size),
        fx.coefficients({"nonstationary.friction_per_s": -falls / SECONDS}),
    )  # fmt: skip
    described = RecordDescription.of(
        "axis", sample_rate_hz=RATE, controller=pd_filtered.describe(law) if known else None
    )
    record = Record("run", described, reference if known else None, run.torque, run.position, None)
    sheet = inertia * float(np.exp(rng.uniform(-0.1, 0.1)))
    return RecordSet("axis", RATE, (record,)), axis, sheet


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("seed", range(2))
def test_friction_that_falls_is_found_at_its_mean_and_the_fall_is_told(seed, known):
    records, axis, sheet = long_record(seed, known)
    found = investigate(records, datasheet({"jm": sheet}, "axis"), effects=NAMES).diagnosis
    assert set(found.effects) == set(NAMES)
    sizes = {name: size for cause in found.causes for name, size in cause.parameters.items()}
    for name, at_first in (
        ("coulomb_friction.motor_nm", axis["fsm"]),
        ("viscous_friction.motor_nm_s_rad", axis["fvm"]),
    ):
        mean = (1.0 - 0.5 * FALLS) * at_first
        assert sizes[name].low < mean < sizes[name].high
        assert sizes[name].value == pytest.approx(mean, rel=0.1)
    assert found.bags is not None
    trend = found.bags.trends["friction"]
    assert trend.change_percent == pytest.approx(-100.0 * FALLS, abs=12.0)
    assert any("friction follows a trend" in note for note in found.notes)
    assert any("6 stretches of run of 50 s" in note for note in found.notes)


@pytest.mark.parametrize("seed", range(3))
def test_stretches_of_a_known_loop_go_on_as_the_run_did(seed):
    records, axis, _ = long_record(seed, known=True, falls=0.0)
    left, _ = within(records)
    truth = Model.nominal(axis)
    player = RecordSimulator(left, record_noise(left), 20.0, axis)
    assert player.loop.kind == "known" and len(left.records) == 6
    for (signals,), run in zip(
        (player.run([truth], [k])[0] for k in range(6)), left.records, strict=True
    ):
        assert np.std(signals[0] - run.position) < 2e-3 * np.std(run.position)


def test_the_law_of_a_stretch_that_stands_at_zero_has_a_state():
    records, axis, _ = long_record(0, known=True)
    (run,) = records.records
    still = replace(run, position=np.where(np.arange(run.samples) < 20, 0.0, run.position))
    noise = record_noise(records)
    for after_s, enters in ((0.0, False), (30.0, True)):
        part = replace(records, records=(replace(still, after_s=after_s),))
        player = RecordSimulator(part, noise, 20.0, axis)
        assert (player.drive(0).entry is not None) == enters
