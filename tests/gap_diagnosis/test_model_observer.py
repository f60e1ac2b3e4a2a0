"""The observer that holds a model to a recorded motion, on rigs of any kind."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fjr_sim_node import plant
from fjr_sim_node.simulation.closed_loop import simulate_law
from gap_diagnosis.model.prediction import model_observer


@given(
    jm=st.floats(-4.0, 3.0).map(lambda x: 10.0**x),
    ratio=st.floats(0.2, 5.0),
    resonance=st.one_of(st.just(math.inf), st.floats(0.005, 0.08)),
    share=st.floats(0.005, 0.05),
    changed=st.tuples(*(st.floats(0.8, 1.25),) * 3),
)
def test_a_model_without_friction_stays_with_the_motion_whatever_the_rig(
    jm, ratio, resonance, share, changed
):
    rate, j = 1000.0, ratio * jm
    omega = 2.0 * math.pi * resonance * rate
    k0 = omega**2 / (1.0 / jm + 1.0 / j)
    values = dict.fromkeys(plant.PLANT.names, 0.0) | {"jm": jm, "j": j, "k0": k0}
    crossover, law = model_observer(values, share * rate, rate)
    assert crossover <= 0.05 * rate * (1 + 1e-9)
    for name, factor in zip(("jm", "j", "k0"), changed, strict=True):
        values[name] *= factor
    time = np.arange(8000) / rate
    motion = np.sin(2.0 * math.pi * 0.1 * crossover * time)
    run = simulate_law(motion, rate, plant.coefficients(values), law)
    assert np.abs(run.position - motion).max() < 1.0  # held: errors of the order of the motion


def test_a_crossover_that_the_model_allows_is_taken_as_it_is():
    assert model_observer(plant.PLANT.defaults(), 5.0, 1000.0)[0] == pytest.approx(5.0)
