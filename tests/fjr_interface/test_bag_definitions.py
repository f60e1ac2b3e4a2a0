"""Message definitions of strangers: what is understood, and what is refused before it costs."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fjr_interface.bags.blocks import Topic
from fjr_interface.bags.definitions import MAX_DEFINITION, MAX_FIELDS, DefinitionError, typestore

STRANGE = "strange_msgs/msg/Strange"
IDL = """
#include "std_msgs/msg/Header.idl"
// generated
module strange_msgs { module msg {
  typedef double double__36[36];
  module Strange_Constants { const int32 X = -5; const string S = "a(b"; const long N = 3; };
  @verbatim (language="comment", text="hello (world)" "\\n" "more")
  struct Strange {
    std_msgs::msg::Header header;
    @default (value=0.0)
    double x;
    double__36 y;
    sequence<double, 3> z;
    string<5> q;
  };
}; };
"""


def fields(definition: str, encoding: str = "ros2msg") -> list[str]:
    store = typestore(Topic("/x", STRANGE, definition, encoding, "cdr"))
    return [name for name, _ in store.fielddefs[STRANGE][1]]


def refused(definition: str, encoding: str = "ros2msg") -> str:
    with pytest.raises(DefinitionError) as caught:
        fields(definition, encoding)
    return str(caught.value)


def test_honest_definitions_are_understood():
    msg = "# of a drive\nint32 GOOD=1\nstd_msgs/Header header # when\nfloat64 x 1.5\nfloat64[9] y\n"
    assert fields(msg) == ["header", "x", "y"]
    assert fields(IDL, "ros2idl") == ["header", "x", "y", "z", "q"]
    assert len(fields("".join(f"float64 x{i}\n" for i in range(MAX_FIELDS)))) == MAX_FIELDS
    assert fields("# long\n" * MAX_DEFINITION + "uint8 a\n") == ["a"]
    assert fields("float64[1000000] x\n") == ["x"]  # numbers cost no more than their bytes


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("string[1000000] position\n", "more than 1000 fields"),
        ("std_msgs/Header[1000] header\nfloat64 x\n", "more than 1000 fields"),
        ("".join(f"float64 x{i}\n" for i in range(1001)), "more than 1000 fields"),
        ("strange_msgs/Strange[] again\n", "more than 1000 fields"),
        ("uint8[0] nothing\n", "an array without elements"),
        ("strange_msgs/No x\n", "cannot be understood"),
        ("float64 x" + " " * MAX_DEFINITION + "\n", "longer than"),
        ("", "without fields"),
        ("}{", "cannot be understood"),
    ],
)
def test_definitions_beyond_any_signal_are_refused(definition, said):
    assert said in refused(definition)


@pytest.mark.parametrize("value", ["(((1)))", "1 << 40000000000", "2 * 3", "~(~(1))"])
def test_idl_expressions_are_not_evaluated(value):
    struct = "struct Strange { double x; };"
    text = f"module strange_msgs {{ module msg {{ const long A = {value}; {struct} }}; }};"
    assert refused(text, "ros2idl") == "cannot be understood"
    assert fields(text.replace(value, "-1"), "ros2idl") == ["x"]


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.data(), st.sampled_from(["ros2msg", "ros2idl"]))
def test_damaged_definitions_raise_nothing_else(data, encoding):
    text = IDL if encoding == "ros2idl" else "std_msgs/Header header\nfloat64[3] x\nstring<=4 y\n"
    at = data.draw(st.integers(0, len(text)))
    junk = data.draw(st.text(alphabet="(){}[]<>=@#\"'|^&~%*/+-: \n;a1Ω", max_size=40))
    end = data.draw(st.integers(at, min(len(text), at + 40)))
    with suppress(DefinitionError):
        assert fields(text[:at] + junk + text[end:], encoding)
