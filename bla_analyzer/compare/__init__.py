"""A BLA beside reference models: distance V, resonances, the best amplitude, intervals."""
