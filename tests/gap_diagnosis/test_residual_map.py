"""Maps of the residual: false discoveries without a gap, and where known effects appear."""

from __future__ import annotations

import numpy as np
import pytest
from gap_cases import simulate_case, with_other_noise

from fjr_records.noise import noise_levels
from gap_diagnosis.model.simulated_rig import Simulator
from gap_diagnosis.where.residual_map import bands, discoveries, p_values, residual_map


def maps_without_a_gap(cases: int, records: int):
    for seed in range(cases):
        case = simulate_case(seed=seed)
        position, torque = Simulator(case.recorded).signals(case.truth)
        for number in range(records):
            recorded = with_other_noise(case, 1000 * seed + number)
            yield residual_map(recorded, noise_levels(recorded), position, torque, 0.05)


def test_false_discoveries_without_a_gap_stay_near_the_nominal_rate():
    maps = list(maps_without_a_gap(10, 20))
    any_found = np.mean([m.discoveries > 0 for m in maps])
    # without a gap, any discovery is false: its rate is the probability of any
    assert any_found <= 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / len(maps))
    p = np.array([m.signals["position"].p for m in maps])
    assert abs(np.mean(p < 0.05) - 0.05) < 0.01
    assert abs(np.mean(p < 0.5) - 0.5) < 0.03
    for kind in ("excited", "odd", "even", "dc"):
        assert np.mean(p[:, :, maps[0].kinds == kind] < 0.01) < 0.025


def test_torque_and_position_show_the_same_gap_where_the_controller_is_exact(gaps):
    found = gaps["backlash"]
    torque, position = (found.signals[name].sigma[:, 20:] for name in ("torque", "position"))
    strong = position > 10.0
    # u = C (r - y) on every line: the ratio differs only as the noise is smoothed over lines
    assert strong.sum() > 100
    ratio = (torque / position)[strong]
    assert ratio.min() > 0.8 and ratio.max() < 1.25


@pytest.fixture(scope="module")
def gaps():
    effects = {
        "torque_bias": {"torque_bias.torque_nm": 0.3},
        "backlash": {"backlash.half_gap_rad": 1.5e-3},
        "cogging": {
            "cogging.amplitude_nm": 0.5,
            "cogging.cycles_per_turn": 12.0,
            "cogging.phase_rad": 1.0,
        },
        "extra_mode": {
            "extra_mode.inertia_kg_m2": 0.01,
            "extra_mode.frequency_hz": 30.0,
            "extra_mode.damping_ratio": 0.01,
        },
    }
    found = {}
    for name, values in effects.items():
        case = simulate_case(values, seed=4)
        position, torque = Simulator(case.recorded).signals(case.bare)
        found[name] = residual_map(case.recorded, noise_levels(case.recorded), position, torque)
    return found


def share(found, kind: str, level: int) -> float:
    """Share of the lines of a kind that are discoveries."""
    return float(found.signals["position"].significant[level, found.kinds == kind].mean())


def test_a_bias_shows_at_dc_and_even_lines(gaps):
    strongest = gaps["torque_bias"].places(1)[0]
    assert strongest.lines in ("dc", "even")
    assert share(gaps["torque_bias"], "dc", 1) == 1.0


def test_backlash_leaves_even_lines_and_dc_alone(gaps):
    found = gaps["backlash"]
    assert share(found, "excited", 0) > 0.8 and share(found, "odd", 0) > 0.8
    assert max(share(found, kind, level) for kind in ("even", "dc") for level in range(3)) < 0.03


def test_cogging_shows_at_even_lines(gaps):
    assert share(gaps["cogging"], "even", 1) > 0.5


def test_an_extra_mode_peaks_at_its_frequency(gaps):
    place = gaps["extra_mode"].places(1)[0]
    part = gaps["extra_mode"].signals["position"]
    frequency = gaps["extra_mode"].frequency_hz
    peak = frequency[np.argmax(np.where(frequency > 25.0, part.sigma[2], 0.0))]
    assert abs(peak - 30.0) < 2.0
    assert place.lines in ("excited", "odd") and place.band_hz[0] < 30.0 < place.band_hz[1]


def test_places_are_sorted_and_hold_what_was_discovered(gaps):
    places = gaps["backlash"].places()
    assert [p.sigma for p in places] == sorted((p.sigma for p in places), reverse=True)
    assert len(gaps["backlash"].places(3)) == 3
    assert {p.signal for p in places} == {"position", "torque"}


def test_one_period_gives_residuals_without_significance():
    case = simulate_case({"backlash.half_gap_rad": 1.5e-3}, periods=1, levels_rad=(2e-3,))
    found = residual_map(case.recorded, None, Simulator(case.recorded).signals(case.bare)[0])
    assert found.places() == [] and found.discoveries == 0
    assert np.isnan(found.signals["position"].sigma).all()
    assert found.signals["position"].residual.max() > 1e-6


def test_a_diverged_simulation_is_a_discovery_everywhere():
    case = simulate_case(levels_rad=(2e-3,))
    position = np.full((2, case.recorded.experiment.samples_per_period), np.nan)
    part = residual_map(case.recorded, noise_levels(case.recorded), position).signals["position"]
    assert part.significant.all() and np.isinf(part.sigma).all()


def test_benjamini_hochberg_of_a_worked_example():
    # the 15 p-values of Benjamini and Hochberg 1995, section 4: four are rejected at 0.05
    p = np.array([0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240,
                  0.4262, 0.5719, 0.6528, 0.7590, 1.0])  # fmt: skip
    assert discoveries(p, 0.05).sum() == 4
    assert discoveries(p[4:].reshape(-1, 1), 1e-3).sum() == 0


def test_p_values_are_uniform_for_gaussian_noise_with_estimated_variance():
    rng = np.random.default_rng(5)
    counts, dof = np.array([2]), np.full((1, 2), 8.0)
    drawn = []
    for _ in range(4000):
        chi2 = rng.chisquare([2.0, 4.0]) / [2.0, 4.0]
        drawn.append(p_values((chi2 / (rng.chisquare(8.0, 2) / 8.0))[None], counts, dof)[0])
    for column in np.array(drawn).T:
        assert np.abs(np.quantile(column, [0.05, 0.5, 0.95]) - [0.05, 0.5, 0.95]).max() < 0.03


def test_bands_bridge_short_gaps_only():
    line = np.array([0, 1, 1, 0, 0, 1, 0, 0, 0, 1], bool)
    assert bands(line) == [slice(1, 6), slice(9, 10)]
