"""Bridge between the rig's topics and those of a rig under ros2_control: `fjr bridge`.

Begin with `mapping` (which command answers which state, without ROS); `node` moves the messages.
"""
