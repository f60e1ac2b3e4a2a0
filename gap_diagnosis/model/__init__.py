"""The simulated rig with free parameters, and its error against what was recorded.

`rig_model.Model` is a bare plant with effects. `record_rig` plays each run from where it begins
(`record_start`) by its `drive`: the loop that `record_loop` finds (gains by `controller_gains`,
begun by `gain_search`) or the observer of `prediction`, with a torque as `record_torque` takes it.
Steady periods are runs of one mean period (`steady_runs`, begun at `near_steady` states);
`simulated_rig.Simulator` repeats all their periods for the BLA. Of records too slow for inertia
`quasi_static` takes the torque, where friction slides (`sliding`); `record_length` bounds how long
records may be. `evidence` cuts the errors into windows (`lapped`), cells (of bands, `octaves`) and
`parts`, with the `twist` of a transmission whose link has an encoder; a torque counts as the motion
that it would make against the loop (`held_motion`). `small_changes` leads from the position to the
lines of the evidence and back, `torque_errors` compares by torque. `nominal` reads datasheets,
`controller_check` compares torque and law, `discretisation` measures the simulation's own error.
"""
