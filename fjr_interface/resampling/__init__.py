"""Unevenly sampled signals brought onto one even grid, with the error stated."""
