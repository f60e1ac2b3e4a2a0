"""Design of experiments: best amplitude, flat torque spectrum, shortest experiment.

Begin with `amplitude` (`fjr amplitude`), `shape` (`fjr shape`, algorithm 1 of the paper around a
rig) or `planner` (`fjr plan`). They measure on a `bench`, the batch simulation or the ROS graph,
and take what comes as `measured` levels. `planned` is what a campaign is expected to record;
`shaping_output` writes the shaped excitation.
"""
