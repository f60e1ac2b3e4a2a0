"""The paper's experiments run again and set beside its statements: `fjr paper`.

Begin with `reproduction`, which runs the tasks of every part and writes the report. A part is a
module: `fig4`, `fig5`, `fig6`, `fig7_to_9` (with `fig9`, `resonance`, `two_inertia` and `agreement`
below it), and those that no figure of the paper shows: `prediction`, `certificate`, `leakage`,
`short_records`, `search_check`, `planner_check`, `shift_map`. `levels` is the task behind most,
`settings` the size of the experiments, `page` the report, `part` what each part hands to it,
`drawing` the form of its figures, `paper_cost` what it will take. A name with `_report` or
`_drawing` is a part's section or figures: `fig5_report`, `fig5_drawing`, `fig7_to_9_drawing`,
`certificate_report`, `certificate_drawing`.
"""
