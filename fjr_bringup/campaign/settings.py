"""Values of single parameters that a user gives beside a parameter file."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from fjr_interface.parameter_file import parse_value
from fjr_kit.errors import InputError

from .plan import GROUPS


def parse_settings(
    settings: Sequence[str], nodes: Collection[str] = tuple(GROUPS)
) -> dict[str, dict[str, Any]]:
    """Return {node: {parameter: value}} of `node.parameter=value` texts, of certain nodes.

    Raises:
        InputError: a text that is not of this form, a node that is none, or a value that is none.
    """
    overrides: dict[str, dict[str, Any]] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        node, dot, parameter = name.strip().partition(".")
        if not equals or not dot or node not in nodes:
            raise InputError(
                f"--set {setting[:60]}: write NODE.PARAMETER=VALUE, where NODE is one of "
                f"{', '.join(nodes)}."
            )
        overrides.setdefault(node, {})[parameter.strip()] = parse_value(
            text, f"--set {setting[:60]}"
        )
    return overrides
