"""The simulated rig with free parameters, and its error against what was recorded.

`rig_model.Model` is a bare plant with effects. Steady periods: `simulated_rig.Simulator`
repeats the loop and `misfit` weighs the errors of its lines. Records: `record_rig` plays each run
from its true start, in the loop that `record_loop` finds (gains by `controller_gains`) or held by
the observer of `prediction`, with a torque as `record_torque` takes it; `evidence` cuts the errors
into windows (`lapped`), cells and parts. `nominal` reads datasheets, `controller_check` compares
torque and law, `discretisation` measures the simulation's own error.
"""
