"""`python -m fjr_cli` is the `fjr` command."""

from .app import main

main()
