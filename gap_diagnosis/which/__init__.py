"""Which effects cause the gap: the search over effects, and the tests of presence.

Begin with `stepwise`, which goes from cause to cause: `extension` takes one step, `polish` ends its
leading fits, `exchange` puts causes in place of each other, and `friction_left` says when pairs of
frictions are tried. `equivalents` knows which effects may stand in for which. What the search has
reached is `found`; `presence` tests it (invariance, interval), `slewing` says how long a limited
rate is seen to act, `narrow_band` how far a motion tells linear laws from each other.

What the torque and the encoder are is asked apart: `torque_timing` says first how a recorded torque
acts between its samples, `late_torque` brings forward one that comes late, `drift_gate` fits a
drift of friction, and `rounding` plays an encoder of coarse steps.
"""
