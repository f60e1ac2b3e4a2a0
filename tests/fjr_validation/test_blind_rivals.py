"""Methods of others recover, on a tiny recorded rig, what their parameters can express."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from controller_node.law import as_transfer_function, law_of
from fjr_interface.bags.folder_names import bag_folder
from fjr_interface.bags.writer import BagWriter
from fjr_interface.experiment import RecordDescription
from fjr_kit.errors import InputError
from fjr_sim_node import effects as fx
from fjr_sim_node import plant
from fjr_sim_node.simulation.closed_loop import simulate, simulate_law
from fjr_validation.blind import baseline_fit, methods
from fjr_validation.blind.answers import Answer
from fjr_validation.blind.bam import LADDER, NAMES, bam
from fjr_validation.blind.bam_plant import play
from fjr_validation.blind.baseline_fit import Problem
from fjr_validation.blind.baselines import lowest_bic, refit_only
from fjr_validation.blind.cma_fit import Free, cma_fit
from fjr_validation.blind.methods import METHODS, check_methods
from fjr_validation.blind.outcome import Outcome
from fjr_validation.blind.pace import pace
from fjr_validation.blind.rivals import held_out, side_by_side, wilson

RATE, SECONDS = 500.0, 3.0
BRIEF_S = 1.5
"""Length of the runs that bam is to meet: it plays them some ten thousand times."""
RIGID = {"jm": 0.02, "j": 0.03, "fs": 0.1, "fsm": 0.1, "fv": 0.1, "fvm": 0.1,
         "k0": float("inf"), "k1": 0.0}  # fmt: skip
CONTROLLER = {"kind": "pd_filtered", "p": 40.0, "d": 2.0, "n": 200.0, "torque_limit_nm": None}


def recorded(
    folder: Path, values: dict[str, float], noise_rad: float = 1e-6, seconds: float = SECONDS
) -> Path:
    """Write runs of a rig at two levels, three of each, with seeded noise; return the folder."""
    rng = np.random.default_rng(7)
    time = np.arange(round(RATE * seconds)) / RATE
    law = law_of(CONTROLLER, RATE)
    coefficients = plant.coefficients(values)
    for level, amplitude in enumerate((0.1, 0.4)):
        for run in range(3):
            tones = rng.uniform(0.4, 6.0, 5)
            r = sum(np.sin(2.0 * np.pi * f * time) / (1.0 + f) for f in tones)
            r = amplitude * r * np.minimum(time / 0.3, 1.0)
            played = simulate(r, RATE, coefficients, law, rng.normal(0.0, noise_rad, r.size),
                              fx.coefficients(values))  # fmt: skip
            description = RecordDescription.of(
                "test", sample_rate_hz=RATE, level=level, realization=run, controller=CONTROLLER
            )
            with BagWriter(bag_folder(folder, level, run), description) as writer:
                writer.write_arrays(r=r, y=played.position, u=played.torque)
    return folder


@pytest.fixture(scope="module", autouse=True)
def compiled():
    """Compile the kernels before anything has a budget: it is one of processor time."""
    law = as_transfer_function(law_of(CONTROLLER, RATE))
    for e in (None, fx.coefficients({"torque_bias.torque_nm": 0.1})):
        simulate_law(np.zeros(2), RATE, plant.coefficients(RIGID), law, effects=e)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    monkeypatch.setattr(baseline_fit, "BUDGET_S", 7.0)


def test_the_plain_baselines_read_records(tmp_path):
    gain = {"torque_bias.torque_nm": 0.3}
    folder = recorded(tmp_path / "rig", {**RIGID, "jm": 0.021, **gain})
    refit = refit_only(folder, RIGID)
    assert refit.verdict == "unexplained" and refit.evidence.excitation == "record"
    assert refit.evidence.reported_on == "records" and refit.causes == []
    best = lowest_bic(folder, RIGID)
    assert best.verdict == "effect"
    assert best.effects[0] in ("torque_bias", "asymmetric_friction", "gravity", "cogging")
    left = [step.nrmse_position for step in best.steps]
    assert left[2] < 0.1 * left[1]


def test_pace_finds_delay_and_bias(tmp_path):
    folder = recorded(
        tmp_path / "rig", {**RIGID, "delay.time_s": 0.003, "torque_bias.torque_nm": 0.2}
    )
    found = pace(folder, RIGID)
    assert set(found.effects) == {"delay", "torque_bias"}
    assert found.parameters["delay.time_s"].value == pytest.approx(0.003, abs=2e-4)
    assert found.parameters["torque_bias.torque_nm"].value == pytest.approx(0.2, rel=0.05)
    assert found.steps[-1].nrmse_position < 0.2 * found.steps[0].nrmse_position


def test_bam_stops_at_m2_for_stribeck_friction(tmp_path, monkeypatch):
    folder = recorded(
        tmp_path / "rig",
        {**RIGID, "stribeck_friction_motor.torque_nm": 0.2,
         "stribeck_friction_motor.velocity_rad_s": 0.3},
        noise_rad=2e-4, seconds=BRIEF_S,
    )  # fmt: skip
    monkeypatch.setattr(baseline_fit, "BUDGET_S", 14.0)
    found = bam(folder, RIGID)
    assert found.notes[0].startswith("Chosen: M2")
    assert found.effects == ["stribeck_friction_motor"]
    assert found.steps[-1].nrmse_position < 0.5 * found.steps[0].nrmse_position


def test_bam_names_nothing_for_other_values_of_the_datasheet(tmp_path, monkeypatch):
    monkeypatch.setattr(baseline_fit, "BUDGET_S", 3.5)
    found = bam(recorded(tmp_path / "rig", {**RIGID, "fvm": 0.13}, seconds=BRIEF_S), RIGID)
    assert found.verdict == "parameters_only" and found.notes[0].startswith("Chosen: M1")


def test_the_plant_of_bam_is_the_bare_rig_where_its_terms_are_zero(tmp_path):
    flexible = {**RIGID, "k0": 300.0, "k1": 500.0}
    problem = Problem(recorded(tmp_path / "rig", flexible), flexible)
    drive = problem.evidence.simulator.drive(3)
    friction = {"base": flexible["fsm"], "viscous": flexible["fvm"]}
    ours = problem.play(problem.nominal, [3])[3]
    theirs = play(drive, RATE, flexible, friction)
    assert np.std(theirs - ours) < 3e-3 * np.std(ours)


def test_each_term_of_the_ladder_has_a_name_in_the_catalogue():
    assert list(LADDER) == ["M1", "M2", "M3", "M4", "M5", "M6"]
    assert set(NAMES) <= set(fx.EFFECTS)
    named = {term for terms in NAMES.values() for term in terms} | {"stribeck_speed", "alpha"}
    assert {term for terms in LADDER.values() for term in terms} == named


def test_mujoco_recovers_inertia_and_viscous_damping(tmp_path):
    pytest.importorskip("mujoco.sysid")
    from fjr_validation.blind.mujoco_sysid import mujoco_sysid

    light = {**RIGID, "fs": 0.0, "fsm": 0.0}  # its friction loss is another law than ours
    folder = recorded(tmp_path / "rig", {**light, "jm": 0.03, "fvm": 0.2})
    found = mujoco_sysid(folder, {**light, "fs": 1e-6})
    assert found.parameters["motor_armature"].value == pytest.approx(0.06, rel=0.03)
    assert found.parameters["motor_damping"].value == pytest.approx(0.3, rel=0.03)
    assert found.steps[-1].nrmse_position < 0.2 * found.steps[0].nrmse_position


def test_cma_finds_the_least_within_the_box():
    free = {"a": Free(0.0, -1.0, 1.0), "b": Free(5.0, 0.0, 10.0)}
    found, cost = cma_fit(lambda v: (v["a"] - 0.3) ** 2 + (v["b"] - 12.0) ** 2, free, 5.0)
    assert found["a"] == pytest.approx(0.3, abs=0.02) and found["b"] == pytest.approx(
        10.0, rel=0.01
    )
    assert cost == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize(("method", "absent"), [("bam", "cma"), ("mujoco", "tabulate")])
def test_a_check_without_a_rivals_library_does_not_begin(monkeypatch, method, absent):
    check_methods(["fjr", method])
    monkeypatch.setattr(
        methods, "find_spec", lambda name: None if name == absent else find_spec(name)
    )
    with pytest.raises(InputError, match=f"{method} needs {absent}, .*fjr-rig.rivals."):
        check_methods(["fjr", method])
    check_methods(["fjr", "refit"])


def test_wilson_is_the_published_interval():
    share = wilson([True] * 8 + [False] * 2)  # Wilson 1927: centre and half width in closed form
    z, p, n = 1.959964, 0.8, 10
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    assert share.low == pytest.approx(centre - half, rel=1e-5)
    assert share.high == pytest.approx(centre + half, rel=1e-5)


def line(method: str, errors: tuple[float, ...], reported_on: str = "records") -> dict:
    diagnosis = {
        "verdict": "effect", "effects": ["backlash"], "confidence": 1.0,
        "causes": [{"effect": "backlash", "present": 1.0}],
        "evidence": {"reported_on": reported_on},
        "steps": [{"nrmse_position": error} for error in errors],
    }  # fmt: skip
    return {"case": "closed_0000", "method": method, "seconds": 2.0, "diagnosis": diagnosis}


def test_the_table_sets_methods_beside_each_other():
    answer = Answer.from_json({
        "world": "closed", "kind": "none", "causes": [], "weak": [], "laws": [],
        "plant": {"k0": 1.0}, "nominal": {}, "settings": {}, "noise_rad": 0.0, "scatter": 0.0,
        "remainder": 0.0, "excitation": "multisine", "controller_known": True, "facts": {},
    })  # fmt: skip
    lines = [line("fjr", (0.4, 0.1)), {"case": "closed_0000", "method": "bam", "seconds": 1.0,
             "error": "no"}]  # fmt: skip
    outcomes = [Outcome.of(answer, one) for one in lines]
    text = "\n".join(side_by_side(lines, outcomes, ["fjr", "bam"]))
    ours, theirs = (row for row in text.splitlines() if row.startswith(("| fjr", "| bam")))
    assert "| 10 % [10, 10] n=1 | 25 % [25, 25] n=1 |" in ours
    assert theirs.count("| - |") >= 1 and "| 100 % [20.7, 100] n=1 | 1 [1, 1] n=1 |" in theirs
    assert side_by_side(lines, outcomes, ["fjr"]) == []
    assert held_out(line("fjr", (0.4, 0.1), "none")) is None


def test_every_method_can_be_loaded():
    assert {"refit", "bic", "bam", "pace", "mujoco"} <= set(METHODS)
