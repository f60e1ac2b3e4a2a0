"""Bridge between the rig's topics and those of a rig under ros2_control: `fjr bridge`."""
