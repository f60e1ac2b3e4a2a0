"""An axis that goes from place to place, whose datasheet is an inertia alone.

Friction yields before it slides, so that the loop leaves it elsewhere at each rest. Viscous
friction alone does most of it, far greater than it is, and Coulomb friction beside it makes the
error no smaller unless it yields.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from controller_node.transfer_function import TransferFunction
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.any_record import investigate
from gap_diagnosis.fits.cell_fits import STICKING, CellFitter
from gap_diagnosis.fits.gains import gain, likelihood
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.nominal import datasheet
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.starts.seen_torques import SeenTorques
from gap_diagnosis.which.extension import Extension

RATE, SECONDS, INERTIA = 500.0, 12.0, 2.0
AXIS = {"jm": INERTIA, "j": 0.0, "fs": 0.0, "fsm": 9.0, "fv": 0.0, "fvm": 6.0, "k0": math.inf,
        "k1": 0.0}  # fmt: skip
TRUTH = {
    "coulomb_friction.motor_nm": 9.0,
    "viscous_friction.motor_nm_s_rad": 6.0,
    "presliding_friction.motor_rad": 0.004,
    "torque_bias.torque_nm": 1.0,
}
NAMES = ("coulomb_friction", "viscous_friction", "presliding_friction", "torque_bias", "cable",
         "load_friction", "dead_band")  # fmt: skip
BARE = datasheet({"jm": 1.07 * INERTIA}, "axis")


def moves(rng: np.random.Generator) -> np.ndarray:
    """Return smooth ways from place to place with rests between, (samples,) in rad."""
    parts, place = [np.zeros(100)], 0.0
    while sum(map(len, parts)) < RATE * SECONDS:
        way = rng.uniform(-1.0, 1.0) - place
        t = np.linspace(0.0, 1.0, int(RATE * (0.25 + rng.uniform(0.5, 1.5) * abs(way))))
        parts += [place + way * t**2 * (3.0 - 2.0 * t), np.full(100, place + way)]
        place += way
    return np.concatenate(parts)[: int(RATE * SECONDS)]


@pytest.fixture(scope="module")
def runs() -> RecordSet:
    rng, made = np.random.default_rng(8), []
    law = TransferFunction.of([1600.0 + 110.0 * RATE, -110.0 * RATE], [1.0, 0.0])
    effects = {n: v for n, v in TRUTH.items() if n.startswith(("presliding", "torque_bias"))}
    for number in range(2):
        run = simulate_law(
            moves(rng), RATE, coefficients(AXIS), law, None, fx.coefficients(effects)
        )
        position = np.round(run.position / 2e-5) * 2e-5
        described = RecordDescription.of(
            "axis", sample_rate_hz=RATE, level=0, levels=1, realization=number, realizations=2
        )
        made.append(Record(f"run_{number}", described, None, run.torque, position, None))
    return RecordSet("axis", RATE, tuple(made))


@pytest.fixture(scope="module")
def fitter(runs) -> CellFitter:
    return CellFitter(Evidence(runs, BARE), Model.nominal(BARE).plant, 0.1)


def test_all_friction_and_what_else_is_there_are_named_with_their_sizes(runs):
    found = investigate(runs, BARE, effects=NAMES).diagnosis
    assert set(found.effects) == {name.split(".")[0] for name in TRUTH}
    for name, size in TRUTH.items():
        assert found.parameters[name].value == pytest.approx(size, rel=0.05)
    after = [step.added for step in found.steps if step.added in STICKING]
    assert after == list(STICKING)  # bristles do nothing before there is friction


def test_friction_and_inertia_are_solved_along_the_recorded_motion(fitter):
    refit = fitter.refit()
    seen = SeenTorques(fitter.evidence, fitter.fit_parts, refit.model)
    alone, kept = seen.friction("viscous_friction")
    assert (kept.effects, kept.plant) == (alone.effects, refit.model.plant)
    assert alone.effects["viscous_friction.motor_nm_s_rad"] > 1.3 * AXIS["fvm"]
    other = {**refit.model.effects, **alone.effects}
    seen = SeenTorques(fitter.evidence, fitter.fit_parts, Model(refit.model.plant, other))
    both = seen.friction("coulomb_friction")[1]
    assert both.effects["coulomb_friction.motor_nm"] == pytest.approx(AXIS["fsm"], rel=0.15)
    assert both.effects["viscous_friction.motor_nm_s_rad"] == pytest.approx(AXIS["fvm"], rel=0.2)
    assert both.plant["jm"] == pytest.approx(INERTIA, rel=0.05)


def test_friction_that_does_not_yield_is_no_better_beside_viscous_friction_and_one_that_does_is(
    fitter,
):
    refit = fitter.refit()
    proposals = fitter.screening(refit, "viscous_friction").proposals()
    viscous = fitter.to_its_end(fitter.add(refit, "viscous_friction", proposals))
    rigid = fitter.add(viscous, STICKING[0], fitter.screening(viscous, STICKING[0]).proposals())
    yielding = fitter.sticking(viscous)
    assert yielding.effects == ("viscous_friction", *STICKING)
    assert gain(fitter, yielding, viscous).present
    assert rigid is None or fitter.gains(yielding, rigid).sum() > 50.0
    assert rigid is None or likelihood(fitter, yielding, rigid) > 50.0


def test_bristles_are_looked_for_with_friction_only_where_there_is_none(fitter):
    refit, looked = fitter.refit(), []
    fitter.sticking = lambda parent: looked.append(parent.effects)
    try:
        extension = Extension(fitter, NAMES, lambda _: None)
        extension._sticking(refit, NAMES)
        without = [name for name in NAMES if name != STICKING[1]]
        Extension(fitter, without, lambda _: None)._sticking(refit, without)
        extension._sticking(refit, [name for name in NAMES if name != STICKING[0]])
    finally:
        del fitter.sticking
    assert looked == [()]
