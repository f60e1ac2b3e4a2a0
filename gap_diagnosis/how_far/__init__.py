"""How far the gap shrinks, on data that neither fitted nor selected anything.

Models go in; their errors in position and torque, with intervals, come out. `ledger` is the one
place that computes them, with the waterfall from nominal to remainder and the intervals of
`bootstrap`; `bla_gap` adds the errors in BLA and distortion of steady periods. `run_comparison` and
`bla_comparison` keep rig and simulations side by side for the report, `steady_view` what only
steady periods show.
"""
