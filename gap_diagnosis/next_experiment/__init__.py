"""The experiment that best separates the explanations that the data leave.

A set of explanations goes in; other references or a loaded rig (`trials`) are simulated with each
of them, and `choice` proposes the one in which they differ most beyond noise.
"""
