"""Which effects cause the gap: fits, the search, and the tests of presence.

Begin with `stepwise`. Its modules, in the order in which a search uses them:

- What is looked for: the effects of `catalogue`; `equivalents` knows which may stand in for which.
- Where fits begin: the starts of `search_space` in the measures of `scales`. `screening` tries
  each, `candidates` predicts the gain of each start, `ripples` finds the cycles of ripples and
  `from_parts` begins a law of several parts where the fit of one part has ended.
- Starts read off the record by regression: from the missing torque (`seen_torques`), of frictions,
  load and inertia at once (`seen_together`), from the twist of a transmission (`seen_twist`), and
  for another split of the inertia (`other_splits`).
- Fits: `cell_fits` begins them; `reweighted` repeats `least_squares` with the variances that the
  model itself leaves (`cell_weights`; `unseen_friction` is that of runs that no fit has seen);
  `harmonics` adds a second harmonic to a ripple.
- What the torque and the encoder are: `torque_timing` says first how a recorded torque acts between
  its samples, `drift_gate` fits a drift of friction, `rounding` plays an encoder of coarse steps.
- The search: `stepwise` goes from cause to cause, `extension` takes one step, `polish` ends its
  leading fits, `exchange` puts causes in place of each other, `friction_left` says when pairs of
  frictions are tried. What it has reached is `found`.
- The tests: `comparison` says what a fit leaves on unseen parts, `gains` whether one explanation
  leaves less than another; `presence` tests what was found (invariance, interval) and
  `ripples_passed` how much of a ripple is seen; `estimates` are the intervals.
"""
