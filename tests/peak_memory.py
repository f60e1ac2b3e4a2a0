"""`fjr`, which says at its end how much memory it took at most; a program for `python -m`."""

from __future__ import annotations

import sys
from pathlib import Path

from fjr_cli.app import main

if __name__ == "__main__":
    try:
        main()
    finally:
        status = Path("/proc/self/status").read_text().splitlines()
        peak = next(line for line in status if line.startswith("VmHWM"))
        print("peak", int(peak.split()[1]) // 1024, file=sys.stderr)
