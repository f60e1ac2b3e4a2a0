"""The only part of the contract that imports rclpy: QoS, parameters, start and stop of nodes.

Begin with `runtime.RigNode`, of which every node is one. `program` is a node's command line,
`spinning` its life, `graph_node` what it knows of the others; `fast_dds` chooses the transport.
"""
