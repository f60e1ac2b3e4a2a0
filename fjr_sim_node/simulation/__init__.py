"""The simulated rig: one sample at a time, one realization in closed loop, with its noise."""
