"""The flexible-joint plant, compiled: torques, smooth motion, stick and slip, step size."""

from .flexible_joint import (
    FS,
    FSM,
    FV,
    FVM,
    JM,
    K0,
    K1,
    PLANT,
    J,
    advance,
    advance_with_effects,
    coefficients,
    rigid_sums,
)

__all__ = [
    "FS",
    "FSM",
    "FV",
    "FVM",
    "JM",
    "K0",
    "K1",
    "PLANT",
    "J",
    "advance",
    "advance_with_effects",
    "coefficients",
    "rigid_sums",
]
