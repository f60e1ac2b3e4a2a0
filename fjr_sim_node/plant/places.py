"""Where the bare plant's parameters stand among those that the kernels take."""

from __future__ import annotations

import math

from fjr_kit.compiled import inlined

JM, J, FS, FSM, FV, FVM, K0, K1, LINK_BRISTLES, MOTOR_BRISTLES = range(10)
"""The stiffnesses of the bristles (`presliding`) are there only with effects."""


@inlined
def is_rigid(p):
    """Tell whether the link is one that nothing moves: the axis is rigid, or the link is held."""
    return p[J] == math.inf
