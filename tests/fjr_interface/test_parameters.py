"""Parameter descriptions: types, ranges, words, suggestions."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controller_node.pd_filtered import CONTROLLER
from excitation_node.multisine import EXCITATION
from fjr_interface.linear_axis import as_linear
from fjr_interface.parameters import Parameter, ParameterGroup, nearest
from fjr_kit.errors import InputError
from fjr_sim_node.effects import PARAMETERS
from fjr_sim_node.plant import PLANT
from fjr_sim_node.simulation.simulator import SIMULATOR

GROUP = ParameterGroup(
    Parameter("gain", 1.0, "N m/rad", "Gain", 0.0, 10.0),
    Parameter("count", 3, "", "Count", 1, 5),
    Parameter("on", False, "", "Switch"),
    Parameter("kind", "a", "", "Kind", choices=("a", "b")),
    Parameter("name", "joint", "", "Name"),
    Parameter("levels", (1.0, 2.0), "rad", "Levels", 0.0, 3.0),
)


@pytest.mark.parametrize("group", [PLANT, CONTROLLER, EXCITATION, GROUP])
def test_defaults_pass_their_own_check_unchanged(group):
    checked = group.check(group.defaults())
    assert checked == group.defaults()
    assert {k: type(v) for k, v in checked.items()} == {
        k: type(v) for k, v in group.defaults().items()
    }


@pytest.mark.parametrize(
    ("said", "linear"),
    [
        ("N m", "N"), ("kg m2", "kg"), ("rad/s", "m/s"), ("N m s/rad", "N s/m"),
        ("N m/rad3", "N/m3"), ("N m s2/rad2", "N s2/m2"), ("rad/N m", "m/N"), ("Hz", "Hz"),
        ("dB re 1 rad/(N m)", "dB re 1 m/N"), ("u of the rig (N m)", "u of the rig (N)"),
        ("a radical 3 N move", "a radical 3 N move"),
    ],
)  # fmt: skip
def test_units_of_a_linear_axis(said, linear):
    assert as_linear(said) == linear


def test_a_linear_axis_has_no_unit_of_a_rotary_one_but_of_phases():
    turning = {p.name for p in SIMULATOR.of_linear_axis() if "rad" in p.unit or "N m" in p.unit}
    angles = {p.name for p in PARAMETERS if p.role == "angle"}
    assert turning == angles
    assert SIMULATOR.of_linear_axis()["cogging.cycles_per_turn"].unit == "per 2 pi m"


@pytest.mark.parametrize("group", [PLANT, CONTROLLER, EXCITATION])
def test_every_parameter_is_described(group):
    for parameter in group:
        assert parameter.description
        assert parameter.help.startswith(parameter.description)
        assert parameter.unit in parameter.help
        assert parameter.name in group
        assert group[parameter.name] is parameter


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"gain": 2}, 2.0),
        ({"gain": 10.0}, 10.0),
        ({"count": 5.0}, 5),
        ({"on": True}, True),
        ({"kind": "b"}, "b"),
        ({"name": ""}, ""),
        ({"levels": [1, 3]}, (1.0, 3.0)),
        ({"levels": 2}, (2.0,)),
    ],
    ids=str,
)
def test_good_values_take_the_type_of_the_parameter(values, expected):
    (name,) = values
    value = GROUP.check(values)[name]
    assert value == expected
    assert type(value) is type(GROUP[name].default)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"gain": 10.1}, "gain must lie in [0, 10] N m/rad, not 10.1."),
        ({"gain": math.nan}, "gain must be a number in N m/rad, not nan."),
        ({"gain": math.inf}, "gain must lie in [0, 10] N m/rad, not inf."),
        ({"gain": "1"}, "gain must be a number in N m/rad, not '1'."),
        ({"gain": True}, "gain must be a number in N m/rad, not True."),
        ({"gain": None}, "gain must be a number in N m/rad, not None."),
        ({"gain": [1.0]}, "gain must be a number in N m/rad, not [1.0]."),
        ({"count": 2.5}, "count must be a whole number, not 2.5."),
        ({"count": 6}, "count must lie in [1, 5], not 6."),
        ({"count": math.inf}, "count must lie in [1, 5], not inf."),
        ({"on": 1}, "on must be true or false, not 1."),
        ({"kind": "c"}, "kind must be one of a, b, not 'c'."),
        ({"name": 7}, "name must be a text, not 7."),
        ({"levels": [1.0, 4.0]}, "levels must lie in [0, 3] rad, not 4.0."),
        ({"levels": None}, "levels must be a list of numbers, not None."),
        ({"gian": 1.0}, "There is no parameter 'gian'; did you mean gain?"),
        ({"nam": 1.0}, "There is no parameter 'nam'; did you mean name?"),
        ({"xe": 1.0}, "There is no parameter 'xe'; did you mean name or levels?"),
        ({"levels": "12"}, "levels must be a list of numbers, not '12'."),
        (
            {"gain": "9" * 400},
            f"gain must be a number in N m/rad, not '{'9' * 59}... (402 characters).",
        ),
    ],
    ids=str,
)
def test_bad_values_are_refused_with_a_sentence(values, sentence):
    with pytest.raises(InputError) as raised:
        GROUP.check(values)
    assert str(raised.value) == sentence
    with pytest.raises(InputError) as raised:
        GROUP.check(values, "rig.yaml")
    assert str(raised.value) == f"rig.yaml: {sentence}"


anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(),
    st.lists(st.floats()),
    st.lists(st.text()),
    st.dictionaries(st.text(), st.integers()),
)


@given(st.sampled_from(GROUP.names), anything)
def test_any_value_is_taken_in_range_or_refused(name, value):
    try:
        checked = GROUP.check({name: value})[name]
    except InputError as error:
        assert str(error).startswith(name)
        return
    parameter = GROUP[name]
    assert type(checked) is type(parameter.default)
    for item in checked if isinstance(checked, tuple) else (checked,):
        if isinstance(item, (int, float)):
            assert parameter.low <= item <= parameter.high


def test_names_that_are_alike_are_both_proposed():
    assert nearest("k", ["jm", "k0", "k1"]) == "k0 or k1"
    assert nearest("k10", ["jm", "k1", "k0"]) == "k1 or k0"
    assert nearest("jn", ["j", "jm", "k0"]) == "j"
    assert nearest("x", ["jm"]) == "jm"
    assert nearest("x", []) == ""
