"""Truth checks of the BLA from any excitation, on emulated rigs.

`benchmarks/any_excitation.py` measures the same on more rigs. Lines of one record share their noise
with their neighbours, so counts of lines overstate what the coverage is known to: bounds are wide.
"""

from __future__ import annotations

import numpy as np
import pytest
import rig_records as rigs

from bla_analyzer.bla.arbitrary import arbitrary_bla, run_of
from bla_analyzer.bla.local_fit import fit_window
from bla_analyzer.bla.windows import ORDER
from fjr_kit.errors import InputError


def estimates(kind, count, *, linear, noise, seconds=30.0, seed=0):
    """Yield (estimate, rig) of one record each."""
    for number in range(count):
        rig = rigs.random_rig(seed + number, linear=linear)
        record = rigs.record(rig, kind, seconds, noise=noise, seed=1000 + number)
        yield arbitrary_bla([run_of([record], rigs.RATE)], rigs.RATE), rig


@pytest.mark.parametrize("kind", ["noise", "chirp", "multisine"])
def test_discs_of_one_record_cover_the_truth_of_a_linear_rig(kind):
    """8 records of some 150 lines each; truth is the sampled plant itself."""
    held, lines = [], 0
    for found, rig in estimates(kind, 8, linear=True, noise=0.01):
        bla = found.bla
        near = np.abs(bla.g - rigs.truth(rig, bla.frequency_hz)) <= bla.radius_95
        held.append(near[bla.reliable])
        lines += bla.reliable.sum()
    assert lines > 500
    assert 0.92 < np.concatenate(held).mean() < 0.99


def test_noise_and_multisine_of_one_spectrum_give_one_bla_under_friction():
    """The truth is the pooled response of 40 multisines; its own error is a sixth of a disc."""
    rig = rigs.random_rig(3, linear=False)
    many = [
        run_of([rigs.record(rig, "multisine", 30.0, noise=0.0, seed=m)], rigs.RATE)
        for m in range(40)
    ]
    for kind in ("noise", "multisine"):
        held = []
        for seed in range(500, 504):
            record = rigs.record(rig, kind, 30.0, noise=1e-3, seed=seed)
            bla = arbitrary_bla([run_of([record], rigs.RATE)], rigs.RATE).bla
            keep = np.flatnonzero(bla.reliable)[::4]
            half = np.maximum(0.3, 0.02 * bla.frequency_hz)
            windows = np.stack([bla.frequency_hz - half, bla.frequency_hz + half], axis=1)
            truth = np.array(
                [fit_window(many, bla.frequency_hz[i], tuple(windows[i]), ORDER).g for i in keep]
            )
            held.append(np.abs(bla.g[keep] - truth) <= bla.radius_95[keep])
        assert 0.85 < np.concatenate(held).mean() <= 1.0


def test_noise_in_the_loop_causes_no_bias_and_without_the_reference_is_left_out_for_it():
    rig = rigs.random_rig(1, linear=True)
    records = [rigs.record(rig, "noise", 30.0, noise=1.0, seed=m) for m in range(12)]
    with_reference = arbitrary_bla([run_of([r], rigs.RATE) for r in records], rigs.RATE).bla
    without = [np.stack([r[1][1:], r[1][1:], np.diff(r[2])]) for r in records]
    runs = [run_of([r], rigs.RATE) for r in without]
    at_hz = with_reference.frequency_hz
    at_hz = at_hz[(at_hz > 15.0) & (at_hz < 25.0)]
    direct = arbitrary_bla(runs, rigs.RATE, slope=True, at_hz=at_hz).bla
    chosen = arbitrary_bla(runs, rigs.RATE, slope=True).bla.frequency_hz
    assert not ((chosen > 15.0) & (chosen < 25.0)).any()
    held = []
    for bla in (with_reference, direct):
        band = (bla.frequency_hz > 15.0) & (bla.frequency_hz < 25.0)
        exact = rigs.truth(rig, bla.frequency_hz[band])
        held.append(np.mean(np.abs(bla.g[band] - exact) <= bla.radius_95[band]))
    assert held[0] > 0.85
    assert held[1] < 0.7


def test_repeats_split_noise_from_distortion():
    """Noise as strong as stated; with a linear rig all is noise, with friction most is not."""
    shares = []
    for linear in (True, False):
        rig = rigs.random_rig(2, linear=linear)
        repeats = [
            rigs.record(rig, "noise", 30.0, noise=2e-3, seed=7, noise_seed=m) for m in range(4)
        ]
        bla = arbitrary_bla([run_of(repeats, rigs.RATE)], rigs.RATE).bla
        assert (bla.periods, bla.realizations) == (4, 1)
        shares.append(np.median(bla.var_noise / bla.var_total))
        significant = np.mean(bla.nonlinear_p_value < 0.01)
        assert significant < 0.1 if linear else significant > 0.5
    assert shares[0] == pytest.approx(1.0, abs=0.2)
    assert shares[1] < 0.5


def test_more_runs_narrow_the_discs():
    rig = rigs.random_rig(4, linear=True)
    runs = [
        run_of([rigs.record(rig, "noise", 20.0, noise=0.01, seed=m)], rigs.RATE) for m in range(4)
    ]
    widths = [
        np.median(bla.radius_95 / np.abs(bla.g))
        for bla in (arbitrary_bla(runs[:1], rigs.RATE).bla, arbitrary_bla(runs, rigs.RATE).bla)
    ]
    assert widths[1] < 0.9 * widths[0]


def test_a_trapezoid_gives_the_lines_that_it_excites():
    rig = rigs.random_rig(5, linear=True)
    record = rigs.record(rig, "trapezoid", 40.0, noise=0.02, seed=3)
    found = arbitrary_bla([run_of([record], rigs.RATE)], rigs.RATE)
    bla = found.bla
    assert found.left_out_hz.size > bla.frequency_hz.size
    assert np.median(bla.frequency_hz) < np.median(found.left_out_hz)
    near = np.abs(bla.g - rigs.truth(rig, bla.frequency_hz)) <= bla.radius_95
    assert near[bla.reliable].mean() > 0.85


def test_a_reference_of_another_run_gives_nothing_or_nothing_reliable():
    rig = rigs.random_rig(6, linear=True)
    record = rigs.record(rig, "noise", 30.0, noise=0.01, seed=1)
    other = np.random.default_rng(9).standard_normal(record.shape[1])
    try:
        found = arbitrary_bla([run_of([np.stack([other, *record[1:]])], rigs.RATE)], rigs.RATE)
    except InputError as error:
        assert "does the torque follow the reference beyond noise" in str(error)
    else:
        assert found.left_out_hz.size > 5 * found.bla.reliable.sum()


def test_a_short_record_is_refused_with_the_reason():
    with pytest.raises(InputError, match="too short"):
        arbitrary_bla([run_of([np.random.default_rng(0).standard_normal((3, 20))], 100.0)], 100.0)


@pytest.mark.parametrize(("slope", "said"), [(True, "follow the torque"), (False, "reference of")])
def test_what_moves_nothing_is_told_by_what_was_recorded(slope, said):
    runs = [run_of([np.random.default_rng(0).standard_normal((3, 4000))], 100.0)]
    with pytest.raises(InputError, match=said):
        arbitrary_bla(runs, 100.0, slope=slope, moves=lambda at: np.zeros(at.shape, bool))
