"""All three nodes in one process: `python -m fjr_bringup.graph.composed`."""

from __future__ import annotations

import sys

from controller_node.node import ControllerNode
from excitation_node.node import ExcitationNode
from fjr_interface.ros import spinning
from fjr_interface.ros.program import Program
from fjr_sim_node.node import SimulatorNode


def main() -> int:
    """Run the three nodes on one executor."""
    program = Program("python -m fjr_bringup.graph.composed", __doc__)
    return spinning.run(SimulatorNode, ControllerNode, ExcitationNode, program=program)


if __name__ == "__main__":
    sys.exit(main())
