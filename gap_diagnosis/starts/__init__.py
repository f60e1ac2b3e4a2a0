"""Where the fits of effects begin: which effects, within which bounds, from which sizes.

Evidence of records goes in, starts of fits come out. Begin with `search_space`: starts and bounds
of each effect of the `catalogue`, in the measures of `scales`.

- Tried: `screening` tries the starts of each effect, `candidates` predicts the gain of each, and
  `from_parts` begins a law of several parts where the fit of one part has ended.
- Ripples: `ripples` finds their cycles by a transform `over_angle`, which picks the `promising`
  ones, and by what these gain in `upper_bands`; `ripples_passed` says how much of one is seen.
- Read off the record by regression: from the missing torque (`seen_torques`), of frictions, load
  and inertia at once (`seen_together`), of a mass behind a spring (`seen_resonance`), of the
  inertia of one run (`seen_inertia`), from the twist of a transmission (`seen_twist`), and for
  another split of the inertia (`other_splits`).
"""
