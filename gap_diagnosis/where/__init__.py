"""Where the gap lies: lines, amplitudes, times, and the residual torque."""
