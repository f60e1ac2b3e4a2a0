"""The second plant of the blind check: independent of the simulated rig, and right."""

import ast
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from controller_node import pd_filtered
from excitation_node import multisine
from fjr_sim_node import plant
from fjr_sim_node.simulation.closed_loop import simulate as simulate_rig
from fjr_validation.blind import second_laws as law
from fjr_validation.blind import second_simulation as second
from fjr_validation.blind.causes import drawers
from fjr_validation.blind.draw import Scales
from fjr_validation.blind.excitations import draw_multisine, draw_records
from fjr_validation.blind.remainders import laws
from fjr_validation.blind.rigs import draw_rig

NOMINAL = {name: float(value) for name, value in plant.PLANT.defaults().items()}
EXPERIMENT = {
    **multisine.EXCITATION.defaults(),
    "base_frequency_hz": 0.5,
    "f_min_hz": 0.5,
    "amplitudes_rad": (2e-3, 7e-3, 2e-2),
    "periods": 1,
}
SCALES = Scales(
    torque=10.0, torque_peak=30.0, torque_rate_peak=2e3, speed=1.0, speed_peak=3.0, angle=0.05,
    deflection=5e-3, coulomb=6.0, damping=25.0, link_inertia=0.3, resonance_hz=18.0, band_hz=36.0,
    crossover_hz=3.0,
)  # fmt: skip
CAUSES = drawers(rigid=False, stationary=False)
LAWS = laws(rigid=False)


def reference(level: int) -> np.ndarray:
    return multisine.reference(multisine.describe(EXPERIMENT, level, 0))


def test_nothing_of_the_simulated_rig_or_the_controller_node_is_imported():
    folder = Path(second.__file__).parent
    for source in sorted(folder.glob("second_*.py")):
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.ImportFrom | ast.Import):
                names = [a.name for a in node.names] + [getattr(node, "module", None) or ""]
                assert not any(n.startswith(("fjr_", "controller_node")) for n in names), source


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
    errors = [
        second.discretisation_error(r, NOMINAL, None, second.Play(steps_per_second=rate))
        for rate in (1e4, 4e4)
    ]
    assert 2.5 < errors[0] / errors[1] < 6.0


def test_torque_below_breakaway_moves_nothing_at_all():
    r = 3e-3 * np.sin(2 * np.pi * 5.0 * np.arange(1000) / 1000.0)
    record = second.simulate(r, NOMINAL)
    assert np.abs(record.u).max() > 0.5 * NOMINAL["fsm"]
    assert np.abs(record.u).max() < NOMINAL["fsm"]
    assert not record.y.any()
    assert not record.q.any()


@pytest.mark.parametrize("seed", range(8))
def test_the_bare_plants_agree_on_random_rigs(seed):
    rng = np.random.default_rng([17, seed])
    rig = draw_rig(rng)
    drawn = draw_multisine(rng, rig) if seed % 2 else draw_records(rng, rig, controller_known=True)
    rate = rig.loop.sample_rate_hz
    r = drawn.firsts[-1].reference[: round(6.0 * rate)]
    smooth = second.simulate(r, rig.plant, play=second.Play(rig.loop))
    level = 0.1 * float(np.std(smooth.u))
    values = {**rig.plant, "fs": 0.4 * level, "fsm": 0.6 * level}
    play = second.Play(rig.loop, steps_per_second=rig.steps_per_second)
    mine = second.simulate(r, values, play=play)
    own = second.discretisation_error(r, values, play=play)
    assert own < 2e-3
    gains = {name: rig.controller[name] for name in ("p", "d", "n")}
    controller = pd_filtered.coefficients(
        {**gains, "sample_rate_hz": rate, "torque_limit_nm": math.inf}
    )
    theirs = simulate_rig(r, rate, plant.coefficients(values), controller)
    for a, b in ((mine.y, theirs.position), (mine.u, theirs.torque)):
        assert np.linalg.norm(a - b) < (2.0 * own + 1e-4) * np.linalg.norm(b)


@pytest.mark.parametrize(
    "drawer", (*CAUSES, *LAWS), ids=lambda d: d(np.random.default_rng(0), SCALES).name
)
def test_an_effect_that_is_faint_changes_little_and_a_large_one_much(drawer):
    changes = []
    for r in (reference(0)[:1500], reference(2)[:1500]):
        bare = play(r)
        peaks = {"deflection": float(np.std(bare.q - bare.th)),
                 "torque_peak": float(np.abs(bare.u).max()),
                 "torque_rate_peak": float(np.abs(np.diff(bare.u)).max() * 1000.0)}  # fmt: skip
        draw = drawer(np.random.default_rng(3), replace(SCALES, **peaks))
        if not draw.lacking:
            faint = play(r, draw.settings(1e-3 * draw.start))
            assert np.linalg.norm(faint.y - bare.y) < 0.02 * np.linalg.norm(bare.y)
        try:
            on = play(r, draw.settings(draw.most))
        except FloatingPointError:
            changes.append(math.inf)
        else:
            changes.append(np.linalg.norm(on.y - bare.y) / np.linalg.norm(bare.y))
    assert max(changes) > 0.01


def play(r: np.ndarray, settings: dict[str, float] | None = None) -> second.Record:
    given = settings or {}
    values = {name: given.get(name, value) for name, value in NOMINAL.items()}
    rest = {name: value for name, value in given.items() if name not in NOMINAL}
    rng = np.random.default_rng(1)
    chance = second.Chance(None, rng.standard_normal(r.size), rng.standard_normal(r.size))
    how = second.Play(chance=chance, elapsed_s=60.0, steps_per_second=50_000)
    return second.simulate(r, values, rest, how)


def test_a_rigid_axis_moves_as_one_body_and_feels_gravity():
    rigid = {**NOMINAL, "k0": math.inf}
    r = reference(2)[:1500]
    record = second.simulate(r, rigid)
    assert np.array_equal(record.q, record.th)
    stiff = second.simulate(r, {**NOMINAL, "k0": 3e6, "k1": 0.0})
    assert np.linalg.norm(stiff.y - record.y) < 2e-3 * np.linalg.norm(record.y)
    heavy = second.simulate(r, rigid, {"gravity_nm": 30.0, "gravity_angle_rad": np.pi / 2})
    assert np.mean(heavy.th[500:]) < np.mean(record.th[500:]) - 0.02


def test_a_speed_limit_leaves_the_line_of_the_voltage():
    settings = settings_of(stall_nm=10.0, no_load_rad_s=5.0)
    assert law.within_speed_limit(100.0, 0.0, settings) == 10.0
    assert law.within_speed_limit(100.0, 2.5, settings) == 5.0
    assert law.within_speed_limit(-100.0, 2.5, settings) == -15.0
    assert law.within_speed_limit(3.0, 2.5, settings) == 3.0


def test_drags_outside_the_catalogue_follow_their_formulas():
    eyring = settings_of(eyring_nm=2.0, eyring_rad_s=0.3)
    assert 0.7 * law.drag(0.7, eyring) == pytest.approx(2.0 * np.arcsinh(0.7 / 0.3))
    assert law.drag(0.0, eyring) == pytest.approx(2.0 / 0.3)
    eddy = settings_of(eddy_nm=2.0, eddy_rad_s=0.5)
    torques = [v * law.drag(v, eddy) for v in (0.25, 0.5, 1.0)]
    assert torques[1] == pytest.approx(2.0) and max(torques) == torques[1]


def settings_of(**values: float) -> tuple[float, ...]:
    return tuple(values.get(name, 0.0) for name in law.SETTINGS)


def test_a_loss_in_one_direction_takes_energy_in_that_direction_only():
    r = reference(2)[:1500]
    bare = second.simulate(r, NOMINAL)
    forward = second.simulate(r, NOMINAL, {"loss_forward": 0.3})
    backward = second.simulate(r, NOMINAL, {"loss_backward": 0.3})
    assert not np.allclose(forward.y, backward.y, atol=1e-4)
    for lossy in (forward, backward):
        assert np.std(lossy.th) < np.std(bare.th)


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
    idle = second.Loop.pd(p=0.0, d=0.0)
    wander = np.sin(2 * np.pi * 4.0 * np.arange(1000) / 1000.0)
    how = second.Play(idle, second.Chance(wander=wander))
    settings = {"wander_nm": 40.0, "delay_s": 0.003}
    record = second.simulate(np.zeros(1000), NOMINAL, settings, how)
    assert np.ptp(record.th) > 1e-3
    assert np.allclose(record.y[3:], record.th[:-3], atol=1e-12)


def test_an_eccentric_encoder_reads_zero_at_the_start_and_its_sine_beyond():
    on = {"eccentricity_rad": 0.1, "eccentricity_phase_rad": 1.2}
    record = play(reference(2)[:1500], on)
    sine = 0.1 * (np.sin(record.th + 1.2) - math.sin(1.2))
    assert record.y[0] == 0.0 and np.ptp(record.th) > 0.02
    assert np.allclose(record.y - record.th, sine, atol=1e-12)


def test_energy_of_the_free_undamped_plant_is_kept():
    free = {**NOMINAL, "fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0}
    kick = np.zeros(2000)
    kick[:5] = 0.05
    how = second.Play(second.Loop.pd(p=200.0, d=0.0))
    first = second.simulate(kick[:5], free, play=how)
    idle = second.simulate(kick, free, {"deadband_nm": 9.9}, how)
    assert np.isfinite(idle.y).all()
    assert np.abs(first.u).max() == pytest.approx(10.0, rel=0.1)
    d = idle.q - idle.th
    late, early = np.abs(d[1500:]).max(), np.abs(d[100:600]).max()
    assert late == pytest.approx(early, rel=0.02)


def test_a_body_whose_inertia_varies_with_the_angle_keeps_its_energy():
    """J(q) v^2 is constant after a push: it turns slower where its inertia is greater."""
    free = {**NOMINAL, **dict.fromkeys(("fs", "fsm", "fv", "fvm"), 0.0), "k0": math.inf}
    push = np.zeros(3000)
    push[:5] = 0.05
    crank = {"crank_relative": 0.4, "crank_cycles": 2000.0, "crank_phase_rad": 0.3}
    how = second.Play(second.Loop.pd(p=200.0, d=0.0))
    th = second.simulate(push, free, {"deadband_nm": 9.9, **crank}, how).th[100:]
    v = np.gradient(th, 1e-3)[1:-1]
    inertia = 1.0 + 0.4 * np.sin(2000.0 * th[1:-1] + 0.3)
    assert 2000.0 * np.ptp(th) > 3.0 and np.ptp(v) > 0.3 * v.mean()
    energy = inertia * v**2
    assert np.ptp(energy) < 5e-3 * energy.mean()


def test_a_spring_to_the_frame_pulls_by_its_angle_and_the_cube_of_that():
    spring = settings_of(spring_nm_rad=2.0, spring_nm_rad3=50.0, spring_rest_rad=0.1)
    pulled = law.outer_load(0.4, 0.0, 0.0, spring)
    assert pulled == pytest.approx(-(2.0 * 0.3 + 50.0 * 0.3**3))


def test_an_unknown_setting_is_refused():
    with pytest.raises(KeyError, match="half_gap"):
        second.simulate(np.zeros(10), NOMINAL, {"half_gap": 1.0})


def test_a_diverging_motion_is_said():
    with pytest.raises(FloatingPointError):
        second.simulate(reference(2), NOMINAL, play=second.Play(second.Loop.pd(p=1e6)))
