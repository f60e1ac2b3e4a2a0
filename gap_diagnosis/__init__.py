"""The sim-to-real gap: where it lies, which unmodelled effect causes it, how far it shrinks.

Imports and works with no ROS present.
"""
