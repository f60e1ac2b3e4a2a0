"""The simulated drive as it runs in the node.

Begin with `lockstep` (a sample waits for the torque of the one before) and `real_time` (samples by
the clock). `control` is pause, step and speed, which `services` and `simulation_interfaces` offer
to ROS by the actions of `control_services`. `faults` is the table of faults to rehearse,
`faulty_wire` what they do to the messages.
"""
