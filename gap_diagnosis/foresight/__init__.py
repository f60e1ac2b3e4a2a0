"""What a diagnosis could show, before anything is recorded: standard errors and detection limits.

A planned experiment, or bags, and a nominal go in; begin with `foresee`. The nominal plays the rig
(`sight`), and what a changed parameter changes in its motion is weighed as the diagnosis weighs
errors. `bare_parameters` says how well the bare parameters would be known, `effect_limits` how
large each effect must be to be named; both rest on `fjr_kit.showing`. `foreseen` holds the outcome.
"""
