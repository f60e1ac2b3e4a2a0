"""How far the gap shrinks, on data that neither fitted nor selected anything.

Models go in; their errors in position and torque, with intervals, come out. `held_out_gap` is the
one place that computes them for steady periods, `record_ledger` for records; `steps` makes the
waterfall from nominal to remainder of the former. `comparison` and `record_comparison` keep the
signals of rig and simulations side by side for the report.
"""
