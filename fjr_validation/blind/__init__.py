"""The blind check: cases from a second plant, sealed answers, committed verdicts, scores.

Begin with `check`, which keeps the order: `cases` are drawn (`draws`) above their detection limit
(`limits`) and made by a process of their own (`maker`), answers are sealed (`seal`), all `methods`
give verdicts, then `score` and `report`. `second_plant` shares nothing with the simulator;
`baselines` are the plain methods; `calibrate` sets confidence and intervals on training cases.
"""
