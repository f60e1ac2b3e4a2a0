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
    moves_as_one,
    rigid_sums,
    with_added,
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
    "moves_as_one",
    "rigid_sums",
    "with_added",
]
