"""The blind check: cases from a second plant, sealed answers, committed verdicts, scores.

Begin with `check`, which keeps the order: `cases` are drawn and made by a process of their own,
their answers sealed (`seal`), all `methods` give verdicts, then come `score` and `report`.
`second_plant` shares nothing with the simulator; `baselines` are the plain methods; `calibrate`
sets confidence and intervals on training cases.
"""
