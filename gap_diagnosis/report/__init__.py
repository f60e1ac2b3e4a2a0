"""The report of a diagnosis: one HTML page that opens offline, figures, and the updated parameters.

A finished investigation goes in; `gap_output` writes all files or none. The page is `gap_report`,
with values of `outcome_values`, plots of any record in `run_plots` and `waterfall`, and of steady
periods in `gap_plots` and `gap_level_plots`, and how each named cause shows in `telltales`; figures
for papers are in `run_figures` and `gap_figures`, tables in `gap_tables`. `updated_parameters` is
the file with which nodes and campaigns go on, `randomisation` the ranges of its parameters.
"""
