"""Which effects cause the gap: fits, the search, and the tests of presence.

The search (`stepwise`, its single step in `extension`, causes put in place of each other in
`exchange`) tries the effects of `catalogue` from starts of `search_space` in the measures of
`scales`, chooses where to begin by `screening` (ripples by `ripples` and `seen_torques`), and fits
by `least_squares` in `cell_fits`, with the remainder in the covariance (`cell_weights`, and
`unseen_friction` of runs that no fit has seen). It begins with `torque_timing`: how a recorded
torque acts between its samples; `drift_gate` fits a drift of friction. `comparison` says what a fit
leaves on unseen parts, `gains` whether one explanation leaves less than another; `presence` tests
what was found (repeats, invariance, interval); `estimates` are the intervals. `equivalents` knows
what may stand in for what.
"""
