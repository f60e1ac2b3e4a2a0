"""The report of a diagnosis: one HTML page that opens offline, figures, and the updated parameters.

A finished investigation goes in; `gap_output` writes all files or none. Pages: `gap_report` for
steady periods, `record_report` for records, with values that both share in `outcome_values`, plots
in `gap_plots`, `gap_level_plots`, `record_plots` and `waterfall`, figures for papers in
`gap_figures` and `record_figures`, tables in `gap_tables`. `updated_parameters` is the file with
which nodes and campaigns go on.
"""
