"""Fits of a model with given effects to the evidence, and what one leaves on unseen parts.

Effects and `starts` go in; fitted parameters, their intervals and comparisons of fits come out.
Begin with `cell_fits`, which begins fits and keeps them; `reweighted` repeats the least squares of
`fjr_kit` with the variances that the model itself leaves (`cell_weights`; `unseen_friction` is that
of runs that no fit has seen), and `harmonics` adds a second harmonic to a ripple. `comparison` says
what a fit leaves on unseen parts, `gains` whether one explanation leaves less than another, and
`estimates` are the intervals.
"""
