"""Design of experiments: best amplitude, spectrum shaping, planning."""
