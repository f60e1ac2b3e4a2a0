"""Parameters and health of a node as the messages of ROS have them."""

from __future__ import annotations

import importlib
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

from ..health import Health
from ..parameters import Parameter


def to_descriptor(parameter: Parameter) -> ParameterDescriptor:
    """Return the ROS descriptor of a parameter: description, unit and range."""
    descriptor = ParameterDescriptor(
        name=parameter.name,
        description=parameter.help,
        dynamic_typing=True,  # so that `-p k1:=0` is understood as 0.0
    )
    default, low, high = parameter.default, parameter.low, parameter.high
    if isinstance(default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=low, to_value=high)]
    elif isinstance(default, int) and not isinstance(default, bool):
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    return descriptor


def message_class(name: str) -> Any:
    """Return the class of `package/msg/Name`; None if it is not installed."""
    package, _, kind = name.partition("/msg/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), kind)
    except (ImportError, AttributeError):
        return None


def plain(value: Any) -> Any:
    """Return array parameters as lists, others as they are."""
    return list(value) if hasattr(value, "typecode") else value


def to_diagnostics(node: str, hardware_id: str, health: Health) -> DiagnosticArray:
    """Return how a node is as a message, not stamped yet."""
    status = DiagnosticStatus(name=f"{node}: loop", hardware_id=hardware_id)
    status.level, status.message = bytes([health.level]), health.summary
    status.values = [KeyValue(key=key, value=text) for key, text in health.texts()]
    return DiagnosticArray(status=[status])
