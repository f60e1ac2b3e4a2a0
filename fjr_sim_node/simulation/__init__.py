"""The simulated rig without ROS: drive, plant and encoder.

Begin with `simulator` (parameters, encoder noise, one realization in batch); `closed_loop` is the
loop of controller and rig, `rig` one sample of it, which the node calls, too.
"""
