"""Values of ROS parameters as YAML scalars: typed and written as rcl's parser reads them.

Not YAML's rules but rcl's hold: `1e-3` is a double, `010` is 8, `n` is false.
"""

from __future__ import annotations

import math
import re
from typing import Any

from yaml import ScalarNode

from fjr_kit.errors import InputError

_LONGEST_INTEGER = 100
"""Digits beyond which an integer certainly exceeds 64 bits."""
_TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_FLOAT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?\.?(inf|infinity|nan)", re.ASCII | re.IGNORECASE)


def read_scalar(node: ScalarNode, where: str) -> bool | int | float | str:
    """Return the value in the type that rcl's parser gives it; raise InputError if it is empty."""
    text = node.value
    if node.style in ("'", '"', "|", ">"):
        return text
    if not text:
        raise InputError(f"{where} has no value.")
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        return _integer(text)
    if _NOT_FINITE.fullmatch(text):
        return float(text.replace(".", ""))
    if _FLOAT.fullmatch(text) and math.isfinite(float(text)):
        return float(text)
    return text


def _integer(text: str) -> int | float | str:
    """Return a C integer constant, as strtoll does.

    What exceeds 64 bits is a double, as strtod reads it, and what exceeds that one a text.
    """
    digits = text.lstrip("+-")
    hexadecimal = digits[:2] in ("0x", "0X")
    base = 16 if hexadecimal else 8 if digits[0] == "0" else 10
    if len(digits.lstrip("0xX")) < _LONGEST_INTEGER:
        number = int(text, base)
        if -(2**63) <= number < 2**63:
            return number
    try:
        double = float.fromhex(text) if hexadecimal else float(text)
    except OverflowError:
        return text
    return double if math.isfinite(double) else text


def write_value(value: Any) -> str:
    """Return a value such that rcl reads back the same type and, of a double, the same bits."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(write_value(item) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _write_float(value)
    escaped = (c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in str(value))
    return f'"{"".join(escaped)}"'


def _write_float(value: float) -> str:
    if math.isnan(value):
        return ".nan"
    if math.isinf(value):
        return ".inf" if value > 0 else "-.inf"
    mantissa, exponent, power = repr(float(value)).partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + exponent + power
