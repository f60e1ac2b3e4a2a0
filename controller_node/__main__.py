"""`python -m controller_node` and the console script `controller_node` run the node."""

import sys

from fjr_interface.ros.program import run_module


def main() -> int:
    """Run the node; return the exit status."""
    return run_module("controller_node.node")


if __name__ == "__main__":
    sys.exit(main())
