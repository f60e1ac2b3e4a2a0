"""From bags to the Best Linear Approximation: spectra, FRF, noise variance, distortion, report.

Imports and works with no ROS present.
"""
