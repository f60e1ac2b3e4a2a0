"""A pendulum behind a gear that loses a part of what it carries, made by an integrator of its own.

Rotor and pendulum are two inertias with the gear between them; the loss is a share of the torque
in the gear, whichever side drives. Its datasheet has friction that no load changes, and no weight.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from gap_diagnosis.any_record import investigate
from gap_diagnosis.investigation import Investigation

RATE, SECONDS, SUBSTEPS = 250, 16, 16
ROTOR, PENDULUM, WEIGHT = 0.004, 0.006, 0.9
COULOMB, VISCOUS, LOST = 0.05, 0.03, 0.3
EFFECTS = ["gravity", "load_friction", "position_friction", "torque_saturation", "cogging",
           "stribeck_friction_motor"]  # fmt: skip
NOMINAL = {
    "jm": ROTOR,
    "j": PENDULUM,
    "fs": 0.0,
    "fsm": 0.06,
    "fv": 0.0,
    "fvm": 0.028,
    "k0": math.inf,
    "k1": 0.0,
}  # fmt: skip


def moves(seed: int, height: float) -> np.ndarray:
    """Return a reference that goes from one angle to another by cosines, with rests between."""
    rng, angles = np.random.default_rng(seed), [0.0]
    while len(angles) < RATE * SECONDS:
        goal, way = rng.uniform(-height, height), int(RATE * rng.uniform(0.4, 1.0))
        blend = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, way + 1) / way)
        angles += [*(angles[-1] + (goal - angles[-1]) * blend), *[goal] * (RATE // 5)]
    return np.array(angles[: RATE * SECONDS])


def played(reference: np.ndarray, gain: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angle (rad) and torque (N m) of a proportional servo with damping."""
    h, th, w, before = 1.0 / (RATE * SUBSTEPS), 0.0, 0.0, 0.0
    share = PENDULUM / (ROTOR + PENDULUM)
    out = np.empty((2, reference.size))
    for k, goal in enumerate(reference.tolist()):
        u = gain * (goal - th) - 0.15 * (th - before) * RATE
        out[:, k], before = (th, u), th
        for _ in range(SUBSTEPS):
            held = WEIGHT * math.sin(th)
            net = u - held - VISCOUS * w
            if w == 0.0 and abs(net) <= COULOMB + LOST * abs(held):
                continue
            way = math.copysign(1.0, w if w != 0.0 else net)
            # in the gear: share (u - friction) + (1 - share) held, of which the loss is a part
            carried = share * (u - VISCOUS * w - COULOMB * way) + (1.0 - share) * held
            carried /= 1.0 + share * LOST * way * math.copysign(1.0, carried)
            after = w + h * (net - (COULOMB + LOST * abs(carried)) * way) / (ROTOR + PENDULUM)
            w = 0.0 if w * after < 0.0 else after
            th += h * w
    return out[0], out[1]


@pytest.fixture(scope="module")
def found() -> Investigation:
    records = []
    for number, (height, gain) in enumerate([(0.7, 8.0), (0.7, 16.0), (1.4, 8.0), (1.4, 16.0)]):
        reference = moves(number, height)
        y, u = played(reference, gain)
        described = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=number // 2, levels=2, realization=number % 2,
            realizations=2,
        )  # fmt: skip
        y += 1e-5 * np.random.default_rng(number).standard_normal(y.size)
        records.append(Record(f"run_{number}", described, reference, u, y, None))
    return investigate(RecordSet("test", RATE, tuple(records)), NOMINAL, effects=EFFECTS)


def test_the_weight_and_the_loss_in_the_gear_are_named_with_their_sizes(found):
    diagnosis = found.diagnosis
    assert sorted(diagnosis.effects) == ["gravity", "load_friction"]
    sizes = diagnosis.parameters
    assert sizes["gravity.torque_nm"].value == pytest.approx(WEIGHT, rel=0.05)
    assert sizes["load_friction.coefficient"].value == pytest.approx(LOST, rel=0.15)
    assert sizes["fsm"].value == pytest.approx(COULOMB, rel=0.1)


def test_without_the_loss_most_of_what_the_weight_leaves_stays(found):
    refit, weight, both = (step.nrmse_position for step in found.diagnosis.steps[-3:])
    assert both < 0.3 * weight < weight < refit
