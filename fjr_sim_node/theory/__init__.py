"""What the rig does, predicted without simulating it.

Begin with `linear` (G0, paper eqs. 6-7, and its zero-order-hold equivalent); `delayed_loop` has
the delay margin, `statistical_linearisation` the BLA at an amplitude.
"""
