"""Simulator: the flexible-joint plant, its closed-loop batch simulation, and the node."""
