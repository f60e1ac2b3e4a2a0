"""Where the gap lies: lines, amplitudes, times, and the torque that is missing.

`residual_map` tests every line of real minus simulated against noise; `residual_torque` is the
torque that would explain the measured motion, and `torque_curves` draws it over velocity, position
and deflection; `remainder` says with which quantity the torque goes that the best model lacks.
`telltale` puts that torque beside the law of a named cause, over the quantity at which it acts.
"""
