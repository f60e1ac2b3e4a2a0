"""The only part of the contract that imports rclpy: QoS, parameters, start and stop of nodes."""
