"""`python -m fjr_sim_node` and the console script `fjr_sim_node` run the node."""

import sys

from fjr_interface.ros.program import run_module


def main() -> int:
    """Run the node; return the exit status."""
    return run_module("fjr_sim_node.node")


if __name__ == "__main__":
    sys.exit(main())
