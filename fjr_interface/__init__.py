"""The contract of the rig: topics, clock, experiment description, parameters and bags.

Everything that two rooms of the product must agree on is said here once, and nothing else is.
Only `fjr_interface.ros` imports rclpy; all other modules work with no ROS present.
"""
