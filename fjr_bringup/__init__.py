"""The `fjr` command: campaigns on the ROS graph or in batch, recorder, import, analysis."""
