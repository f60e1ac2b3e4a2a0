"""Excitation: odd random-phase multisines, spectrum shaping, and the node that streams them."""
