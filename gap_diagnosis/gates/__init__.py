"""Is a periodic experiment fit for a diagnosis? Faults that are named instead of fitted.

Bags go in; a list of checks with value, limit and a sentence comes out, and what the data cannot
say. Begin with `gate_checks` (whole bags, one grid, periodic response, controller identity,
discretisation). `stationarity` compares the periods of a bag without a model; `bags_gate` asks last
whether the rig changes from bag to bag, by `bag_deviations` of each parameter and by
`bag_changes`, which parts a trend from scatter. `run_inertias` tells runs of different inertia,
`run_loads` those of different load, by what each shows (`by_run`).
`data_notes` says what to record for more.
"""
