"""Parameter files: read as rcl reads them, written so that rcl reads them back."""

from __future__ import annotations

import json
import math
import re
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from processes import completed

from fjr_interface.parameter_file import load_parameter_file, parse_value, save_parameter_file
from fjr_interface.parameters import Parameter, ParameterGroup
from fjr_kit.errors import InputError

READ_BY_RCL = """
import json, os, sys
os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
import rclpy
from rclpy.node import Node
found = []
for path in sys.argv[1:]:
    rclpy.init(args=["--ros-args", "--params-file", path])
    node = Node("simulator", namespace="/rig", automatically_declare_parameters_from_overrides=True,
                start_parameter_services=False, enable_rosout=False)
    own = ("use_sim_time", "start_type_description_service")
    names = [n for n in node._parameters if n not in own]
    found.append({n: [type(node._parameters[n].value).__name__, repr(node._parameters[n].value)]
                  for n in names})
    node.destroy_node()
    rclpy.shutdown()
print(json.dumps(found))
"""

TYPED_BY_RCL = """\
rig:
  simulator:
    ros__parameters:
      a: 1e-3
      b: -1.5e+3
      c: 010
      d: 0x10
      e: on
      n: n
      f: .inf
      g: -.Inf
      h: 1:30
      i: 1_000
      j: "1.0"
      k: 1.
      l: 08
      m: 9223372036854775808
      o: 1e999
      u: 07777777777777777777777777
      v: 0xffffffffffffffffffff
      w: ٣.٤
      p: '2'
      q: null
      deep: {r: 2, s.t: word}
"""


def write(tmp_path, text: str, name: str = "rig.yaml"):
    path = tmp_path / name
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "/rig/simulator:\n  ros__parameters:\n    k1: 0.5\n",
        "rig/simulator: {ros__parameters: {k1: 0.5}}",
        "rig:\n  simulator:\n    ros__parameters:\n      k1: 0.5\n",
        "/rig:\n  simulator:\n    ros__parameters:\n      k1: 0.5\n",
        "/**/simulator:\n  ros__parameters:\n    k1: 0.5\n",
        "/*/simulator:\n  ros__parameters:\n    k1: 0.5\n",
    ],
)
def test_every_way_to_name_a_node(tmp_path, text):
    assert load_parameter_file(write(tmp_path, text)) == {"simulator": {"k1": 0.5}}


def test_wildcard_names_all_nodes_and_the_later_entry_holds(tmp_path):
    wild = "/**:\n  ros__parameters:\n    rate: 2.0\n    seed: 1\n"
    own = "/rig/simulator:\n  ros__parameters:\n    rate: 3.0\n"
    for_all = {"rate": 2.0, "seed": 1}
    after = load_parameter_file(write(tmp_path, wild + own))
    assert after == {
        "excitation": for_all,
        "controller": for_all,
        "simulator": {"rate": 3.0, "seed": 1},
    }
    before = load_parameter_file(write(tmp_path, own + wild))
    assert before["simulator"] == for_all


@pytest.mark.parametrize("text", ["", "# nothing yet\n", "{}", "rig: {}"])
def test_file_that_names_no_node_is_refused(tmp_path, text):
    with pytest.raises(InputError, match=r"rig\.yaml: names no node; write values below /rig/sim"):
        load_parameter_file(write(tmp_path, text))


@pytest.mark.parametrize("name", ["move_group", "/**/move_group", "/arm/controller_manager"])
def test_nodes_of_other_programs_are_passed_over_but_a_misspelt_name_is_not(tmp_path, name):
    own = "/**:\n  simulator: {ros__parameters: {k1: 0.5}}\n"
    other = f"{name}: {{ros__parameters: {{rate: 2}}}}\n"
    assert load_parameter_file(write(tmp_path, other + own)) == {"simulator": {"k1": 0.5}}
    with pytest.raises(InputError, match=r"rig\.yaml: names only /.*; the rig's nodes are /rig/ex"):
        load_parameter_file(write(tmp_path, other))
    for misspelt in ("/**/simulatr", "/rig/sim", "fjr_sim_node", "/rigg/controller"):
        text = own + f"{misspelt}: {{ros__parameters: {{rate: 2}}}}\n"
        with pytest.raises(InputError, match=f"there is no node /?{re.escape(misspelt)}"):
            load_parameter_file(write(tmp_path, text))


GROUPS = {
    "excitation": ParameterGroup(Parameter("rate", 1.0, "Hz", "Rate")),
    "controller": ParameterGroup(Parameter("rate", 1.0, "Hz", "Rate"), Parameter("p", 1.0, "", "")),
    "simulator": ParameterGroup(Parameter("rate", 1.0, "Hz", "Rate"), Parameter("k1", 1.0, "", "")),
}


def test_wildcard_gives_each_node_its_own_parameters(tmp_path):
    wild = "/**: {ros__parameters: {rate: 2.0, k1: 3.0, use_sim_time: true, joint: elbow}}\n"
    own = "/rig/controller: {ros__parameters: {p: 4.0, readers: recorder}}\n"
    assert load_parameter_file(write(tmp_path, wild + own), groups=GROUPS) == {
        "excitation": {"rate": 2.0},
        "controller": {"rate": 2.0, "p": 4.0},
        "simulator": {"rate": 2.0, "k1": 3.0},
    }
    misspelt = write(tmp_path, "/**: {ros__parameters: {k2: 3.0}}")
    with pytest.raises(
        InputError, match=r"/\*\*: none of the nodes .* parameter 'k2'; did you mean k1 or "
    ):
        load_parameter_file(misspelt, groups=GROUPS)


HEAD = "/rig/simulator:\n  ros__parameters:\n    k1: "


@pytest.mark.parametrize("text", ["٣.٤", "\uff11", "1_0", "1e99999", "9" * 309, "-" + "9" * 5000])
def test_only_what_fits_a_double_in_plain_digits_is_a_number(tmp_path, text):
    assert load_parameter_file(write(tmp_path, HEAD + text)) == {"simulator": {"k1": text}}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("9" * 308, float("9" * 308)),
        ("-0x" + "f" * 40, -float(16**40 - 1)),
        ("0" + "7" * 40, float("7" * 40)),  # strtod knows no octal numbers
        ("0" * 5000 + "7", 7),
    ],
)
def test_integer_beyond_64_bits_is_read_as_strtod_reads_it(tmp_path, text, value):
    found = load_parameter_file(write(tmp_path, HEAD + text))["simulator"]["k1"]
    assert found == value and type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (HEAD + "[" * 3000, "is nested too deeply"),
        ("[" * 2**20, "is nested too deeply"),
        ("? " * 2**19, "is nested too deeply"),
        (HEAD + "[" + ",".join(["1e-3"] * 200_000) + "]", "holds more than 100000 names and"),
        ("{" + "a," * 450_000 + "}", "holds more than 100000 names and values"),
        ("".join(f"%TAG !a{i}! b\n" for i in range(40_000)) + "--- a", "more YAML directives"),
        ("#" * (2**20 + 1), "is longer than 1048576 bytes"),
    ],
    ids=["brackets", "megabyte of brackets", "keys of keys", "list", "names", "tags", "long"],
)
def test_text_that_would_cost_minutes_is_refused(tmp_path, text, says):
    with pytest.raises(InputError, match=says):
        load_parameter_file(write(tmp_path, text))
    with pytest.raises(InputError):
        parse_value(text, "--set simulator.k1")


def test_another_namespace(tmp_path):
    path = tmp_path / "rig.yaml"
    save_parameter_file(path, {"controller": {"p": 1.0}}, namespace="/left")
    assert load_parameter_file(path, namespace="/left") == {"controller": {"p": 1.0}}
    with pytest.raises(InputError, match="no node /left/controller"):
        load_parameter_file(path)


VALUES = st.one_of(
    st.floats(allow_nan=False, allow_subnormal=False),
    st.integers(-(2**63), 2**63 - 1),
    st.booleans(),
    st.text(st.characters(exclude_categories=["Cs"])),
    st.lists(st.floats(allow_nan=False, allow_subnormal=False), min_size=1).map(tuple),
)
NAMES = st.from_regex(r"[a-z][a-z0-9_]{0,8}", fullmatch=True)


@given(
    st.dictionaries(
        st.sampled_from(("excitation", "simulator")), st.dictionaries(NAMES, VALUES), min_size=1
    )
)
def test_round_trip_keeps_type_and_bits(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("trip") / "rig.yaml"
    save_parameter_file(path, values)
    loaded = load_parameter_file(path)
    assert repr(loaded) == repr(values)
    again = path.with_name("again.yaml")
    save_parameter_file(again, loaded)
    assert again.read_bytes() == path.read_bytes()


def test_comments_come_from_the_descriptions(tmp_path):
    group = ParameterGroup(Parameter("k0", 1500.0, "N m/rad", "Stiffness", 0.0, 1e8))
    path = tmp_path / "rig.yaml"
    save_parameter_file(path, {"simulator": {"k0": 1e-7, "x": (1.0, 2e9)}}, {"simulator": group})
    assert path.read_text().splitlines() == [
        "/rig/simulator:",
        "  ros__parameters:",
        f"    k0: 1.0e-07  # {group['k0'].help}",
        "    x: [1.0, 2000000000.0]",
    ]


def test_not_a_number_survives(tmp_path):
    path = tmp_path / "rig.yaml"
    save_parameter_file(path, {"simulator": {"x": math.nan}})
    assert math.isnan(load_parameter_file(path)["simulator"]["x"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("/rig/simulator: [", r"line 1: this is not YAML"),
        ("a: 1\n\tb: 2", r"line 2: this is not YAML"),
        ("--- {}\n--- {}\n", r"not YAML .but found another document"),
        ("- 1\n", r"line 1: below the file names with values must stand"),
        ("word", r"below the file names"),
        ("/rig/simulator: 3", r"simulator must hold ros__parameters"),
        ("/rig/simulator:\n  k1: 3.0\n", r"line 2: k1 must hold ros__parameters"),
        ("ros__parameters: {k1: 0.0}", r"must stand below a node's name"),
        ("/rig/simulator:\n  ros__parameters: 3\n", r"line 2: below ros__parameters of /rig/sim"),
        ("/rig/simulater:\n  ros__parameters: {}", r"no node /rig/simulater; the nodes are /rig/e"),
        ("simulator:\n  ros__parameters: {}", r"no node /simulator"),
        ("/rig/simulator: {ros__parameters: {k1: }}", r"k1 has no value"),
        ("/rig/simulator: {ros__parameters: {k1: []}}", r"k1 is an empty list"),
        ("/rig/simulator: {ros__parameters: {k1: [1.0, 2]}}", r"k1 mixes types"),
        ("/rig/simulator: {ros__parameters: {k1: [[1.0]]}}", r"k1 must be a plain list"),
        ("/rig/simulator: {ros__parameters: {[a]: 1.0}}", r"something that is not a name"),
        (
            "/rig/simulator:\n  ros__parameters:\n    k1: 1.0\n    k1: 2.0\n",
            r"line 4: k1 stands twice",
        ),
        (
            "/rig/simulator: {ros__parameters: {a: &x 1.0, b: *x}}",
            r"line 1: YAML aliases .* are not read",
        ),
        ("[" * 5000 + "]" * 5000, r"nested too deeply"),
    ],
)
def test_bad_file_is_refused_in_one_sentence(tmp_path, text, says):
    path = write(tmp_path, text)
    with pytest.raises(InputError, match=says) as refused:
        load_parameter_file(path)
    sentence = str(refused.value)
    assert sentence.startswith(f"{path}: ") and sentence.endswith(".") and "\n" not in sentence


def test_unreadable_and_binary_files(tmp_path):
    with pytest.raises(InputError, match=r"none\.yaml: cannot be read: No such file"):
        load_parameter_file(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="is a folder; name a parameter file"):
        load_parameter_file(tmp_path)
    path = tmp_path / "rig.yaml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not a text file in UTF-8"):
        load_parameter_file(path)


def test_refused_write_leaves_the_old_file(tmp_path):
    path = write(tmp_path, "old")
    with pytest.raises(InputError, match="x of simulator is empty"):
        save_parameter_file(path, {"simulator": {"x": ()}})
    with pytest.raises(InputError, match=r"cannot be written: No such file"):
        save_parameter_file(tmp_path / "no" / "rig.yaml", {})
    assert [p.name for p in tmp_path.iterdir()] == ["rig.yaml"] and path.read_text() == "old"


def test_rcl_reads_the_same(tmp_path):
    """rcl itself, in a process of its own, gives each value the type and bits that we give it."""
    typed = write(tmp_path, f"{TYPED_BY_RCL}      x: {'9' * 309}\n", "typed.yaml")
    written = tmp_path / "written.yaml"
    save_parameter_file(
        written,
        {
            "simulator": {
                "a": 1e-5,
                "b": 0.1,
                "c": 1e22,
                "d": 3,
                "e": True,
                "f": 'no\n"\\ \x7fé😀',
                "g": (1.0, 1e-9, -math.inf),
                "h": -0.0,
                "i": 5e-300,
                "y": 2.0,
            }
        },
    )
    run = completed(sys.executable, "-c", READ_BY_RCL, str(typed), str(written))
    assert run.returncode == 0, run.stderr
    for path, by_rcl in zip((typed, written), json.loads(run.stdout), strict=True):
        ours = load_parameter_file(path)["simulator"]
        as_text = {
            name: ["list", repr(list(value))]
            if isinstance(value, tuple)
            else [type(value).__name__, repr(value)]
            for name, value in ours.items()
        }
        assert by_rcl == as_text
