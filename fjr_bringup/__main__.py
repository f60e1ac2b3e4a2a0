"""`python -m fjr_bringup` is the `fjr` command."""

from .cli import main

main()
