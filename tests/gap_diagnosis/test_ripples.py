"""Ripples of records: what they do is predicted by averages, and the right number is proposed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d
from test_evidence import NOMINAL, RATE, records

from controller_node import pd_filtered
from fjr_interface.experiment import RecordDescription
from fjr_records.records import Record, RecordSet
from fjr_sim_node import effects as fx
from fjr_sim_node.plant import coefficients
from fjr_sim_node.simulation.closed_loop import simulate
from gap_diagnosis.fits.cell_fits import CellFitter
from gap_diagnosis.fits.comparison import CellFit
from gap_diagnosis.model import small_changes
from gap_diagnosis.model.evidence import Evidence
from gap_diagnosis.model.rig_model import Model
from gap_diagnosis.model.small_changes import averaged_over, changes
from gap_diagnosis.starts.over_angle import transformed
from gap_diagnosis.which.stepwise import Stepwise

CASES = {
    "position_friction": ({"amplitude_nm": 1.5, "cycles_per_turn": 30.0, "phase_rad": 0.7}, 2.0),
    "kinematic_error": ({"amplitude_rad": 1e-3, "cycles_per_turn": 33.0, "phase_rad": 0.7}, 4.0),
    "cogging": ({"amplitude_nm": 1.5, "cycles_per_turn": 57.0, "phase_rad": 0.7}, 1.5),
    "torque_constant_ripple": (
        {"amplitude": 0.08, "cycles_per_turn": 31.0, "phase_rad": 0.7}, 1.5,
    ),
}  # fmt: skip
"""Truth, and how near a proposed number of cycles comes to it."""


def of_case(effect: str) -> CellFitter:
    """Return what fits records of a rig with one effect of `CASES`."""
    named = {f"{effect}.{name}": value for name, value in CASES[effect][0].items()}
    return CellFitter(Evidence(records(named, runs=2), NOMINAL), NOMINAL, 0.1)


def proposed_by(fitter: CellFitter, refit: CellFit, effect: str, most: int) -> list[float]:
    """Return the numbers of cycles that are proposed beside a refit."""
    seeds = fitter._ripples(refit)[0].seeds(effect, fitter.scales.cycles(), most)
    return [seed[f"{effect}.cycles_per_turn"] for seed in seeds]


@pytest.mark.parametrize("effect", CASES)
def test_ripples_are_proposed_near_enough_for_the_fit_to_find_them(effect):
    truth, off = CASES[effect]
    fitter = of_case(effect)
    refit = fitter.refit()
    proposed = proposed_by(fitter, refit, effect, 4)
    assert min(abs(np.array(proposed) - truth["cycles_per_turn"])) <= off
    fit = fitter.add(refit, effect, fitter.screening(refit, effect).proposals())
    found = fit.model.effects[f"{effect}.cycles_per_turn"]
    assert found == pytest.approx(truth["cycles_per_turn"], rel=0.01)


@pytest.mark.parametrize("effect", CASES)
def test_a_ripple_begins_near_its_size_and_phase(effect):
    truth, _ = CASES[effect]
    fitter = of_case(effect)
    numbers = np.array([truth["cycles_per_turn"]])
    (seed,) = fitter._ripples(fitter.refit())[0].seeds(effect, numbers, 1)
    size, _, phase = (seed[name] for name in fx.EFFECTS[effect].names[:3])
    assert 0.4 < size / next(iter(truth.values())) < 1.5
    assert math.remainder(phase - truth["phase_rad"], 2.0 * math.pi) == pytest.approx(0.0, abs=0.6)


def turned(
    speed: float, cogging: float, cycles: float, seed: int, *, one_way: bool = False
) -> Record:
    """Return a motor that turns both ways against cogging (N m); its loop is not told."""
    rng, rows, angle, own, sum_ = np.random.default_rng(seed), [], 0.0, speed, 0.0
    for number in range(4000):
        error = (speed if one_way or number % 2000 < 1000 else -speed) - own
        sum_ += error / 500.0
        torque = 1e-3 + 4e-4 * error + 8e-3 * sum_
        rows.append((angle + 1e-5 * rng.standard_normal(), torque))
        for _ in range(8):
            against = 1e-3 * math.copysign(1.0, own) - cogging * math.sin(cycles * angle + 0.7)
            own += (torque - against) / 2e-5 / 4000.0
            angle += own / 4000.0
    position, torques = np.array(rows).T
    description = RecordDescription.of("test", sample_rate_hz=500.0, realization=seed, levels=1)
    return Record(f"run_{seed}", description, None, torques, position, None)


def turning(*, one_way: bool) -> CellFitter:
    """Return what fits two records of a motor that turns against 42 ripples of 6 mN m."""
    speeds = enumerate((9.0, 11.0))
    runs = tuple(turned(speed, 6e-3, 42.0, seed, one_way=one_way) for seed, speed in speeds)
    rigid = {"j": 0.0, "fs": 0.0, "fv": 0.0, "k0": math.inf, "k1": 0.0}
    nominal = {"jm": 2e-5, "fsm": 1e-3, "fvm": 0.0, **rigid}
    evidence = Evidence(RecordSet("test", 500.0, runs), nominal)
    return CellFitter(evidence, Model.nominal(nominal).plant, 0.1)


def test_a_ripple_as_strong_as_the_motor_begins_with_its_size():
    """Small ripples that are scaled up end far short of it."""
    fitter = turning(one_way=False)
    refit = fitter.refit()
    _, space, point = fitter.screening(refit, "cogging").proposals()[0]
    begins = space.model(point).effects
    assert begins["cogging.cycles_per_turn"] == pytest.approx(42.0, abs=0.05)
    assert begins["cogging.amplitude_nm"] == pytest.approx(6e-3, rel=0.4)


def test_a_ripple_that_the_slow_lines_speak_against_is_proposed():
    """Of many turns one way, a number that is off by a thousandth drifts, which slow lines show."""
    fitter = turning(one_way=True)
    ripples = fitter._ripples(fitter.refit())[0]
    gains = ripples._gains("cogging", (42.01,)).falls
    assert gains[0] < 0.3 * gains.max()
    seeds = ripples.seeds("cogging", fitter.scales.cycles(), 3)
    numbers = [seed["cogging.cycles_per_turn"] for seed in seeds]
    assert min(np.abs(np.array(numbers) - 42.0)) < 0.003


def test_a_ripple_of_two_harmonics_is_found_as_one_cause():
    """Taken for one harmonic its number of cycles is off, and the rest looks like another cause."""
    truth = {
        "cogging.amplitude_nm": 1.5,
        "cogging.cycles_per_turn": 40.0,
        "cogging.phase_rad": 0.7,
        "cogging.second_ratio": 0.5,
        "cogging.second_phase_rad": -1.0,
    }
    fitter = CellFitter(Evidence(records(truth, runs=2), NOMINAL), NOMINAL, 0.1)
    refit = fitter.refit()
    found = Stepwise(fitter, ["cogging", "torque_bias", "asymmetric_friction"]).run(refit)
    assert found.best.effects == ("cogging",)
    for name, value in truth.items():
        assert found.best.model.effects[name] == pytest.approx(value, rel=0.05)
    assert fitter.misfit(found.best) < 1.3


def test_a_ripple_of_one_harmonic_gets_no_second():
    truth = {f"cogging.{name}": value for name, value in CASES["cogging"][0].items()}
    fitter = CellFitter(Evidence(records(truth, runs=2), NOMINAL), NOMINAL, 0.1)
    found = Stepwise(fitter, ["cogging", "torque_bias"]).run(fitter.refit())
    assert found.best.effects == ("cogging",)
    assert "cogging.second_ratio" not in found.best.model.effects


def test_a_ripple_finer_than_the_motion_is_long_is_proposed_wherever_it_lies():
    """A gear's ratio, counted at its joint: more numbers are possible than can be calculated."""
    truth = {
        "cogging.amplitude_nm": 4.0,
        "cogging.cycles_per_turn": 131.0,
        "cogging.phase_rad": 0.7,
    }
    slow = records(truth, seconds=16.0, rms_rad=(1.5, 3.0), band_hz=(0.05, 0.3))
    fitter = CellFitter(Evidence(slow, NOMINAL), NOMINAL, 0.1)
    tried = fitter.scales.cycles()
    assert len(tried) > 400
    proposed = proposed_by(fitter, fitter.refit(), "cogging", 4)
    assert min(abs(np.array(proposed) - 131.0)) < 0.1


@pytest.mark.parametrize("effect", CASES)
def test_what_pulls_at_a_ripple_tells_what_it_gains(effect):
    truth, _ = CASES[effect]
    named = {f"{effect}.{name}": value for name, value in truth.items()}
    fitter = CellFitter(Evidence(records(named, runs=2), NOMINAL), NOMINAL, 0.1)
    ripples = fitter._ripples(fitter.refit())[0]
    tried = np.linspace(20.0, 80.0, 31)
    gains = np.array([ripples._gains(effect, (c,)).falls[0] for c in tried])
    pulls = ripples._pulled(effect, tried)
    met = np.interp(tried, tried[::5], (pulls / gains)[::5])
    assert pulls / met == pytest.approx(gains, rel=0.1)


@pytest.mark.parametrize("every", [1, 2])
def test_pulls_are_transposed_changes(every):
    evidence = Evidence(records(seconds=32.0), NOMINAL)
    evidence.lines = evidence.hop // (4 * every)
    parts = evidence.parts_for("fit")
    rng = np.random.default_rng(every)
    moved = {
        index: rng.standard_normal(record.samples // every)
        for index, record in enumerate(evidence.records.records)
    }
    lines = changes(evidence, moved, parts, every)
    errors = rng.standard_normal(lines.size)
    found = small_changes.pulls(evidence, errors, parts, every)
    assert sum(own @ moved[index] for index, own in found.items()) == pytest.approx(errors @ lines)


@pytest.mark.parametrize("every", [2, 4])
def test_averaged_changes_have_the_lines_of_the_changes(every):
    evidence = Evidence(records(seconds=32.0), NOMINAL)
    evidence.lines = evidence.hop // (4 * every)
    assert averaged_over(evidence.hop, evidence.lines) == every
    highest = RATE / (8 * every)
    samples = evidence.records.records[0].samples
    rng = np.random.default_rng(every)
    spectrum = np.fft.rfft(rng.standard_normal(samples))
    spectrum[np.fft.rfftfreq(samples, 1.0 / RATE) > highest] = 0.0
    change = np.fft.irfft(spectrum, samples)
    parts = [i for i, part in enumerate(evidence.parts) if part.record == 0]
    full = changes(evidence, {0: change}, parts)
    blocks = change[: samples // every * every].reshape(-1, every).mean(axis=1)
    averaged = changes(evidence, {0: blocks}, parts, every)
    assert np.abs(averaged - full).max() < 0.04 * np.abs(full).max()
    both = changes(evidence, {0: np.array([change, -2.0 * change])}, parts)
    assert np.allclose(both, [full, -2.0 * full], rtol=0.0, atol=1e-12 * np.abs(full).max())


@pytest.mark.parametrize("hop", [8, 30, 160, 1806, 4000])
@pytest.mark.parametrize("lines", [1, 7, 90])
def test_averages_keep_eight_samples_in_a_period_and_an_even_hop(hop, lines):
    every = averaged_over(hop, lines)
    assert every >= 1 and hop % (2 * every) == 0
    assert every == 1 or 2 * hop / every >= 8 * lines


def axis(travel: float, speeds: tuple[float, ...], cycles: float, seed: int) -> CellFitter:
    """Return a fitter for runs of a rigid axis with cogging that goes from place to place.

    Its loop is not known.

    Args:
        travel: of the axis, rad or m.
        speeds: of its moves, rad/s or m/s.
        cycles: of its cogging, per 2 pi rad or m.
        seed: of its places and noise.
    """
    rng, friction = np.random.default_rng(seed), 5.0 * max(speeds)
    bare = Model({"jm": 1.0, "fsm": friction, "fvm": 0.5}, {})
    named = {"amplitude_nm": 0.3 * friction, "cycles_per_turn": cycles, "phase_rad": 0.7}
    cogging = fx.coefficients({f"cogging.{name}": value for name, value in named.items()})
    law = pd_filtered.CONTROLLER.check({"sample_rate_hz": RATE, "p": 900.0, "d": 45.0, "n": 600.0})
    made = []
    for run in range(3):
        way = [0.0]
        while len(way) < 16.0 * RATE:
            step = rng.choice(speeds) / RATE
            way += np.arange(way[-1], end := rng.uniform(0.0, travel), math.copysign(
                step, end - way[-1])).tolist()  # fmt: skip
            way += [way[-1]] * int(0.1 * RATE)
        reference = uniform_filter1d(np.array(way[: int(16.0 * RATE)]), int(0.1 * RATE))
        noise = 3e-6 * travel * rng.standard_normal(reference.size)
        moved = simulate(reference, RATE, coefficients(bare.whole_plant),
                         pd_filtered.coefficients(law), noise, cogging)  # fmt: skip
        description = RecordDescription.of(
            "test", sample_rate_hz=RATE, level=0, levels=1, realization=run, realizations=3,
            controller=None,
        )  # fmt: skip
        record = Record(f"run_{run}", description, None, moved.torque, moved.position, None)
        made.append(record)
    known = {"jm": 1.04, "fsm": 0.93 * friction, "fvm": 0.55}
    evidence = Evidence(RecordSet("test", RATE, tuple(made)), Model(known, {}).whole_plant)
    return CellFitter(evidence, known, 0.1)


AXES = {
    "a belt that is long for its pulley": (0.8, (0.02, 0.06, 0.2), 151.3),
    "a linear motor": (0.3, (0.01, 0.03, 0.1), 2.0 * math.pi / 0.012),
    "a stepper on a belt": (0.2, (0.01, 0.03, 0.15), 2.0 * math.pi / 4e-4),
    "a ball screw": (0.15, (0.008, 0.02, 0.05), 2.0 * math.pi / 1e-3),
    "a joint, by the teeth of its gear": (2.0, (0.1, 0.3, 1.0), 363.4),
    "a motor of many turns": (60.0, (1.0, 4.0, 12.0), 38.3),
}
"""Travel, speeds and cycles per turn."""


@pytest.mark.parametrize("name", AXES)
def test_ripples_of_rotary_and_linear_axes_are_found_down_to_what_slow_stretches_show(name):
    travel, speeds, cycles = AXES[name]
    fitter = axis(travel, speeds, cycles, 7)
    refit = fitter.refit()
    fit = fitter.add(refit, "cogging", fitter.screening(refit, "cogging").proposals())
    found = fit.model.effects["cogging.cycles_per_turn"]
    assert found == pytest.approx(cycles, abs=1.0 / travel)


def test_the_transform_over_an_angle_has_the_sums_of_all_numbers_of_waves():
    rng = np.random.default_rng(3)
    angle = np.cumsum(rng.standard_normal(5000)) * 1e-2
    signal, cycles = rng.standard_normal(5000), 3.7 + 0.4 * np.arange(300)
    exact = np.array([signal @ np.exp(1j * number * angle) for number in cycles])
    found = transformed(signal, angle, cycles)
    assert np.abs(found - exact).max() < 0.03 * np.abs(exact).max()
    assert np.abs(found - exact)[:30].max() < 1e-3 * np.abs(exact).max()
