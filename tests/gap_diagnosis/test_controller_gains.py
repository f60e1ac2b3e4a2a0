"""Gains of a controller from a record: exact without noise, honest with it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from paths import SHARED
from scipy.signal import lfilter

from controller_node.gains import free_gains, unknown_gains
from controller_node.law import law_of
from excitation_node import records
from fjr_kit.errors import InputError
from fjr_records.records import read_records
from fjr_sim_node import plant
from fjr_sim_node.simulation import closed_loop
from gap_diagnosis.model.controller_check import check_law
from gap_diagnosis.model.controller_gains import identify_gains

RATE = 1000.0
SERVO_RUNS = ("10h28m10", "10h28m42", "10h29m14", "10h29m47")
PLANT = plant.coefficients(plant.PLANT.defaults())
CASCADE = {
    "kind": "p_pi", "k_position": 12.0, "k_velocity": 40.0, "integral_time_s": 0.4,
    "velocity_filter_rad_s": 900.0, "feed_forward": {"velocity": 1.5, "acceleration": 0.4},
}  # fmt: skip
PID = {
    "kind": "pid", "p": 200.0, "i": 90.0, "d": 40.0, "n": 300.0, "derivative_on": "measurement",
    "setpoint_weight": 0.7,
}  # fmt: skip
NODE = {"kind": "pd_filtered", "p": 200.0, "d": 60.0, "n": 24.0}
LISTS = {
    "kind": "two_degrees_of_freedom",
    "reference": {"numerator": [180.0, -170.0], "denominator": [1.0, -0.9]},
    "position": {"numerator": [9000.0, -8990.0], "denominator": [1.0, -0.8]},
}


def freed(known: dict, *names: str) -> tuple[dict, dict]:
    """Return a description without the values of some gains, and these values."""
    description, values = {**known, "unknown": list(names)}, {}
    for name in names:
        holder = description
        *path, last = name.split(".")
        for part in path:
            holder[part] = holder[part].copy()
            holder = holder[part]
        last = int(last) if isinstance(holder, list) else last
        values[name], holder[last] = holder[last], None
    return description, values


def record(known: dict, samples: int = 8000, **change) -> tuple[np.ndarray, ...]:
    """Return r, u and y of the rig under a chirp, cut so that it begins in motion."""
    r = records.chirp(samples, RATE, amplitude_rad=0.05, f_min_hz=0.2, f_max_hz=8.0)
    run = closed_loop.simulate(r, RATE, PLANT, law_of({**known, **change}, RATE))
    return tuple(s[700:] for s in (run.reference, run.torque, run.position))


@pytest.mark.parametrize(
    ("known", "names"),
    [
        (NODE, ["p"]),
        (NODE, ["p", "d", "n"]),
        (PID, ["p", "i", "d"]),
        (PID, ["p", "d", "n", "setpoint_weight"]),
        (CASCADE, ["k_velocity"]),
        (CASCADE, ["k_position", "k_velocity"]),
        (CASCADE, ["k_velocity", "integral_time_s", "feed_forward.velocity"]),
        (CASCADE, ["k_position", "velocity_filter_rad_s", "feed_forward.acceleration"]),
        (LISTS, ["reference.numerator.0", "reference.numerator.1", "position.numerator.0"]),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, list) else value["kind"],
)
def test_gains_are_solved_exactly_from_a_noise_free_record(known, names):
    description, values = freed(known, *names)
    found = identify_gains(description, *record(known), RATE)
    assert found.explained > 1.0 - 1e-12
    for name, value in values.items():
        assert found.values[name] == pytest.approx(value, rel=1e-5), name
    r, u, y = record(known)
    law = law_of(description, RATE, found.values)
    assert check_law(law, r, y, u).passed


def moves(rng: np.random.Generator, samples: int) -> np.ndarray:
    """A reference that goes from place to place by trapezoids of speed, with rests between."""
    way = [0.0]
    while len(way) < samples:
        goal, n = rng.uniform(-3.0, 3.0), int(RATE * rng.uniform(0.4, 1.5))
        t = np.arange(1, n + 1) / n
        speed = np.minimum(np.minimum(t, 1.0 - t), 1.0 / 3.0)
        way += [*(way[-1] + (goal - way[-1]) * np.cumsum(speed) / speed.sum()), *[goal] * 200]
    return np.array(way[:samples])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("filtered", [False, True])
def test_all_gains_of_a_servo_are_solved_from_moves_of_its_axis(seed, filtered):
    rng = np.random.default_rng(seed)
    values = {
        "k_position": rng.uniform(5.0, 25.0),
        "k_velocity": rng.uniform(8.0, 30.0),
        "integral_time_s": np.exp(rng.uniform(np.log(0.05), np.log(0.5))),
    }
    if filtered:
        values["velocity_filter_rad_s"] = rng.uniform(200.0, 900.0)
    axis = {**plant.PLANT.defaults(), "fs": 0.0, "fsm": 1.5, "k0": 4e4, "k1": 0.0}
    law = law_of({"kind": "p_pi", **values}, RATE)
    run = closed_loop.simulate(moves(rng, 12_000), RATE, plant.coefficients(axis), law)
    noise = 0.01 * np.std(run.torque) * rng.standard_normal(run.torque.size)
    description, _ = freed({"kind": "p_pi", **values}, *values)
    begun = slice(300, None)
    r, u, y = run.reference, run.torque + noise, run.position
    found = identify_gains(description, r[begun], u[begun], y[begun], RATE)
    assert found.explained > 0.9998
    for name, value in values.items():
        assert found.values[name] == pytest.approx(value, rel=0.05), name


def test_a_limit_is_where_the_torque_ends():
    description, _ = freed({**PID, "torque_limit_nm": 6.0}, "p", "i", "torque_limit_nm")
    found = identify_gains(description, *record(PID, torque_limit_nm=6.0), RATE)
    assert found.values["torque_limit_nm"] == pytest.approx(6.0)
    assert found.values["p"] == pytest.approx(200.0) and found.values["i"] == pytest.approx(90.0)
    found = identify_gains(description, *record(PID), RATE)
    assert found.values["torque_limit_nm"] == math.inf
    law_of(description, RATE, found.values)


def test_coarse_counts_are_no_limit():
    description, _ = freed({**NODE, "torque_limit_nm": 6.0}, "p", "torque_limit_nm")
    r, u, y = record(NODE)
    u = np.round(u / 0.5) * 0.5
    assert np.sum(np.abs(u) == np.abs(u).max()) > 2
    found = identify_gains(description, r, u, y, RATE)
    assert found.values["torque_limit_nm"] == math.inf
    assert found.values["p"] == pytest.approx(200.0, rel=0.02)


def test_standard_errors_cover_the_truth_whatever_the_colour_of_the_noise():
    description, values = freed(PID, "p", "i", "d")
    r, u, y = record(PID)
    size = np.std(u)
    z = []
    for seed in range(60):
        white = np.random.default_rng(seed).standard_normal(u.size)
        noise = 0.05 * size * lfilter([0.3], [1.0, -0.95], white)
        found = identify_gains(description, r, u + noise, y, RATE)
        z.append([(found.values[n] - v) / found.standard_errors[n] for n, v in values.items()])
        assert 0.98 < found.explained < 1.0
    within = np.mean(np.abs(z) < 1.96, axis=0)
    # 57 of 60 are expected; the bounds leave a binomial of 0.95 in 999 of 1000 cases each side,
    # widened for the few independent blocks of 7 s.
    assert np.all(within > 0.8) and np.std(z) < 1.6 and np.std(z) > 0.6


def test_a_gain_that_the_record_does_not_show_has_no_error_bar():
    description, _ = freed(PID, "p", "i", "setpoint_weight")
    r, _, y = record(PID)
    still = np.zeros_like(r)
    u = law_of(PID, RATE).unlimited(still, y)
    found = identify_gains(description, still, u, y, RATE)
    assert found.standard_errors["setpoint_weight"] == math.inf
    assert found.values["p"] == pytest.approx(200.0)


def test_runs_of_one_controller_are_solved_together():
    description, _ = freed(CASCADE, "k_velocity", "feed_forward.velocity")
    r, u, y = record(CASCADE)
    both = [np.stack([s[:3000], s[4000:7000]]) for s in (r, u, y)]
    found = identify_gains(description, *both, RATE)
    assert found.values["k_velocity"] == pytest.approx(40.0, rel=1e-8)
    assert found.values["feed_forward.velocity"] == pytest.approx(1.5, rel=1e-6)


def test_another_structure_does_not_explain_the_torque():
    description, _ = freed(NODE, "p", "d")
    found = identify_gains(description, *record(CASCADE), RATE)
    assert found.explained < 0.99


def test_ranges_hold_the_gains_of_a_rig():
    r, u, y = record(CASCADE)
    scales = float(np.std(u)), float(np.std(r - y))
    for known in (CASCADE, PID, NODE):
        names = [n for n, v in known.items() if isinstance(v, float)]
        description, values = freed(known, *names)
        gains = free_gains(description, RATE, *scales)
        assert unknown_gains(description) == tuple(names)
        for gain in gains:
            assert gain.low < gain.start < gain.high and gain.low < values[gain.name] < gain.high
            if gain.logarithmic:
                assert gain.low > 0.0
                assert abs(math.log10(gain.start / values[gain.name])) < 3.0


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"unknown": []}, "No gain of this controller is unknown"),
        ({"unknown": ["q"]}, "'q' is no gain"),
        ({"unknown": "p"}, "must be a list of different names"),
        ({"unknown": ["i"]}, "there is no 'i' in this controller"),
        ({"unknown": ["d"], "d": None}, "p"),
    ],
)
def test_bad_descriptions_are_refused(change, says):
    signals = np.random.default_rng(1).normal(size=(3, 100))
    bad = {**NODE, "p": None, **change} if "d" in change.get("unknown", []) else {**NODE, **change}
    with pytest.raises(InputError, match=says):
        identify_gains(bad, *signals, RATE)


def test_bad_signals_are_refused():
    description, _ = freed(NODE, "p")
    r, u, y = np.random.default_rng(1).normal(size=(3, 100))
    for signals, says in (
        ((r[1:], u, y), "one length"),
        ((r, np.full(100, np.nan), y), "all finite"),
        ((r, np.ones(100), y), "a torque that moves"),
    ):
        with pytest.raises(InputError, match=says):
            identify_gains(description, *signals, RATE)
    with pytest.raises(InputError, match="'d' is not among the gains that are unknown"):
        law_of(description, RATE, {"p": 1.0, "d": 2.0})


def test_the_gains_of_a_real_servo_are_those_of_its_firmware(tmp_path, run):
    """Its gain was doubled from run to run; it counts PWM to 885."""
    files = [SHARED / "data" / "bam_xl330" / f"2026-01-15_{t}.json.gz" for t in SERVO_RUNS]
    if not all(file.exists() for file in files):
        pytest.skip("the records of the servo are not there")
    law = tmp_path / "law.yaml"
    law.write_text("kind: pd\np: unknown\ntorque_limit_nm: unknown\n")
    done = run(
        "import", *files, "--out", tmp_path / "servo", "--controller", law,
        "--map", "reference=entries.goal_position,position=entries.position",
        "--map", "torque=entries.load:8.06e-4,time=entries.timestamp",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    found = [
        identify_gains(
            r.controller, r.reference, r.torque, r.position, r.description.sample_rate_hz
        )
        for r in read_records(tmp_path / "servo").records
    ]
    gains = np.array([one.values["p"] for one in found])
    assert np.allclose(gains[1:] / gains[:-1], 2.0, rtol=0.01)
    assert min(one.explained for one in found) > 0.999
    limits = [one.values["torque_limit_nm"] for one in found]
    assert limits[:2] == [math.inf, math.inf]
    assert limits[2:] == pytest.approx([885 * 8.06e-4] * 2, rel=1e-3)
