"""The second plant of the blind check: independent of the simulated rig, and right."""

import ast
from pathlib import Path

import numpy as np
import pytest

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_sim_node import plant
from fjr_sim_node.simulation.closed_loop import simulate as simulate_rig
from fjr_validation.blind import second_laws as law
from fjr_validation.blind import second_plant as second
from fjr_validation.blind.cases import NOMINAL
from fjr_validation.blind.draws import NONSTATIONARY, OUTSIDE, SINGLE

EXPERIMENT = {
    **multisine.EXCITATION.defaults(),
    "base_frequency_hz": 0.5,
    "f_min_hz": 0.5,
    "amplitudes_rad": (2e-3, 7e-3, 2e-2),
    "periods": 1,
}
EVERY = (*SINGLE, *OUTSIDE, NONSTATIONARY)


def reference(level: int) -> np.ndarray:
    return multisine.reference(multisine.describe(EXPERIMENT, level, 0))


def test_nothing_of_the_simulated_rig_or_the_controller_node_is_imported():
    folder = Path(second.__file__).parent
    for source in sorted(folder.glob("second_*.py")):
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.ImportFrom | ast.Import):
                names = [a.name for a in node.names] + [getattr(node, "module", None) or ""]
                assert not any(n.startswith(("fjr_", "controller_node")) for n in names), source


def test_the_paper_s_values_are_the_same_on_both_sides():
    assert {name: float(value) for name, value in plant.PLANT.defaults().items()} == NOMINAL


@pytest.mark.parametrize("level", [0, 1, 2])
def test_the_bare_plants_agree_within_the_second_one_s_own_error(level):
    r = reference(level)
    controller = pd_filtered.coefficients(pd_filtered.CONTROLLER.defaults())
    rig = simulate_rig(r, 1000.0, plant.coefficients(NOMINAL), controller)
    mine = second.simulate(r, NOMINAL)
    own = second.discretisation_error(r, NOMINAL)
    assert own < 1e-3
    difference = np.linalg.norm(mine.y - rig.position) / np.linalg.norm(rig.position)
    assert difference < 1.5 * own
    assert np.linalg.norm(mine.u - rig.torque) < 1.5 * own * np.linalg.norm(rig.torque)
    assert np.linalg.norm(mine.q - rig.link) < 1.5 * own * np.linalg.norm(rig.link)


def test_the_error_falls_in_proportion_to_the_step():
    r = reference(1)
    errors = [second.discretisation_error(r, NOMINAL, None, rate) for rate in (1e4, 4e4)]
    assert 2.5 < errors[0] / errors[1] < 6.0


def test_torque_below_breakaway_moves_nothing_at_all():
    r = 3e-3 * np.sin(2 * np.pi * 5.0 * np.arange(1000) / 1000.0)
    record = second.simulate(r, NOMINAL)
    assert np.abs(record.u).max() > 0.5 * NOMINAL["fsm"]
    assert np.abs(record.u).max() < NOMINAL["fsm"]
    assert not record.y.any()
    assert not record.q.any()


@pytest.mark.parametrize("drawer", EVERY, ids=lambda d: d(np.random.default_rng(0)).name)
def test_an_effect_of_size_zero_is_off_and_of_most_size_is_on(drawer):
    draw = drawer(np.random.default_rng(3))
    changes = []
    for r in (reference(0)[:1000], reference(1)[:1000]):
        bare = play(r)
        peaks = {"torque": 2.0 * np.abs(bare.u).max(), "torque_rate": 1e5}
        if draw.clips:
            off = play(r, draw.settings(0.0, peaks))
            assert np.linalg.norm(off.y - bare.y) < 1e-6 * np.linalg.norm(bare.y)
        elif not draw.slows:
            assert np.array_equal(play(r, draw.settings(0.0, peaks)).y, bare.y)
        on = play(r, draw.settings(0.9 if draw.clips else 0.5 * draw.most, peaks))
        changes.append(np.linalg.norm(on.y - bare.y) / np.linalg.norm(bare.y))
    assert max(changes) > 0.01


def play(r: np.ndarray, settings: dict[str, float] | None = None) -> second.Record:
    return second.simulate(r, NOMINAL, settings, elapsed_s=60.0, steps_per_second=50_000)


def test_every_setting_is_drawn_by_some_effect():
    rngs = [np.random.default_rng(seed) for seed in range(20)]
    peaks = {"torque": 1.0, "torque_rate": 1.0}
    drawn = {name for rng in rngs for d in EVERY for name in d(rng).settings(0.1, peaks)}
    assert drawn == set(law.SETTINGS)


def test_slip_elements_start_as_a_spring_and_end_at_the_coulomb_level():
    elements = np.zeros(6)
    curve = [law.slip_elements(elements, 1e-6, 5.0, 1e-4) for _ in range(400)]
    assert curve[-1] == pytest.approx(5.0)
    assert np.all(np.diff(curve) >= -1e-12)
    assert curve[99] == pytest.approx(5.0 * (1.0 - np.exp(-1.0)), rel=0.1)  # Dahl's at x0


def test_slip_elements_close_their_loop_and_take_energy():
    elements = np.zeros(6)
    moves = np.concatenate([np.full(400, 1e-6), np.full(300, -1e-6), np.full(300, 1e-6)])
    torques = np.array([law.slip_elements(elements, m, 5.0, 1e-4) for m in moves])
    assert torques[-1] == pytest.approx(torques[399])
    assert np.sum(torques[400:] * moves[400:]) > 0.0


def test_bouc_wen_stays_within_one_and_takes_energy():
    settings = tuple(2e-3 if name == "hysteresis_rad" else 0.0 for name in law.SETTINGS)
    z, work = 0.0, 0.0
    for move in 1e-5 * np.sin(2 * np.pi * np.arange(8000) / 2000.0):
        after = law.bouc_wen(z, move, settings)
        work += 0.5 * (z + after) * move
        z = after
        assert abs(z) <= 1.0 + 1e-9
    assert work > 0.0


def test_a_delayed_encoder_shows_the_past():
    idle = second.Loop(p=0.0, d=0.0)
    settings = {"hum_nm": 40.0, "hum_hz": 4.0, "delay_s": 0.003}
    record = second.simulate(np.zeros(1000), NOMINAL, settings, loop=idle)
    assert np.ptp(record.th) > 1e-3
    assert np.allclose(record.y[3:], record.th[:-3], atol=1e-12)


def test_energy_of_the_free_undamped_plant_is_kept():
    free = {**NOMINAL, "fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}
    kick = np.zeros(2000)
    kick[:5] = 0.05
    loop = second.Loop(p=200.0, d=0.0)
    first = second.simulate(kick[:5], free, loop=loop)
    idle = second.simulate(kick, free, {"deadband_nm": 9.9}, loop=loop)
    assert np.isfinite(idle.y).all()
    assert np.abs(first.u).max() == pytest.approx(10.0, rel=0.1)
    d = idle.q - idle.th
    late, early = np.abs(d[1500:]).max(), np.abs(d[100:600]).max()
    assert late == pytest.approx(early, rel=0.02)


def test_an_unknown_setting_is_refused():
    with pytest.raises(KeyError, match="half_gap"):
        second.simulate(np.zeros(10), NOMINAL, {"half_gap": 1.0})


def test_a_diverging_motion_is_said():
    with pytest.raises(FloatingPointError):
        second.simulate(reference(2), NOMINAL, loop=second.Loop(p=1e6))
