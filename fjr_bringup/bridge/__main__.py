"""`python -m fjr_bringup.bridge serve` or `observe` runs the bridge."""

import sys


def main() -> int:
    """Run the node; Ctrl-C ends it quietly while it is still being loaded, too."""
    try:
        from .node import main as run
    except KeyboardInterrupt:
        return 130
    return run()


if __name__ == "__main__":
    sys.exit(main())
