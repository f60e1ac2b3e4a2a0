"""All three nodes in one process: `python -m fjr_bringup.composed`."""

from __future__ import annotations

import sys

from controller_node.node import ControllerNode
from excitation_node.node import ExcitationNode
from fjr_interface import ros
from fjr_sim_node.node import SimulatorNode


def main() -> int:
    """Run the three nodes on one executor."""
    return ros.run(SimulatorNode, ControllerNode, ExcitationNode)


if __name__ == "__main__":
    sys.exit(main())
