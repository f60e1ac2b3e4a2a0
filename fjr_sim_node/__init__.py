"""Simulator: the flexible-joint plant with its effects, its closed-loop simulation, and the node.

Torque goes in, measured positions come out, in lockstep or on the wall clock. Begin with `plant`
(paper eqs. 2-5, compiled, with exact sticking) and `effects` (the one table of what the bare plant
lacks). `simulation` is drive, plant and encoder sample by sample, and whole realizations in batch;
`theory` predicts without simulating (G0, delay margin, statistical linearisation); `drive` is what
`node` runs. Node and batch call the same compiled steps and agree bit for bit.

    >>> import controller_node, excitation_node
    >>> from fjr_sim_node import SIMULATOR, run_realization
    >>> law = controller_node.describe(controller_node.CONTROLLER.defaults())
    >>> values = excitation_node.EXCITATION.check({"periods": 1, "transient_periods": 1})
    >>> experiment = excitation_node.describe(values, level=0, realization=0, controller=law)
    >>> rig = SIMULATOR.check({"k0": 1200.0, "backlash.half_gap_rad": 1e-3})
    >>> run_realization(rig, experiment).position.shape  # in rad, one value for each sample
    (20000,)
"""

from typing import TYPE_CHECKING

from fjr_kit.public_names import deferred_names

if TYPE_CHECKING:
    from .simulation.closed_loop import Trajectory
    from .simulation.simulator import SIMULATOR, run_realization
    from .theory.linear import g0
else:
    __getattr__, __dir__ = deferred_names(__name__)

__all__ = ["SIMULATOR", "Trajectory", "g0", "run_realization"]
