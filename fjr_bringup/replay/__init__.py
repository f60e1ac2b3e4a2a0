"""Bags played again, as they are or into a graph that answers: `fjr replay`.

Begin with `player` (messages published with their clock, or with an `external_clock`; `messages`
reads them, `publishing` says what is asked) or with `lockstep` (`fjr replay --into`: nodes of a
`lockstep_plan`, the signals of the `bag` through `excitation`, `controller` and `simulator` in
place of the rig's own, then `comparison`).
"""
