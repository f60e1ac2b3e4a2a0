"""Bags played again, as they are or into a graph that answers: `fjr replay`."""
