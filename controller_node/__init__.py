"""Controller: the control law behind its safety functions, and the node that runs it.

Reference and measured position go in, motor torque comes out. Begin with `pd_filtered` (the default
law, paper eq. 12); `transfer_function` is any other linear law, `structures` are those that have
names (PID, cascades), `controller_file` the form in which a user states one, `law` makes the law of
a description, `gains` names what is unknown of it, `polynomials` multiplies and adds ratios in
z^-1. `safety` holds limits and trips (parameters in `limits`), `supervised_law` puts the law behind
them, `lockstep` answers each position with its reference, `real_time` does so on the wall clock,
where `pace` checks the stamps. `node` speaks ROS and listens to each `source` of a signal.

    >>> from controller_node import CONTROLLER, describe
    >>> describe(CONTROLLER.check({"p": 150.0}))  # as an experiment description holds it
    {'kind': 'pd_filtered', 'p': 150.0, 'd': 60.0, 'n': 24.0, 'torque_limit_nm': None}
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .pd_filtered import CONTROLLER, describe
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["CONTROLLER", "describe"]
