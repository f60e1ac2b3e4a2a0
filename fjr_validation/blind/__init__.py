"""The blind check: random rigs of a second plant, sealed answers, raw verdicts, scores.

A case is made by `worlds`: `rigs` draws plant and controller, `excitations` what is played on them,
`stage` friction, noise and datasheet, `causes` and `remainders` what the datasheet does not say,
`visibility` how large to make it; `second_plant` plays it. `check` runs a check, `lanes` side by
side, `check_cost` says beforehand what it takes; `outcome` and `score` judge its verdicts, `report`
writes them up in the words of `report_text`; `frozen` names by a hash what may not change between.
"""
