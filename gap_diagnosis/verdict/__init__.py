"""From the steps of a search to a verdict: which causes are kept, and how sure each one is.

The steps that `which` has found go in; a `Diagnosis` comes out. `tested_causes` fits all others
anew without each cause and tests what comes back, `kept_causes` takes out what does not pass, or
puts another effect in its place (`taken_out` has the fits, `named_twice` tells which name one cause
twice, `staying` which stay though they fail, `passed_over` what a search had passed over for them),
and `judgement` says what is present, how far the gap shrinks and what remains. `spoiling` takes
away what the runs that report speak against. `noisy_torque` counts noise of a torque that drives
the model, `between_regressions` lets intervals reach to where sizes would be if torques were
compared, and `coarse_encoder` asks last whether rounding explains what is left. `notes` are
sentences on fits that a person should know of, `not_named` those on causes that just fail;
`contenders` are the explanations that a verdict chose among.
"""
