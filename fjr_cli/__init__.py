"""The `fjr` command: one module for each command, with its options and what it prints.

Begin with `app`, which lists them all. What a command computes is in the package that it belongs
to. Commands import what they need when they are called, so that `fjr --help` is quick, and go
through `cli_errors`, so that no traceback reaches a user.
"""
