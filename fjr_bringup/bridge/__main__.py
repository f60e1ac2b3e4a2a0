"""`python -m fjr_bringup.bridge serve` or `observe` runs the bridge."""

import sys

from fjr_interface.ros.program import run_module

if __name__ == "__main__":
    sys.exit(run_module("fjr_bringup.bridge.node"))
