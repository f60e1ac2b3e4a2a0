"""The only part of the contract that imports rclpy: QoS, parameters, start and stop of nodes.

Begin with `runtime.RigNode`, of which every node is one. `program` is a node's command line,
`spinning` its life, `session` ROS from its start to its end, `graph_node` what it knows of the
others, `deferred_service` a service that answers when its action is done. `messages` are parameters
and health as ROS messages, `claims` names that one process of this machine holds at a time;
`fast_dds` chooses the transport.
"""
