"""Unevenly sampled signals brought onto one even grid, with the error stated.

Begin with `resampled_reader`, which reads such a bag as `bags.reader` reads an even one.
`stamp_line` finds the clock behind jittered stamps, `band_limited` the values between samples,
`hold_equivalent` the torque that was held, `grid_stream` does so piece by piece, `accuracy` states
and limits the error.
"""
