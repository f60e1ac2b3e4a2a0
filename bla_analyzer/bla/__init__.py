"""Estimators of the BLA, each for the excitation that it needs.

Spectra of realizations go in; the BLA with variances of noise and of nonlinear distortion comes
out. `robust` takes several realizations of a multisine (paper eq. 11), `fast` one with detection
lines, `arbitrary` noise, sweeps and moves by windows of `local_fit`. `local_polynomial` removes
leakage and transients; `repeats` pools realizations of one reference.
"""
