"""The simulated rig with free parameters, and the misfit between it and the record."""
