"""Parameter files of the rig: ROS 2 parameter YAML, read exactly as rcl reads it.

    /rig/simulator:
      ros__parameters:
        k1: 0.0

One file serves the nodes (`--params-file`) and `fjr run` / `fjr simulate`. So that both see the
same values, libyaml reads the YAML, as it does for rcl, scalars are typed by rcl's rules rather
than YAML's (`1e-3` is a double, `010` is 8, `n` is false) and what rcl would refuse is refused
here. Names may be nested and hold the wildcards `*` and `**`; where several entries name a node,
the later one holds. What the file holds for nodes of other programs is passed over.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

import yaml
from yaml import MappingNode, Node, ScalarNode, SequenceNode

from fjr_kit.atomic import write_whole
from fjr_kit.errors import InputError, shown

from .bounded_yaml import Loader, YamlProblem, bounded_events, yaml_problems
from .parameters import ParameterGroup, nearest
from .rcl_values import read_scalar, write_value
from .topics import NAMESPACE
from .topics import NODES as PROGRAMS

NODES = ("excitation", "controller", "simulator")
"""Base names of the rig's nodes."""

MOST_CHARACTERS = 2**20
"""Longest parameter file, and longest value of an option."""

NODES_OWN = frozenset(["joint", "readers", "use_sim_time", "start_type_description_service"])
"""Parameters that each node has beside its group."""

_ALIKE = 0.8
"""Likeness from which on a name is a misspelt one: simulater is, controller_manager is not."""
_DEEPEST = 20
"""Most levels of a parameter file; libyaml takes long over thousands of brackets."""
_MOST_DIRECTIVES = 10
_MOST_VALUES = 100_000
_PARAMETERS = "ros__parameters"


def load_parameter_file(
    path: str | Path,
    namespace: str = NAMESPACE,
    nodes: Sequence[str] = NODES,
    groups: Mapping[str, ParameterGroup] | None = None,
    bare: str | None = None,
) -> dict[str, dict[str, Any]]:
    """Read a parameter file.

    Args:
        path: the YAML file.
        namespace: where the rig's nodes are.
        nodes: base names of the nodes that it may name.
        groups: descriptions by node base name. What a wildcard gives then goes to the nodes that
            have such a parameter, and `NODES_OWN` are left out, so that a file that serves the
            nodes serves whoever needs only these descriptions.
        bare: base name of the node that a file is for which holds values and names no node.

    Returns:
        {node base name: {parameter: value}} of the nodes that the file names; a list is a tuple.
        The values are not yet checked against descriptions: see `ParameterGroup.check`.

    Raises:
        InputError: no such file, no YAML, another shape, a name that is like that of a node or in
            the rig's namespace, none of the nodes, a value that rcl refuses, a wildcard's parameter
            that no node has.
    """
    root = _compose(_read(path), str(path))
    if bare is not None and _names_no_node(root):
        return {bare: dict(_values(path, bare, root, ""))}
    found: dict[str, dict[str, Any]] = {}
    known = ", ".join(f"{namespace}/{node}" for node in nodes)
    foreign = []
    for name, parameters in _nodes(path, root, "") if root is not None else ():
        matching = [node for node in nodes if _matches(name, f"{namespace}/{node}")]
        if not matching and _is_foreign(name, namespace, nodes):
            foreign.append(name)
            continue
        if not matching:
            raise InputError(f"{path}: there is no node {name[:200]}; the nodes are {known}.")
        values = dict(_values(path, name, parameters, ""))
        for node in matching:
            found.setdefault(node, {}).update(values)
        if groups is not None:
            _leave_out(f"{path}: {name}", values, {node: groups[node] for node in matching}, found)
    if not found and foreign:
        raise InputError(f"{path}: names only {foreign[0][:200]}; the rig's nodes are {known}.")
    if not found:
        raise InputError(
            f"{path}: names no node; write values below {namespace}/{nodes[-1]}: {_PARAMETERS}, or "
            "leave the file out."
        )
    return found


def refuse_empty(path: str | Path) -> None:
    """Raise InputError if a parameter file can't be read or holds nothing.

    ROS itself starts a node with an empty one as if nobody had named it.
    """
    if _compose(_read(path), str(path)) is None:
        raise InputError(
            f"{path}: names no node; write values below a node's name: {_PARAMETERS}, or leave "
            "the file out."
        )


def _leave_out(
    where: str,
    values: Mapping[str, Any],
    groups: Mapping[str, ParameterGroup],
    found: Mapping[str, dict[str, Any]],
) -> None:
    """Take from what was found of these nodes the values of one entry that are not theirs.

    A parameter that none of them has stays if one node is named, whose group then refuses it.
    """
    for parameter in values:
        having = [node for node, group in groups.items() if parameter in group]
        own = parameter in NODES_OWN
        if not having and not own and len(groups) > 1:
            names = [name for group in groups.values() for name in group.names]
            raise InputError(
                f"{where}: none of the nodes {', '.join(groups)} has a parameter "
                f"{shown(parameter)}; did you mean {nearest(parameter, names)}?"
            )
        for node in groups:
            if own or (having and node not in having):
                found[node].pop(parameter, None)


def save_parameter_file(
    path: str | Path,
    values: Mapping[str, Mapping[str, Any]],
    groups: Mapping[str, ParameterGroup] | None = None,
    namespace: str = NAMESPACE,
    head: Sequence[str] = (),
) -> None:
    """Write a parameter file that `load_parameter_file` and the nodes read back exactly.

    Args:
        path: the file; replaced as a whole or not at all.
        values: {node base name: {parameter: value}}.
        groups: descriptions by node base name, for a comment beside each value.
        namespace: where the rig's nodes are.
        head: lines of a comment above all values.

    Raises:
        InputError: an empty list (a parameter file cannot hold one), or the file cannot be written.
    """
    lines = [f"# {line}" for line in head]
    for node, parameters in values.items():
        lines += [f"{namespace}/{node}:", f"  {_PARAMETERS}:" + ("" if parameters else " {}")]
        group = groups.get(node) if groups else None
        for name, value in parameters.items():
            if isinstance(value, (list, tuple)) and not value:
                raise InputError(f"{path}: {name} of {node} is empty: give it at least one value.")
            comment = f"  # {group[name].help}" if group and name in group else ""
            lines.append(f"    {name}: {write_value(value)}{comment}")
    write_whole(Path(path), "\n".join(lines) + "\n")


def parse_value(text: str, where: str) -> Any:
    """Parse one value as rcl would in a parameter file; a list gives a tuple.

    Raises:
        InputError: rcl would refuse it; the sentence starts with `where`.
    """
    try:
        node = _compose(text, where)
    except InputError:
        node = None
    if isinstance(node, ScalarNode):
        return read_scalar(node, where)
    if isinstance(node, SequenceNode):
        return _list(node, where)
    raise InputError(f"{where}: {shown(text)} is not a value.")


def _read(path: str | Path) -> str:
    """Return the text of the file."""
    try:
        with Path(path).open("rb") as file:
            text = file.read(MOST_CHARACTERS + 1)
        if len(text) > MOST_CHARACTERS:
            raise InputError(
                f"{path}: is longer than {MOST_CHARACTERS} bytes; name a parameter file."
            )
        return text.decode("utf-8")
    except IsADirectoryError:
        raise InputError(f"{path}: is a folder; name a parameter file.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not a text file in UTF-8.") from None


def _compose(text: str, where: str) -> Node | None:
    """Return the tree of a YAML text; None if it is empty.

    Raises:
        InputError: no YAML, or such as no parameter file is; the sentence starts with `where`.
    """
    directives = sum(line.startswith("%") for line in text.splitlines())
    if len(text) > MOST_CHARACTERS or directives > _MOST_DIRECTIVES:
        raise InputError(f"{where}: is longer, or has more YAML directives, than can be read.")
    try:
        for _ in bounded_events(text, deepest=_DEEPEST, most_scalars=_MOST_VALUES):
            pass
        with yaml_problems(text):
            return yaml.compose(text, Loader=Loader)
    except YamlProblem as problem:
        line = f"line {problem.line}: " if problem.line else ""
        raise InputError(f"{where}: {line}{problem}.") from None


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
            raise InputError(f"{path}: line {line}: {key.value[:200]} stands twice in {what}.")
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


def _names_no_node(root: Node | None) -> TypeGuard[MappingNode]:
    """Tell whether a file holds values and nothing below a name."""
    if not isinstance(root, MappingNode) or not root.value:
        return False
    return not any(isinstance(value, MappingNode) for _, value in root.value)


def _matches(pattern: str, name: str) -> bool:
    """Tell whether a name in the file, wildcards included, means the node of this full name."""
    expression = re.escape(pattern).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"/\w+")
    return re.fullmatch(expression, name, re.ASCII) is not None


def _is_foreign(name: str, namespace: str, nodes: Sequence[str]) -> bool:
    """Tell whether a name that means no node of the rig is that of another program's node."""
    known = [*nodes, *PROGRAMS.values()]
    misspelt = difflib.get_close_matches(name.rpartition("/")[2], known, 1, _ALIKE)
    return not misspelt and not name.startswith(f"{namespace}/")


def _values(path: str | Path, node_name: str, node: Node, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield (parameter, value); parameters below parameters are joined by dots, as ROS does."""
    for key, value in _entries(path, node, f"{_PARAMETERS} of {node_name}"):
        name = prefix + key
        where = f"{path}: line {value.start_mark.line + 1}: {name}"
        if isinstance(value, MappingNode):
            yield from _values(path, node_name, value, f"{name}.")
        elif isinstance(value, ScalarNode):
            yield name, read_scalar(value, where)
        else:
            yield name, _list(value, where)


def _list(node: Node, where: str) -> tuple[Any, ...]:
    if not all(isinstance(item, ScalarNode) for item in node.value):
        raise InputError(f"{where} must be a plain list of values.")
    values = tuple(read_scalar(item, where) for item in node.value)
    if not values:
        raise InputError(f"{where} is an empty list: give it at least one value.")
    if len({type(value) for value in values}) > 1:
        raise InputError(
            f"{where} mixes types, which ROS refuses: write every number with a decimal point."
        )
    return values
