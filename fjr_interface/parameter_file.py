"""Parameter files of the rig: ROS 2 parameter YAML, read exactly as rcl reads it.

    /rig/simulator:
      ros__parameters:
        k1: 0.0

One file serves the nodes (`--params-file`) and `fjr run` / `fjr simulate`. So that both see the
same values, scalars are typed by rcl's rules rather than YAML's (`1e-3` is a double, `010` is 8,
`n` is false) and what rcl would refuse is refused here. Names may be nested and hold the wildcards
`*` and `**`; where several entries name a node, the later one holds.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from .errors import InputError
from .parameters import ParameterGroup
from .topics import NAMESPACE

NODES = ("excitation", "controller", "simulator")
"""Base names of the rig's nodes."""

_PARAMETERS = "ros__parameters"
_TRUE = frozenset(["Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"])
_FALSE = frozenset(["N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"])
_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_FLOAT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NOT_FINITE = re.compile(r"[+-]?\.?(inf|infinity|nan)", re.IGNORECASE)


def load_parameter_file(
    path: str | Path, namespace: str = NAMESPACE, nodes: Sequence[str] = NODES
) -> dict[str, dict[str, Any]]:
    """Read a parameter file.

    Args:
        path: the YAML file.
        namespace: where the rig's nodes are.
        nodes: base names of the nodes that it may name.

    Returns:
        {node base name: {parameter: value}} of the nodes that the file names; a list is a tuple.
        The values are not yet checked against descriptions: see `ParameterGroup.check`.

    Raises:
        InputError: no such file, no YAML, another shape, an unknown node, a value that rcl refuses.
    """
    root = _compose(path)
    found: dict[str, dict[str, Any]] = {}
    if root is None:
        return found
    for name, parameters in _nodes(path, root, ""):
        matching = [node for node in nodes if _matches(name, f"{namespace}/{node}")]
        if not matching:
            known = ", ".join(f"{namespace}/{node}" for node in nodes)
            raise InputError(f"{path}: there is no node {name}; the nodes are {known}.")
        values = dict(_values(path, name, parameters, ""))
        for node in matching:
            found.setdefault(node, {}).update(values)
    return found


def save_parameter_file(
    path: str | Path,
    values: Mapping[str, Mapping[str, Any]],
    groups: Mapping[str, ParameterGroup] | None = None,
    namespace: str = NAMESPACE,
) -> None:
    """Write a parameter file that `load_parameter_file` and the nodes read back exactly.

    Args:
        path: the file; replaced as a whole or not at all.
        values: {node base name: {parameter: value}}.
        groups: descriptions by node base name, for a comment beside each value.
        namespace: where the rig's nodes are.

    Raises:
        InputError: an empty list (a parameter file cannot hold one), or the file cannot be written.
    """
    lines = []
    for node, parameters in values.items():
        lines += [f"{namespace}/{node}:", f"  {_PARAMETERS}:" + ("" if parameters else " {}")]
        group = groups.get(node) if groups else None
        for name, value in parameters.items():
            if isinstance(value, (list, tuple)) and not value:
                raise InputError(f"{path}: {name} of {node} is empty: give it at least one value.")
            comment = f"  # {group[name].help}" if group and name in group else ""
            lines.append(f"    {name}: {_to_yaml(value)}{comment}")
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written: {error.strerror}.") from None


def parse_value(text: str, where: str) -> Any:
    """Parse one value as rcl would in a parameter file; a list gives a tuple.

    Raises:
        InputError: rcl would refuse it; the sentence starts with `where`.
    """
    try:
        node = YAML(typ="safe", pure=True).compose(text)
    except YAMLError:
        node = None
    if isinstance(node, ScalarNode):
        return _scalar(node, where)
    if isinstance(node, SequenceNode):
        return _list(node, where)
    raise InputError(f"{where}: {text!r} is not a value.")


def _compose(path: str | Path) -> Node | None:
    """Return the tree of the file; None if it is empty."""
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file in UTF-8.") from None
    yaml = YAML(typ="safe", pure=True)
    try:
        for event in yaml.parse(text):
            if isinstance(event, AliasEvent):
                raise InputError(
                    f"{path}: line {event.start_mark.line + 1}: ROS does not read YAML "
                    "aliases (*): write the value out."
                )
        return yaml.compose(text)
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f"line {mark.line + 1}: " if mark else ""
        what = getattr(error, "problem", None) or str(error).splitlines()[0]
        raise InputError(f"{path}: {where}this is not YAML ({what}).") from None
    except RecursionError:
        raise InputError(f"{path}: is nested too deeply for a parameter file.") from None


def _entries(path: str | Path, node: Node, what: str) -> Iterator[tuple[str, Node]]:
    """Yield (key, value) of a mapping; raise InputError if it is none or a key stands twice."""
    where = f"{path}: line {node.start_mark.line + 1}"
    if not isinstance(node, MappingNode):
        raise InputError(f"{where}: below {what} names with values must stand.")
    seen = set()
    for key, value in node.value:
        if not isinstance(key, ScalarNode) or not key.value:
            raise InputError(f"{where}: {what} holds something that is not a name.")
        if key.value in seen:
            line = key.start_mark.line + 1
            raise InputError(f"{path}: line {line}: {key.value} stands twice in {what}.")
        seen.add(key.value)
        yield key.value, value


def _nodes(path: str | Path, node: Node, name: str) -> Iterator[tuple[str, Node]]:
    """Yield (full node name, its parameters) of every `ros__parameters` in the tree."""
    for key, value in _entries(path, node, name or "the file"):
        line = f"{path}: line {value.start_mark.line + 1}"
        if key == _PARAMETERS:
            if not name:
                raise InputError(f"{line}: {_PARAMETERS} must stand below a node's name.")
            yield name, value
        elif isinstance(value, MappingNode):
            yield from _nodes(path, value, f"{name}/{key.strip('/')}")
        else:
            raise InputError(
                f"{line}: {key} must hold {_PARAMETERS}, as in {{/rig/simulator: {{{_PARAMETERS}: "
                "{k1: 0.0}}}."
            )


def _matches(pattern: str, name: str) -> bool:
    """Tell whether a name in the file, wildcards included, means the node of this full name."""
    expression = re.escape(pattern).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")
    return re.fullmatch(expression, name) is not None


def _values(path: str | Path, node_name: str, node: Node, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield (parameter, value); parameters below parameters are joined by dots, as ROS does."""
    for key, value in _entries(path, node, f"{_PARAMETERS} of {node_name}"):
        name = prefix + key
        where = f"{path}: line {value.start_mark.line + 1}: {name}"
        if isinstance(value, MappingNode):
            yield from _values(path, node_name, value, f"{name}.")
        elif isinstance(value, ScalarNode):
            yield name, _scalar(value, where)
        else:
            yield name, _list(value, where)


def _list(node: Node, where: str) -> tuple[Any, ...]:
    if not all(isinstance(item, ScalarNode) for item in node.value):
        raise InputError(f"{where} must be a plain list of values.")
    values = tuple(_scalar(item, where) for item in node.value)
    if not values:
        raise InputError(f"{where} is an empty list: give it at least one value.")
    if len({type(value) for value in values}) > 1:
        raise InputError(
            f"{where} mixes types, which ROS refuses: write every number with a decimal point."
        )
    return values


def _scalar(node: ScalarNode, where: str) -> bool | int | float | str:
    """Return the value in the type that rcl's parser gives it."""
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


def _integer(text: str) -> int | float:
    """Return a C integer constant, a double where it exceeds 64 bits, as strtoll and strtod do."""
    digits = text.lstrip("+-")
    base = 16 if digits[:2] in ("0x", "0X") else 8 if digits[0] == "0" else 10
    number = int(text, base)
    return number if -(2**63) <= number < 2**63 else float(number)


def _to_yaml(value: Any) -> str:
    """Return a value such that rcl reads back the same type and, of a double, the same bits."""
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_to_yaml(item) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _float_to_yaml(value)
    escaped = (c if c.isprintable() and c not in '"\\' else f"\\U{ord(c):08x}" for c in str(value))
    return f'"{"".join(escaped)}"'


def _float_to_yaml(value: float) -> str:
    if math.isnan(value):
        return ".nan"
    if math.isinf(value):
        return ".inf" if value > 0 else "-.inf"
    mantissa, exponent, power = repr(float(value)).partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + exponent + power
