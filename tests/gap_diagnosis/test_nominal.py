"""The nominal file: what is refused, in one sentence; units that the record contradicts."""

from __future__ import annotations

import math

import pytest
from gap_cases import simulate_case

from fjr_interface.parameter_file import save_parameter_file
from fjr_kit.errors import InputError
from fjr_sim_node.plant import PLANT
from gap_diagnosis.model.nominal import UNITS, read_nominal, refuse_wrong_units
from gap_diagnosis.model.rig_model import Model

PAPER = PLANT.defaults()


def write(tmp_path, values, node="simulator"):
    file = tmp_path / "datasheet.yaml"
    save_parameter_file(file, {node: values})
    return file


def test_paper_and_a_whole_file_are_read(tmp_path):
    assert read_nominal("paper") == PAPER
    other = {**PAPER, "k0": 1400.0}
    assert read_nominal(write(tmp_path, other)) == other


def test_a_rigid_axis_may_have_no_link_at_all(tmp_path):
    """Zero inertia is none, where no transmission drives it; a flexible joint needs one."""
    alone = {"jm": 90.0, "j": 0.0}
    for given in ({**alone, "k0": math.inf}, alone):
        found = read_nominal(write(tmp_path, given))
        assert Model.nominal(found).rigid and found["jm"] + found["j"] == 90.0
    with pytest.raises(InputError, match="j must lie in"):
        read_nominal(write(tmp_path, {**alone, "k0": 900.0}))


def test_a_campaign_file_with_all_effects_off_is_a_nominal(tmp_path):
    off = {"backlash.half_gap_rad": 0.0, "torque_saturation.limit_nm": math.inf}
    file = write(tmp_path, {**PAPER, **off, "noise_std_rad": 1e-5, "sample_rate_hz": 1000.0})
    assert read_nominal(file) == PAPER


def test_values_may_stand_by_themselves(tmp_path):
    file = tmp_path / "axis.yaml"
    file.write_text("{jm: 90.0, fsm: 20.0, k0: .inf}")
    found = read_nominal(file)
    assert found["jm"] == 90.0 and found["fsm"] == 20.0 and Model.nominal(found).rigid
    file.write_text("jm: 90.0\nmass: 3.0\n")
    with pytest.raises(InputError, match=r"axis.yaml: .*mass"):
        read_nominal(file)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"k00": 1500.0}, "'k00'; did you mean k0?"),
        ({"jm": -0.2}, "jm must lie in [1e-09, 10000] kg m2, not -0.2"),
        ({"fs": "five"}, "fs must be a number in N m"),
        ({"k0": math.nan}, "k0 must be a number in N m/rad"),
        ({"backlash.half_gap_rad": 1e-3}, "backlash.half_gap_rad switches an effect on"),
        ({"asymmetric_friction.viscous_nm_s_rad": 0.1}, "viscous_nm_s_rad switches an effect on"),
        ({"torque_saturation.limit_nm": 50.0}, "torque_saturation.limit_nm switches an effect on"),
    ],
)
def test_bad_values_are_refused_with_file_and_name(tmp_path, change, words):
    file = write(tmp_path, {**PAPER, **change})
    with pytest.raises(InputError) as caught:
        read_nominal(file)
    assert str(caught.value).startswith(str(file)) and words in str(caught.value)


@pytest.mark.parametrize(
    ("given", "missing"),
    [({"jm": 0.2, "k0": 900.0}, "j"), ({"jm": 0.2, "j": 0.1}, "k0"), ({"fsm": 0.2}, "jm"),
     ({"k0": 900.0}, "jm, j")],
)  # fmt: skip
def test_missing_inertias_and_stiffness_are_all_named(tmp_path, given, missing):
    with pytest.raises(InputError, match=rf": {missing} missing;.*--nominal paper"):
        read_nominal(write(tmp_path, given))


def test_what_a_datasheet_does_not_give_is_zero_and_an_inertia_alone_is_a_rigid_axis(tmp_path):
    nothing = {"fs": 0.0, "fsm": 0.0, "fv": 0.0, "fvm": 0.0, "k1": 0.0}
    for given in ({"jm": 95.0}, {"jm": 95.0, "k0": math.inf}):
        found = read_nominal(write(tmp_path, given))
        assert found == {"jm": 95.0, "j": 0.0, "k0": math.inf, **nothing}
        assert Model.nominal(found).rigid
    flexible = {"jm": 0.2, "j": 0.1, "k0": 900.0, "fsm": 1.0}
    assert read_nominal(write(tmp_path, flexible)) == {**nothing, **flexible}


def test_an_infinite_link_inertia_is_a_held_link_and_with_a_rigid_axis_refused(tmp_path):
    given = {"jm": 0.2, "j": math.inf, "k0": 900.0, "fsm": 1.0}
    held = Model.nominal(read_nominal(write(tmp_path, given)))
    assert not held.rigid and not held.link_moves and held.whole_plant["j"] == math.inf
    assert set(held.plant) == {"jm", "fsm", "fvm", "k0", "k1"}
    with pytest.raises(InputError, match="nothing could move"):
        read_nominal(write(tmp_path, {**given, "k0": math.inf}))


def test_a_file_of_other_nodes_is_no_nominal(tmp_path):
    with pytest.raises(InputError, match="/rig/simulator is missing"):
        read_nominal(write(tmp_path, {"p": 200.0}, "controller"))
    with pytest.raises(InputError, match="cannot be read"):
        read_nominal(tmp_path / "none.yaml")


@pytest.fixture(scope="module")
def record():
    return simulate_case(seed=4, levels_rad=(1e-2,), realizations=1, base_frequency_hz=0.5).recorded


@pytest.mark.parametrize(("name", "unit"), [(n, u) for n, us in UNITS.items() for u in us])
def test_a_value_in_another_unit_is_named_with_its_value_in_si(record, name, unit):
    wrong = PAPER[name] / UNITS[name][unit]
    if not PLANT[name].low <= wrong <= PLANT[name].high:
        pytest.skip("such a value is out of range already")
    with pytest.raises(InputError) as caught:
        refuse_wrong_units(record, {**PAPER, name: wrong}, "sheet.yaml")
    sentence = str(caught.value)
    assert sentence.startswith(f"sheet.yaml: {name} = {wrong:g}")
    assert f"would; give it in {PLANT[name].unit}: {name}:" in sentence
    given = float(sentence.rsplit(":", 1)[1].rstrip("."))
    assert given == pytest.approx(PAPER[name], rel=1e-4)


@pytest.mark.parametrize(
    "effects",
    [
        {},
        {"backlash.half_gap_rad": 2e-3},
        {"piecewise_stiffness.zone_rad": 0.01, "piecewise_stiffness.soft_ratio": 0.2},
        {"torque_saturation.limit_nm": 20.0},
        {"delay.time_s": 1e-3},
        {"quadratic_friction.motor_nm_s2_rad2": 5.0},
        {"extra_mode.inertia_kg_m2": 0.05, "extra_mode.frequency_hz": 20.0},
        {"hysteresis.torque_nm": 8.0},
    ],
)
def test_a_strong_effect_is_not_taken_for_a_wrong_unit(effects):
    case = simulate_case(effects, seed=8, base_frequency_hz=0.5, realizations=1)
    warning = refuse_wrong_units(case.recorded, PAPER, "sheet.yaml")
    assert warning is None or "check values and units" in warning


def test_far_off_values_that_no_unit_explains_are_warned_of(record):
    warning = refuse_wrong_units(record, {**PAPER, "jm": 1.2, "k0": 300.0}, "sheet.yaml")
    assert warning is not None and "sheet.yaml" in warning
