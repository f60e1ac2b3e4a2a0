"""The flexible-joint plant, compiled (paper eqs. 2-5).

Begin with `flexible_joint`: parameters, and the motion under a held torque. `torques` holds the
laws of plant and effects, `presliding` friction before slip. `motion` is one Runge-Kutta step
between events, `stick_slip` finds when that ends and which way each side goes, `step_size` chooses
the step. `spring` is the transmission with its effects, `statics` what holds the plant at a place,
`places` where parameters stand among those of the kernels.
"""

from .flexible_joint import (
    PLANT,
    advance,
    advance_with_effects,
    coefficients,
    moves_as_one,
    rigid_sums,
    steps_per_second,
    with_added,
)
from .places import FS, FSM, FV, FVM, JM, K0, K1, J

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
    "steps_per_second",
    "with_added",
]
