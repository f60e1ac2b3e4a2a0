"""A recorded torque that was held from sample to sample, and one that went on between them."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from driven_runs import NOMINAL, RATE, driven_runs
from hypothesis import given
from hypothesis import strategies as st

from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.record_torque import (
    CONTINUOUS,
    mean_over_samples,
    with_continuous_torque,
)
from gap_diagnosis.searching import _again
from gap_diagnosis.which.found import Found
from gap_diagnosis.which.torque_timing import Timing, timed

FINER = 10


@given(st.floats(0.0, 0.2), st.floats(0.0, 6.28))
def test_the_mean_of_a_sine_over_each_sample_is_that_of_the_sine(cycles, phase):
    k = np.arange(200)
    omega = 2.0 * np.pi * cycles
    sampled = np.cos(omega * k + phase)
    exact = np.real(np.exp(1j * (omega * (k + 0.5) + phase))) * np.sinc(cycles)
    assert np.abs(mean_over_samples(sampled) - exact)[5:-5].max() < 0.02


@pytest.mark.parametrize(("finer", "told"), [(1, ()), (FINER, (CONTINUOUS,))])
def test_a_torque_that_went_on_between_its_samples_is_told_from_one_that_was_held(finer, told):
    timing = timed(driven_runs(finer=finer), NOMINAL, 0.1, lambda _: None)
    assert timing.notes == told
    assert timing.refit.model.plant["jm"] == pytest.approx(NOMINAL["jm"], rel=0.05)
    assert timing.held == (not told)


def test_runs_keep_their_purposes_whatever_their_torque_is_taken_for():
    """Which runs fit goes by the peaks of their torques, which means over samples change.

    A run of another length in another place had errors of another number: a crash.
    """
    recorded = driven_runs(finer=FINER)
    first, second, *others = recorded.records
    peak = np.abs(first.torque).max()
    spiked = second.torque.copy()
    spiked[1000] = 1.01 * peak * np.sign(spiked[1000])
    short = [replace(r, torque=0.9 * r.torque, position=0.9 * r.position) for r in others]
    mixed = [cut(first, 3600), replace(second, torque=spiked), *short]
    records = replace(recorded, records=tuple(mixed))
    as_recorded = Evidence(records, NOMINAL)
    flowing = with_continuous_torque(records, as_recorded.simulator.loop)
    assert Evidence(flowing, NOMINAL).parts != as_recorded.parts
    timing = timed(records, NOMINAL, 0.1, lambda _: None)
    both = [timing, timing.other] if timing.other else [timing]
    assert all(one.fitter.evidence.parts == as_recorded.parts for one in both)
    assert not timing.held


def cut(record, samples):
    """Return a record's first samples."""
    return replace(record, torque=record.torque[:samples], position=record.position[:samples])


@pytest.mark.parametrize(
    ("late", "samples", "finer", "held"),
    [("actuator_lag.time_constant_s", 0.5, 1, True), ("delay.time_s", 0.3, FINER, False)],
)
def test_a_held_torque_behind_a_lag_is_no_signal_that_comes_late(late, samples, finer, held):
    """Means over samples lag too, so that a signal behind a delay does nearly as well."""
    recorded = driven_runs({late: samples / RATE}, finer=finer)
    by_hold = CellFitter(Evidence(recorded, NOMINAL), NOMINAL, 0.1)
    loop = by_hold.evidence.simulator.loop
    by_signal = by_hold.with_runs(with_continuous_torque(recorded, loop))
    refit = by_signal.refit()
    delayed = by_signal.add(refit, "delay", by_signal.screening(refit, "delay").proposals())
    assert delayed.model.effects["delay.time_s"] * RATE > samples
    timing = Timing(by_signal, refit, (CONTINUOUS,), False, Timing(by_hold, by_hold.refit()))
    other = timing.other if held else None
    assert timing.other_if_better(delayed, ["delay", "actuator_lag"]) is other


@pytest.mark.parametrize(("finer", "held"), [(1, True), (FINER, False)])
def test_half_a_sample_of_delay_of_a_signal_is_a_torque_that_was_held(finer, held):
    """What a search ends with that began with a signal, since a missing cause made it do better."""
    recorded = driven_runs(finer=finer)
    by_hold = CellFitter(Evidence(recorded, NOMINAL), NOMINAL, 0.1)
    flowing = with_continuous_torque(recorded, by_hold.evidence.simulator.loop)
    by_signal = CellFitter(Evidence(flowing, NOMINAL), NOMINAL, 0.1)
    refit = by_signal.refit()
    timing = Timing(by_signal, refit, (CONTINUOUS,), False, Timing(by_hold, by_hold.refit()))
    assert timing.other_if_better(refit, ["delay"]) is None
    proposals = by_signal.screening(refit, "delay").proposals()
    late = by_signal.add(refit, "delay", proposals) if proposals else None
    samples = late.model.effects["delay.time_s"] * RATE if late else 0.0
    assert samples == pytest.approx(0.5 if held else 0.0, abs=0.1)
    assert (timing.other_if_better(late or refit, ["delay"]) is timing.other) == held
    assert (timing.other_if_better(refit, ["coulomb_friction"]) is timing.other) == held


def test_what_was_found_counts_where_there_is_no_time_to_search_again():
    """A torque turned out to be held when the time was up; the causes found before are kept."""
    causes = {"torque_bias.torque_nm": 4.0}
    recorded = driven_runs(causes)
    by_hold = CellFitter(Evidence(recorded, NOMINAL), NOMINAL, 0.1)
    flowing = with_continuous_torque(recorded, by_hold.evidence.simulator.loop)
    by_signal = CellFitter(Evidence(flowing, NOMINAL), NOMINAL, 0.1)
    refit = by_signal.refit()
    proposals = by_signal.screening(refit, "torque_bias").proposals()
    before = Found([refit, by_signal.add(refit, "torque_bias", proposals)])
    names, ended = ["torque_bias", "delay"], time.monotonic()
    found = _again(Timing(by_hold, by_hold.refit()), before, names, lambda _: None, ended)
    assert found.best.effects == ("torque_bias",) and not found.complete
    assert found.best.model.effects["torque_bias.torque_nm"] == pytest.approx(4.0, rel=0.05)
    assert by_hold.misfit(found.best) < by_signal.misfit(before.best)
