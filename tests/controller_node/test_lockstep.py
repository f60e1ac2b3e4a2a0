"""The controller in lockstep: whichever of a position and its reference comes first."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller_node import pd_filtered
from controller_node.limits import SAFETY
from controller_node.lockstep import LockstepController
from controller_node.supervised_law import SupervisedLaw
from fjr_interface.parameters import ParameterGroup
from fjr_interface.topics import SIGNAL_DEPTH
from fjr_kit.errors import InputError

VALUES = ParameterGroup(*pd_filtered.CONTROLLER, *SAFETY).check({})
MS = 1_000_000


def controller(*, ready: bool = True) -> LockstepController:
    made = LockstepController(SupervisedLaw(VALUES, real_time=False), VALUES)
    made.begin_run(VALUES)
    if ready:
        made.go_on()
    return made


def bare_torques(samples: list[tuple[float, float]]) -> list[float]:
    x, torques = 0.0, []
    for r, y in samples:
        x, torque = pd_filtered.step(x, r - y, pd_filtered.coefficients(VALUES))
        torques.append(torque)
    return torques


@given(
    st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), min_size=1, max_size=60),
    st.data(),
)
def test_references_may_come_before_or_after_their_positions(samples, data):
    """As on the graph: a position follows the torque before it, references run ahead or not."""
    run, answers, referred = controller(), [], 0
    for k, (_, y) in enumerate(samples, 1):
        ahead = data.draw(st.integers(0, 5))
        first = data.draw(st.booleans())
        if first:
            assert run.position(k * MS, y) and run.waiting_ns == k * MS
        for _ in range(max(k + ahead - referred, 0)):
            referred += 1
            if referred <= len(samples):
                run.reference(referred * MS, samples[referred - 1][0])
        if not first:
            assert run.position(k * MS, y)
        answers.append(run.answer())
        assert run.answer() is None and run.waiting_ns is None
    assert answers == [(k * MS, u) for k, u in enumerate(bare_torques(samples), 1)]


def test_no_torque_answers_before_the_readers_are_there():
    run = controller(ready=False)
    run.reference(MS, 0.01)
    assert run.position(MS, 0.0) and run.answer() is None
    run.go_on()
    assert run.answer() == (MS, bare_torques([(0.01, 0.0)])[0])


def test_a_stamp_that_is_not_the_next_one_is_refused():
    run = controller()
    run.position(MS, 0.0)
    with pytest.raises(InputError, match=r"0\.003000 s where 0\.002000 s was due"):
        run.position(3 * MS, 0.0)


def test_positions_of_a_run_that_new_references_replace_are_passed_over():
    run = controller()
    for k in (1, 2):
        run.reference(k * MS, 0.01)
        run.position(k * MS, 0.0)
        run.answer()
    assert run.leave_run()
    run.reference(MS, 0.02)
    assert not run.position(3 * MS, 0.0) and run.answer() is None
    assert run.is_first(MS)
    run.begin_run(VALUES)
    run.go_on()
    assert run.position(MS, 0.0) and run.answer() == (MS, bare_torques([(0.02, 0.0)])[0])


def test_a_first_position_that_overtook_its_reference_stays():
    run = controller()
    run.position(MS, 0.0)
    assert not run.leave_run() and run.waiting_ns == MS
    run.reference(MS, 0.02)
    assert run.answer() == (MS, bare_torques([(0.02, 0.0)])[0])


def test_references_that_were_used_do_not_gather():
    run = controller()
    for k in range(1, 3 * SIGNAL_DEPTH):
        run.reference(k * MS, 0.0)
        run.position(k * MS, 0.0)
        run.answer()
    assert len(run._references) == SIGNAL_DEPTH
