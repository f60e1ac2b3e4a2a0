"""Estimators of the BLA, each for the excitation that it needs.

Spectra of realizations go in; the BLA with variances of noise and of nonlinear distortion comes
out. `robust` takes several realizations of a multisine (paper eq. 11), `fast` one with detection
lines, `arbitrary` noise, sweeps and moves by windows of `local_fit`. `local_polynomial` removes
leakage and transients; `windows` chooses the windows of local fits, `repeats` pools realizations
of one reference. `sensitivity` is that of the loop, S = 1/(1 + G C).
"""
