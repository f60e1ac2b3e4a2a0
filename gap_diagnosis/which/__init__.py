"""Which effects cause the gap: fits, searches, and the tests of presence.

Both searches try the effects of `catalogue` from starts of `search_space` in the measures of
`scales`, choose where to begin by `screening` (ripples by `ripples`, `ripples_of_records` and
`seen_torques`), and fit by `least_squares`.

Steady periods: `fits`, `search`, `harmonics`, `reduced_fits`, then `attribution`, `estimates` and
`confidence`. Records: `cell_fits` with the remainder in the covariance (`cell_weights`, and
`unseen_friction` of runs that no fit has seen), `stepwise` with its single step in `extension` and
causes put in place of each other in `exchange`, then `presence` (repeats, invariance, interval).
`equivalents` knows what may stand in for what, `rounding` simulates and judges a coarse encoder.
"""
