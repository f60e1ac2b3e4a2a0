"""The simulated drive as it runs in a node: lockstep, real time, control, faults."""
